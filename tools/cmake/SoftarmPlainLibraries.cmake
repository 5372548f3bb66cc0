# The targets lcm::lcm and modbus::modbus. Used by our build and by the installed package.

# TARGET for a library of which Debian 12 has no CMake config (nor, of LCM, an lcm.pc that works).
macro(softarm_plain_library target name header packages)
  if(NOT TARGET ${target})
    find_path(SOFTARM_${name}_INCLUDE_DIR ${header})
    find_library(SOFTARM_${name}_LIBRARY ${name})
    if(SOFTARM_${name}_INCLUDE_DIR AND SOFTARM_${name}_LIBRARY)
      add_library(${target} UNKNOWN IMPORTED GLOBAL)
      set_target_properties(${target} PROPERTIES
        IMPORTED_LOCATION "${SOFTARM_${name}_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${SOFTARM_${name}_INCLUDE_DIR}")
    endif()
  endif()
  if(NOT TARGET ${target})
    set(message "lib${name} was not found: neither ${header} nor the library (Debian: ${packages})")
    if(CMAKE_FIND_PACKAGE_NAME)  # inside find_package(softarm): the caller decides whether that is fatal
      set(${CMAKE_FIND_PACKAGE_NAME}_FOUND FALSE)
      set(${CMAKE_FIND_PACKAGE_NAME}_NOT_FOUND_MESSAGE "${message}")
      return()
    endif()
    message(FATAL_ERROR "${message}")
  endif()
endmacro()

find_package(lcm CONFIG QUIET)  # LCM's own, 1.4 and later: target `lcm`
if(TARGET lcm AND NOT TARGET lcm::lcm)
  add_library(lcm::lcm ALIAS lcm)
endif()
softarm_plain_library(lcm::lcm lcm lcm/lcm.h "liblcm-dev, liblcm-bin")
softarm_plain_library(modbus::modbus modbus modbus/modbus.h libmodbus-dev)
