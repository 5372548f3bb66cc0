# softarm_compile_together(COUNT TARGETS...): with SOFTARM_PRECOMPILED_HEADERS so many files are compiled as one, as headers are
# much of the compile time. Within them no file-local name may occur twice.
function(softarm_compile_together count)
  set_target_properties(${ARGN} PROPERTIES UNITY_BUILD ${SOFTARM_PRECOMPILED_HEADERS} UNITY_BUILD_BATCH_SIZE ${count})
endfunction()

# softarm_precompile(KIND TARGETS...): with SOFTARM_PRECOMPILED_HEADERS the heavy headers of other projects are compiled once a
# KIND (module, program, test or computing_test) instead of once a file: a third of the time of a first build. Every file includes what it
# uses all the same: the sanitizers' and the debugging presets build without.
option(SOFTARM_PRECOMPILED_HEADERS "Compile the headers of Eigen, fmt, CLI11 and GoogleTest once, not once a file" OFF)

set(SOFTARM_MODULE_HEADERS
  <Eigen/Core> <Eigen/Geometry> <fmt/format.h> <algorithm> <array> <cmath> <filesystem> <functional> <limits> <memory> <numbers>
  <optional> <span> <stdexcept> <string> <vector>)
set(SOFTARM_PROGRAM_HEADERS ${SOFTARM_MODULE_HEADERS} <CLI/CLI.hpp> <yaml-cpp/yaml.h>)
set(SOFTARM_TEST_HEADERS ${SOFTARM_MODULE_HEADERS} <gtest/gtest.h> <fstream> <random>)
set(SOFTARM_COMPUTING_TEST_HEADERS ${SOFTARM_TEST_HEADERS})

function(softarm_precompile kind)
  if(NOT SOFTARM_PRECOMPILED_HEADERS)
    return()
  endif()
  set(owner softarm_${kind}_headers)
  if(NOT TARGET ${owner})
    softarm_headers_owner(${kind} ${owner})
  endif()
  foreach(target IN LISTS ARGN)
    # The compiler takes a precompiled header only where the macros in it are what they were, in files without fmt too.
    target_compile_definitions(${target} PRIVATE $<TARGET_PROPERTY:fmt::fmt,INTERFACE_COMPILE_DEFINITIONS>)
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      # g++ 12 takes "text" + std::string for an overlap (its bug 105651), and does not treat a precompiled header as a system header.
      target_compile_options(${target} PRIVATE -Wno-restrict)
    endif()
    target_precompile_headers(${target} REUSE_FROM ${owner})
  endforeach()
endfunction()

# A target that only compiles the headers, with the flags of its users: a library or an executable.
function(softarm_headers_owner kind owner)
  set(source ${PROJECT_BINARY_DIR}/generated/precompiled/${kind}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "int main() { return 0; }\n")
  if(kind STREQUAL "module")
    add_library(${owner} OBJECT ${source})
  else()
    add_executable(${owner} ${source})
    set_target_properties(${owner} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/generated/precompiled)
  endif()
  target_link_libraries(${owner} PRIVATE Eigen3::Eigen fmt::fmt)
  if(kind STREQUAL "program")
    target_link_libraries(${owner} PRIVATE CLI11::CLI11 yaml-cpp)
  elseif(kind MATCHES "test$")
    target_link_libraries(${owner} PRIVATE GTest::gtest)
  endif()
  if(kind STREQUAL "test")
    softarm_optimise_less(0 ${owner})
  elseif(NOT kind STREQUAL "module")
    softarm_optimise_less(1 ${owner})
  endif()
  string(TOUPPER ${kind} KIND)
  target_precompile_headers(${owner} PRIVATE ${SOFTARM_${KIND}_HEADERS})
endfunction()
