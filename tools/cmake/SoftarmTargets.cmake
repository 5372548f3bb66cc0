# softarm_module(NAME DEPENDS libraries PRIVATE_DEPENDS libraries): a module of the tree as a separate library, so that the linker
# checks the direction of the arrows too. softarm_program(NAME DEPENDS ...): an executable.
# softarm_tests(LABEL MODULE [COMPUTES] [REAL_TIME] [SLOW FILTER] DEPENDS ...): one test program from every *_test.cpp below the
# folder MODULE; COMPUTES for those that calculate much themselves, the others are not optimised at all; REAL_TIME for those that
# watch programs run in real time: one of a test program at a time, beside other tests; those whose names FILTER matches get the
# label slow instead, and run alone.

include(SoftarmHeaders)

add_library(softarm_options INTERFACE)
target_compile_features(softarm_options INTERFACE cxx_std_20)
target_compile_options(softarm_options INTERFACE -Wall -Wextra -Wconversion -Wshadow -Wno-psabi)
if(SOFTARM_WARNINGS_AS_ERRORS)
  target_compile_options(softarm_options INTERFACE -Werror)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # The compiler collects garbage from 1 GB on instead of 128 MB: a fifth of the build's time.
  add_compile_options(--param=ggc-min-heapsize=1000000)
endif()
if(SOFTARM_MARCH)
  add_compile_options(-march=${SOFTARM_MARCH})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # False alarms of g++ 12 in its own avx512fintrin.h, 2600 in a build; the portable build has these warnings.
    target_compile_options(softarm_options INTERFACE -Wno-maybe-uninitialized -Wno-array-bounds)
  endif()
endif()
if(SOFTARM_SANITIZE)
  add_compile_options(-fsanitize=${SOFTARM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${SOFTARM_SANITIZE})
endif()

# softarm::NAME from the sources in src/NAME; the modules that it may include, and therefore links, are in src/modules.txt.
file(STRINGS ${PROJECT_SOURCE_DIR}/src/modules.txt SOFTARM_ARROWS REGEX "^[a-z]+:")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/modules.txt)
function(softarm_module name)
  cmake_parse_arguments(MODULE "" "" "DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/${name}/*.cpp)
  set(arrows ${SOFTARM_ARROWS})
  list(FILTER arrows INCLUDE REGEX "^${name}:")
  string(REGEX REPLACE "^${name}: *" "" arrows "${arrows}")
  string(REPLACE " " ";" arrows "${arrows}")
  list(TRANSFORM arrows PREPEND softarm::)
  add_library(softarm_${name} STATIC ${sources})
  add_library(softarm::${name} ALIAS softarm_${name})
  set_target_properties(softarm_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(softarm_${name}
    PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_compile_features(softarm_${name} PUBLIC cxx_std_20)
  target_link_libraries(softarm_${name} PUBLIC ${arrows} ${MODULE_DEPENDS}
    PRIVATE ${MODULE_PRIVATE_DEPENDS} $<BUILD_INTERFACE:softarm_options>)
  set_property(GLOBAL APPEND PROPERTY SOFTARM_MODULES softarm_${name})
  softarm_precompile(module softarm_${name})
  if(NOT name STREQUAL "model")  # whose recursions each use their namespace
    softarm_compile_together(6 softarm_${name})
  endif()
endfunction()

# For tests, and programs that parse, call and print: the modules that they call are optimised in full, they are not.
function(softarm_optimise_less level)
  softarm_compile_together(8 ${ARGN})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    foreach(target IN LISTS ARGN)
      # At -O1 g++ 12 reports false positives in Eigen and std::string; in tests the sanitizers look for them.
      target_compile_options(${target} PRIVATE $<$<NOT:$<CONFIG:Debug>>:-O${level} -Wno-maybe-uninitialized -Wno-array-bounds -Wno-stringop-overflow>)
    endforeach()
  endif()
endfunction()

# The program NAME from the sources in src/apps/NAME.
function(softarm_program name)
  cmake_parse_arguments(PROGRAM "" "" "DEPENDS" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.cpp)
  add_executable(${name} ${sources})
  target_link_libraries(${name} PRIVATE softarm_program_frame ${PROGRAM_DEPENDS} softarm_options)
  softarm_optimise_less(1 ${name})
  softarm_precompile(program ${name})
  install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endfunction()

function(softarm_tests label module)
  cmake_parse_arguments(TESTS "COMPUTES;REAL_TIME" "SLOW" "DEPENDS" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${module}/*_test.cpp)
  if(NOT sources)
    return()
  endif()
  set(target ${label}_${module}_tests)
  add_executable(${target} ${sources})
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tools ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(${target} PRIVATE ${TESTS_DEPENDS} softarm_test_support GTest::gtest_main softarm_options)
  target_compile_definitions(${target} PRIVATE
    SOFTARM_SOURCE_DIR="${PROJECT_SOURCE_DIR}" SOFTARM_BINARY_DIR="${PROJECT_BINARY_DIR}")
  if(TESTS_COMPUTES)
    softarm_optimise_less(1 ${target})
    softarm_precompile(computing_test ${target})
  else()
    softarm_optimise_less(0 ${target})
    softarm_precompile(test ${target})
  endif()
  set(usual "*")
  set(lock "")
  if(TESTS_REAL_TIME)
    set(lock RESOURCE_LOCK ${target} COST 100)  # one after another, so the first of them begins first
  endif()
  if(TESTS_SLOW)
    set(usual "-${TESTS_SLOW}")
    gtest_discover_tests(${target} TEST_PREFIX "${label}.${module}." PROPERTIES LABELS slow TIMEOUT 300
      RUN_SERIAL ${TESTS_REAL_TIME} TEST_FILTER ${TESTS_SLOW} TEST_LIST ${target}_slow
      DISCOVERY_TIMEOUT 60 NO_PRETTY_TYPES NO_PRETTY_VALUES)
  endif()
  gtest_discover_tests(${target} TEST_PREFIX "${label}.${module}." PROPERTIES LABELS ${label} TIMEOUT 300
    ${lock} TEST_FILTER ${usual} DISCOVERY_TIMEOUT 60 NO_PRETTY_TYPES NO_PRETTY_VALUES)
endfunction()
