# SPDX-License-Identifier: Apache-2.0
# libcamera, by its headers and libraries: pkg-config is not needed elsewhere.
find_path(LIBCAMERA_INCLUDE_DIR libcamera/libcamera.h PATH_SUFFIXES libcamera)
find_library(LIBCAMERA_LIBRARY camera)
find_library(LIBCAMERA_BASE_LIBRARY camera-base)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Libcamera REQUIRED_VARS LIBCAMERA_LIBRARY LIBCAMERA_BASE_LIBRARY LIBCAMERA_INCLUDE_DIR)
if(Libcamera_FOUND AND NOT TARGET Libcamera::libcamera)
  add_library(Libcamera::libcamera UNKNOWN IMPORTED)
  set_target_properties(Libcamera::libcamera PROPERTIES IMPORTED_LOCATION "${LIBCAMERA_LIBRARY}"
                        INTERFACE_INCLUDE_DIRECTORIES "${LIBCAMERA_INCLUDE_DIR}"
                        INTERFACE_LINK_LIBRARIES "${LIBCAMERA_BASE_LIBRARY}")
endif()
