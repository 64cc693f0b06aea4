# SPDX-License-Identifier: Apache-2.0
# Flags and small functions used by every folder.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
# Programs of every folder land in one place, so that a build folder holds exactly one of each.
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Paths below the clone are hashed relative to it: a clone in another folder finds the objects of this one.
  set(launcher ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE_PROGRAM})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${launcher})
  set(CMAKE_C_COMPILER_LAUNCHER ${launcher})
endif()

# One instruction set for the whole program, the platform's baseline: Eigen's alignment must match Debian's
# Ceres. SIMD beyond it lives in the kernels and is chosen at run time by Highway. No contraction into FMA, so
# that the same source gives the same bits on every compiler setting.
add_compile_options(-ffp-contract=off)
set(FARPOINT_WARNINGS -Wall -Wextra -Wconversion -Werror)

set(FARPOINT_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize=")
if(FARPOINT_SANITIZE)
  add_compile_options(-fsanitize=${FARPOINT_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${FARPOINT_SANITIZE})
endif()

option(FARPOINT_FUZZ "Programs of libFuzzer, for clang: tests/fuzz/run" OFF)

# farpoint_library(name): every *.cc of the current folder and below becomes a static library.
function(farpoint_library name)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cc)
  list(FILTER sources EXCLUDE REGEX "_main\\.cc$")
  add_library(${name} STATIC ${sources})
  target_include_directories(${name} PUBLIC ${CMAKE_SOURCE_DIR})
  target_compile_options(${name} PRIVATE ${FARPOINT_WARNINGS})
endfunction()

# farpoint_test_program(name sources...): a program of tests/, includes and warnings as all of them have.
function(farpoint_test_program name)
  add_executable(${name} ${ARGN})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR})
  target_compile_options(${name} PRIVATE ${FARPOINT_WARNINGS})
endfunction()

# farpoint_test(name folder libraries...): one GoogleTest program from tests/<folder>/*.cc, one ctest entry a test.
function(farpoint_test name folder)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/tests/${folder}/*.cc)
  if(NOT sources)
    return()
  endif()
  farpoint_test_program(${name} ${sources})
  target_link_libraries(${name} PRIVATE farpoint_test_paths ${ARGN} GTest::gtest GTest::gtest_main Threads::Threads)
  # Printed values hold addresses, which would give a test another name in every build.
  gtest_discover_tests(${name} NO_PRETTY_VALUES DISCOVERY_TIMEOUT 60 PROPERTIES LABELS ${folder} TIMEOUT 600)
endfunction()
