# cmake --install: programs, and the sh component (the part others take alone) as find_package(daylit).
install(TARGETS daylit_settings daylit_highway daylit_sh EXPORT daylit_targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY sh/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/daylit/sh FILES_MATCHING PATTERN "*.h" PATTERN "detail" EXCLUDE)
install(EXPORT daylit_targets NAMESPACE daylit:: FILE daylitTargets.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/daylit)
file(WRITE "${CMAKE_BINARY_DIR}/daylitConfig.cmake"
  "include(CMakeFindDependencyMacro)\nfind_dependency(glm)\nfind_dependency(hwy)\ninclude(\"\${CMAKE_CURRENT_LIST_DIR}/daylitTargets.cmake\")\n")
include(CMakePackageConfigHelpers)
write_basic_package_version_file("${CMAKE_BINARY_DIR}/daylitConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_BINARY_DIR}/daylitConfig.cmake" "${CMAKE_BINARY_DIR}/daylitConfigVersion.cmake"
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/daylit)
