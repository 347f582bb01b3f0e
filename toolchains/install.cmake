# What `cmake --install` and CPack put where. <prefix>/share/armcal is laid out like the checkout, so that programs, armcal_add_model and
# ARMCAL_HOME find the same files at the same places in both.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(home ${CMAKE_INSTALL_DATADIR}/armcal)

install(DIRECTORY lib/armcal DESTINATION ${home}/lib PATTERN CMakeLists.txt EXCLUDE)
install(DIRECTORY codegen/robots codegen/effects codegen/generated DESTINATION ${home}/codegen PATTERN CMakeLists.txt EXCLUDE)
install(DIRECTORY port/template port/linux DESTINATION ${home}/port PATTERN CMakeLists.txt EXCLUDE)
install(FILES port/PORTING.md DESTINATION ${home}/port)
install(FILES toolchains/armcal_add_model.cmake toolchains/armcal_targets.cmake DESTINATION ${home}/toolchains)
install(FILES package.xml DESTINATION ${home})  # where ROS looks for it
install(FILES toolchains/armcalConfig.cmake DESTINATION ${home}/cmake)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/armcalConfigVersion.cmake COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/armcalConfigVersion.cmake DESTINATION ${home}/cmake)
install(FILES README.md CHANGELOG.md CONTRIBUTING.md SPEC.md SECURITY.md DESIGN.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs PATTERN site EXCLUDE)
foreach(page port/PORTING.md host_sim/scenarios/README.md toolchains/budgets.toml)  # what the pages link to
  get_filename_component(folder ${page} DIRECTORY)
  install(FILES ${page} DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder})
endforeach()

if(TARGET armcal)
  set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)  # an installation needs its programs and no test
  install(TARGETS armcal armcal-generate armcal-drive armcal-drive-er20_like DESTINATION ${CMAKE_INSTALL_BINDIR})
  add_custom_target(installed_programs DEPENDS armcal armcal-generate armcal-drive armcal-drive-er20_like)
  install(DIRECTORY host_sim/scenarios DESTINATION ${home}/host_sim)
  set(pages ${PROJECT_BINARY_DIR}/pages)
  add_custom_command(OUTPUT ${pages}/armcal COMMAND armcal pages --out ${pages} DEPENDS armcal VERBATIM)
  add_custom_target(pages ALL DEPENDS ${pages}/armcal)
  add_dependencies(installed_programs pages)
  install(DIRECTORY ${pages}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR})
  install(FILES ${pages}/armcal DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
  # The simulated drive of a robot and its estimators are compiled of these.
  install(FILES host_sim/client/vendor_registers.hpp DESTINATION ${home}/host_sim/client)
  install(DIRECTORY host_sim/machine/drive host_sim/machine/estimate DESTINATION ${home}/host_sim/machine PATTERN CMakeLists.txt EXCLUDE)

  # `cpack -G DEB` in the build folder makes the Debian package: what `cmake --install` puts in place.
  set(CPACK_GENERATOR DEB)
  set(CPACK_PACKAGE_NAME armcal)
  set(CPACK_PACKAGE_CONTACT "armcal contributors <armcal@localhost>")
  set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "estimate the dynamic parameters of robot arms, on the PC and in drive firmware")
  set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
  set(CPACK_STRIP_FILES ON)
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)  # of the programs; the library is source code
  set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "g++, cmake, libeigen3-dev")  # a drive or a project of one's own is compiled
  set(CPACK_DEBIAN_PACKAGE_SECTION science)
  include(CPack)
endif()
