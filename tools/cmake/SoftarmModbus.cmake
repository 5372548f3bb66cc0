# The target modbus::modbus. libmodbus ships no CMake config. Used by our build and by the installed package.
find_path(MODBUS_INCLUDE_DIR modbus/modbus.h)
find_library(MODBUS_LIBRARY modbus)
if(NOT TARGET modbus::modbus AND MODBUS_INCLUDE_DIR AND MODBUS_LIBRARY)
  add_library(modbus::modbus UNKNOWN IMPORTED GLOBAL)
  set_target_properties(modbus::modbus PROPERTIES
    IMPORTED_LOCATION "${MODBUS_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${MODBUS_INCLUDE_DIR}")
endif()
if(NOT TARGET modbus::modbus)
  set(message "libmodbus was not found: neither modbus/modbus.h nor the library (Debian: libmodbus-dev)")
  if(CMAKE_FIND_PACKAGE_NAME)  # inside find_package(softarm): the caller decides whether that is fatal
    set(${CMAKE_FIND_PACKAGE_NAME}_FOUND FALSE)
    set(${CMAKE_FIND_PACKAGE_NAME}_NOT_FOUND_MESSAGE "${message}")
    return()
  endif()
  message(FATAL_ERROR "${message}")
endif()
