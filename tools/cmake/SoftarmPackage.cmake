# `cpack` in a build tree makes one Debian package of all that is installed; tools/package wraps it.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME softarm)
set(CPACK_PACKAGE_CONTACT "the softarm authors <softarm@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_SET_DESTDIR ON)  # the units name the programs where they will be, not where they are being packed
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3, python3-numpy, python3-matplotlib, liblcm-bin")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "libeigen3-dev, libsundials-dev, libyaml-cpp-dev, libfmt-dev, liblcm-dev, libmodbus-dev, systemd")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "A daemon that reads motion-capture frames over LCM and commands the valves of
soft pneumatic arms, a driver for valve terminals on Modbus TCP, a simulated
arm, tools, systemd units, and the libraries all of them are made of.")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)
include(CPack)
