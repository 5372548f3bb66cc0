# The commit in --version, logs and messages is that of the tree being built, looked up at every build.
set(SOFTARM_GENERATED_DIR "${PROJECT_BINARY_DIR}/generated")
add_custom_target(softarm_commit BYPRODUCTS ${SOFTARM_GENERATED_DIR}/softarm_commit.h
  COMMAND ${CMAKE_COMMAND} -D SOURCE_DIR=${PROJECT_SOURCE_DIR} -D VERSION=${PROJECT_VERSION}
          -D OUTPUT=${SOFTARM_GENERATED_DIR}/softarm_commit.h -P ${CMAKE_CURRENT_LIST_DIR}/WriteCommit.cmake)
