# find_package(softarm) works from another project: softarm::model, softarm::control, ...
include(CMakePackageConfigHelpers)
get_property(modules GLOBAL PROPERTY SOFTARM_MODULES)
install(TARGETS ${modules} EXPORT softarmTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/softarm DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY ${SOFTARM_GENERATED_DIR}/lcmtypes/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.hpp")
install(DIRECTORY config/ DESTINATION ${CMAKE_INSTALL_DATADIR}/softarm/config FILES_MATCHING PATTERN "*.yaml"
  PATTERN "*.json" PATTERN "systemd" EXCLUDE)
install(DIRECTORY lcmtypes/ DESTINATION ${CMAKE_INSTALL_DATADIR}/softarm/lcmtypes FILES_MATCHING PATTERN "*.lcm")
install(EXPORT softarmTargets NAMESPACE softarm:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/softarm)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/softarmConfig.cmake.in ${PROJECT_BINARY_DIR}/softarmConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/softarm)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/softarmConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/softarmConfig.cmake ${PROJECT_BINARY_DIR}/softarmConfigVersion.cmake
  ${PROJECT_SOURCE_DIR}/tools/cmake/SoftarmPlainLibraries.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/softarm)
install(PROGRAMS tools/plot_run.py tools/plot_identification.py DESTINATION ${CMAKE_INSTALL_DATADIR}/softarm)
install(FILES tests/golden/golden.json DESTINATION ${CMAKE_INSTALL_DATADIR}/softarm)
install(FILES README.md CONTRIBUTING.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} FILES_MATCHING PATTERN "*.md" PATTERN "*.ipynb" PATTERN "*.png" PATTERN "*.svg")
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DOCDIR} FILES_MATCHING PATTERN "*.py" PATTERN "*.cpp" PATTERN "__pycache__" EXCLUDE)
install(DIRECTORY tools/plotting DESTINATION ${CMAKE_INSTALL_DATADIR}/softarm
  FILES_MATCHING PATTERN "*.py" PATTERN "*.js" PATTERN "__pycache__" EXCLUDE)
# bash looks a completion up by the program's name.
foreach(program softarm softarmd softarm-plant softarm-valves softarm-dev)
  install(FILES tools/completion/softarm.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME ${program})
endforeach()
# systemd units: softarmd@NAME, softarm-valves@NAME (docs/how-to/run_as_a_service.md).
install(FILES docs/how-to/run_as_a_service.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs/how-to COMPONENT units)
install(CODE "set(SOFTARM_UNITS \"${PROJECT_SOURCE_DIR}/config/systemd\")
set(SOFTARM_BIN \"${CMAKE_INSTALL_BINDIR}\")
set(SOFTARM_DOC \"${CMAKE_INSTALL_DOCDIR}\")" COMPONENT units)
install(SCRIPT tools/cmake/InstallUnits.cmake COMPONENT units)
