# Installs the build tree under a new prefix, then configures, builds and runs the consumer against it alone.
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ECHO STDOUT RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "exit code ${result}: ${ARGN}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${WORK_DIR}/prefix)
run(${CMAKE_COMMAND} -S ${SOURCE_DIR} -B ${WORK_DIR}/build -G ${GENERATOR}
  -D CMAKE_BUILD_TYPE=${CONFIG} -D CMAKE_CXX_COMPILER=${CXX_COMPILER} -D CMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
  -D CMAKE_PREFIX_PATH=${WORK_DIR}/prefix -D EXPECTED_PREFIX=${WORK_DIR}/prefix -D EXPECTED_VERSION=${VERSION}
  -D EXAMPLES=${SOURCE_DIR}/../../../examples)
run(${CMAKE_COMMAND} --build ${WORK_DIR}/build)
run(${WORK_DIR}/build/consumer)
run(${WORK_DIR}/build/consumer_of_all ${WORK_DIR}/prefix/share/softarm/config/paper_arm.yaml)
run(${WORK_DIR}/build/serial_pressure_board --version)
