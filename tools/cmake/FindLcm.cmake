# SPDX-License-Identifier: Apache-2.0
# LCM ships no CMake file, and its pkg-config file requires GLib's headers, which Farpoint does not need.
#   Lcm::lcm      the library          LCM_GEN   the type compiler
find_path(LCM_INCLUDE_DIR lcm/lcm.h)
find_library(LCM_LIBRARY lcm)
find_program(LCM_GEN lcm-gen)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Lcm REQUIRED_VARS LCM_LIBRARY LCM_INCLUDE_DIR LCM_GEN)
if(Lcm_FOUND AND NOT TARGET Lcm::lcm)
  add_library(Lcm::lcm UNKNOWN IMPORTED)
  set_target_properties(Lcm::lcm PROPERTIES IMPORTED_LOCATION "${LCM_LIBRARY}"
                        INTERFACE_INCLUDE_DIRECTORIES "${LCM_INCLUDE_DIR}")
endif()
