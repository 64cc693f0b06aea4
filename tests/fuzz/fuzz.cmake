# SPDX-License-Identifier: Apache-2.0
# One libFuzzer program a target, with clang: cmake --preset fuzz && cmake --build --preset fuzz. Only what the
# targets reach is built (fuzz_sources.cmake). The code under test (`fuzzed`) has the sanitizers and counts coverage; the
# simulated world behind `evaluate` and the camera models (`beside`) have neither, since they would take most of the time.
set(fuzz_checks address,undefined,float-cast-overflow)
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
