# Run by `cmake --install`, once CMAKE_INSTALL_PREFIX is known: writes the systemd units with the paths they have there.
# SoftarmInstall.cmake sets SOFTARM_UNITS (where the templates are), SOFTARM_BIN and SOFTARM_DOC (relative to the prefix).
set(SOFTARM_BIN_DIR "${CMAKE_INSTALL_PREFIX}/${SOFTARM_BIN}")
set(SOFTARM_DOC_DIR "${CMAKE_INSTALL_PREFIX}/${SOFTARM_DOC}")
file(READ "${SOFTARM_UNITS}/sandbox.in" SOFTARM_SANDBOX)
foreach(unit softarmd@.service softarm-valves@.service)
  set(installed "${CMAKE_INSTALL_PREFIX}/lib/systemd/system/${unit}")
  message(STATUS "Installing: $ENV{DESTDIR}${installed}")
  configure_file("${SOFTARM_UNITS}/${unit}.in" "$ENV{DESTDIR}${installed}" @ONLY)
  list(APPEND CMAKE_INSTALL_MANIFEST_FILES "${installed}")
endforeach()
