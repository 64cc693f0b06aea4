# SPDX-License-Identifier: Apache-2.0
# One libFuzzer program a target, with clang: cmake --preset fuzz && cmake --build --preset fuzz. Only what the
# targets reach is built. The code under test has the sanitizers and counts coverage; the simulated world behind
# `evaluate` and the camera models have neither, since they would take most of the time.
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

set(fuzz_checks address,undefined,float-cast-overflow)
add_library(farpoint_fuzz_base INTERFACE)
target_include_directories(farpoint_fuzz_base INTERFACE ${CMAKE_SOURCE_DIR})
target_include_directories(farpoint_fuzz_base SYSTEM INTERFACE
                           $<TARGET_PROPERTY:farpoint_ipc,INTERFACE_SYSTEM_INCLUDE_DIRECTORIES>)
target_link_libraries(farpoint_fuzz_base INTERFACE farpoint_test_paths Eigen3::Eigen Lcm::lcm PNG::PNG JPEG::JPEG
                      ZLIB::ZLIB spdlog::spdlog yaml-cpp hwy::hwy Threads::Threads BZip2::BZip2 Lz4::lz4
                      zstd::libzstd_shared SQLite::SQLite3)
add_library(farpoint_beside_fuzzed STATIC EXCLUDE_FROM_ALL ${beside})
target_compile_options(farpoint_beside_fuzzed PRIVATE -O2)
add_library(farpoint_fuzzed STATIC EXCLUDE_FROM_ALL ${fuzzed})
target_compile_options(farpoint_fuzzed PUBLIC -O1 -gline-tables-only -fno-omit-frame-pointer
                       -fsanitize=fuzzer-no-link,${fuzz_checks} -fno-sanitize-recover=all)
foreach(part farpoint_fuzzed farpoint_beside_fuzzed)
  add_dependencies(${part} farpoint_lcm_types)
endforeach()
target_link_libraries(farpoint_beside_fuzzed PUBLIC farpoint_fuzz_base)
target_link_libraries(farpoint_fuzzed PUBLIC farpoint_fuzz_base farpoint_beside_fuzzed)
# They need one another.
target_link_libraries(farpoint_beside_fuzzed INTERFACE $<LINK_ONLY:farpoint_fuzzed>)

add_custom_target(fuzz)
foreach(name log message image config camera world dbc can control evaluate report bag db3 stamps mavlink layout)
  add_executable(fuzz_${name} EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/fuzz_main.cc)
  target_compile_definitions(fuzz_${name} PRIVATE FARPOINT_FUZZ_TARGET="${name}")
  target_link_libraries(fuzz_${name} PRIVATE farpoint_fuzzed)
  target_link_options(fuzz_${name} PRIVATE -fsanitize=fuzzer,${fuzz_checks})
  add_dependencies(fuzz fuzz_${name})
endforeach()
add_executable(fuzz_seeds EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/seeds_main.cc)
target_link_libraries(fuzz_seeds PRIVATE farpoint_fuzzed)
target_link_options(fuzz_seeds PRIVATE -fsanitize=${fuzz_checks})
add_dependencies(fuzz fuzz_seeds)
