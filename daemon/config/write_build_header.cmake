# SPDX-License-Identifier: Apache-2.0
# Run at every build: writes HEADER with the commit of SOURCE_DIR, and touches it only where it changed.
find_program(GIT git)
set(commit "no-commit")
if(GIT)
  execute_process(COMMAND ${GIT} -C ${SOURCE_DIR} describe --always --dirty --abbrev=12
                  OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE status)
  if(status EQUAL 0)
    set(commit "${described}")
  endif()
endif()
file(CONFIGURE OUTPUT ${HEADER} CONTENT "#pragma once
#define FARPOINT_VERSION \"${VERSION}\"
#define FARPOINT_COMMIT \"${commit}\"
#define FARPOINT_BUILD_TYPE \"${BUILD_TYPE}\"
")
