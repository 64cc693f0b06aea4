# SPDX-License-Identifier: Apache-2.0
# Sources and libraries that the fuzz targets reach. fuzz.cmake builds these with clang; test_fuzz, in every build, is
# linked from the objects of these and of nothing else, so that a source that is missing here is found there.
file(GLOB_RECURSE fuzzed CONFIGURE_DEPENDS
     ${CMAKE_SOURCE_DIR}/ipc/*.cc ${CMAKE_SOURCE_DIR}/drivers/log/*.cc ${CMAKE_SOURCE_DIR}/drivers/can/wheel_*.cc
     ${CMAKE_SOURCE_DIR}/drivers/mavlink/*.cc ${CMAKE_SOURCE_DIR}/daemon/config/*.cc ${CMAKE_SOURCE_DIR}/tools/common/*.cc ${CMAKE_SOURCE_DIR}/tools/evaluate/*.cc
     ${CMAKE_SOURCE_DIR}/tools/report/*.cc ${CMAKE_SOURCE_DIR}/tools/trajectory/*.cc ${CMAKE_CURRENT_LIST_DIR}/*.cc)
list(FILTER fuzzed EXCLUDE REGEX "(_main|_test|/daemon/config/(options|build_info))[.]cc$")
foreach(reader bag bag_file bag_topics byte_file chunk euroc images kaist kitti mcap recording rectified_pair ros_bag ros_message sqlite_bag
        tum zurich)
  list(APPEND fuzzed ${CMAKE_SOURCE_DIR}/tools/import/${reader}.cc)
endforeach()
list(APPEND fuzzed ${CMAKE_SOURCE_DIR}/daemon/system/control_socket.cc ${CMAKE_SOURCE_DIR}/daemon/system/service_log.cc
     ${CMAKE_SOURCE_DIR}/tools/simulate/world/world_file.cc ${CMAKE_SOURCE_DIR}/tools/simulate/world/yaml_section.cc
     ${CMAKE_SOURCE_DIR}/tests/ipc/jpeg_images.cc ${CMAKE_SOURCE_DIR}/tests/ipc/png_images.cc
     ${CMAKE_SOURCE_DIR}/tests/daemon/synthetic_log.cc)
file(GLOB_RECURSE beside CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/tools/simulate/world/*.cc
     ${CMAKE_SOURCE_DIR}/tools/simulate/render/*.cc ${CMAKE_SOURCE_DIR}/tools/simulate/sensors/*.cc)
list(REMOVE_ITEM beside ${fuzzed})
list(APPEND beside ${CMAKE_SOURCE_DIR}/tools/simulate/simulation.cc ${CMAKE_SOURCE_DIR}/slam/geometry/camera.cc
     ${CMAKE_SOURCE_DIR}/slam/geometry/image_mask.cc
     ${CMAKE_SOURCE_DIR}/slam/geometry/se3.cc ${CMAKE_SOURCE_DIR}/slam/frame_result.cc)

add_library(farpoint_fuzz_base INTERFACE)
target_include_directories(farpoint_fuzz_base INTERFACE ${CMAKE_SOURCE_DIR})
target_include_directories(farpoint_fuzz_base SYSTEM INTERFACE
                           $<TARGET_PROPERTY:farpoint_ipc,INTERFACE_SYSTEM_INCLUDE_DIRECTORIES>)
target_link_libraries(farpoint_fuzz_base INTERFACE farpoint_test_paths Eigen3::Eigen Lcm::lcm PNG::PNG JPEG::JPEG
                      ZLIB::ZLIB spdlog::spdlog yaml-cpp hwy::hwy Threads::Threads BZip2::BZip2 Lz4::lz4
                      zstd::libzstd_shared SQLite::SQLite3)

# The listed objects of this build's own libraries.
set(fuzz_objects)
foreach(part slam ipc drivers daemon tools)
  set(names)
  foreach(source ${fuzzed} ${beside})
    file(RELATIVE_PATH name ${CMAKE_SOURCE_DIR}/${part} ${source})
    if(NOT name MATCHES "^[.][.]/")
      list(APPEND names ${name})
    endif()
  endforeach()
  list(JOIN names "|" pattern)
  list(APPEND fuzz_objects
       "$<FILTER:$<TARGET_OBJECTS:farpoint_${part}>,INCLUDE,/farpoint_${part}[.]dir/[./]*(${pattern})[.]o$>")
endforeach()
add_library(farpoint_fuzz_objects STATIC EXCLUDE_FROM_ALL ${fuzz_objects})
set_target_properties(farpoint_fuzz_objects PROPERTIES LINKER_LANGUAGE CXX)
target_link_libraries(farpoint_fuzz_objects PUBLIC farpoint_fuzz_base)
