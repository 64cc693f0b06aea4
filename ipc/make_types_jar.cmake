# SPDX-License-Identifier: Apache-2.0
# From the LCM types to a jar of their Java classes. FOLDER is emptied, so that types that are gone leave no class.
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGV}: ${status}\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER}/source ${FOLDER}/classes)
run(${LCM_GEN} -j --jpath ${FOLDER}/source ${TYPES})
file(GLOB_RECURSE sources ${FOLDER}/source/*.java)
# For any Java that is still looked after.
run(${JAVAC} --release 11 -cp ${LCM_JAR} -d ${FOLDER}/classes ${sources})
cmake_path(GET OUTPUT PARENT_PATH output_folder)
file(MAKE_DIRECTORY ${output_folder})
run(${JAR} --create --file ${OUTPUT} -C ${FOLDER}/classes .)
