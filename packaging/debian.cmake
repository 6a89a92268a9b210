# cpack -G DEB makes one package per component: daylit-bake, daylit-run,
# daylit-calibrate, daylit-bench and libdaylit-dev.
set(DAYLIT_MAINTAINER "daylit maintainers <root@localhost>" CACHE STRING "who answers for the Debian packages")
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME daylit)
set(CPACK_PACKAGE_CONTACT "${DAYLIT_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY "${CMAKE_BINARY_DIR}/packages")
set(CPACK_COMPONENTS_ALL ${packages} dev)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS OFF)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON) # what a program links; what it opens while it runs is added below

set(CPACK_DEBIAN_BAKE_PACKAGE_NAME daylit-bake)
set(CPACK_COMPONENT_BAKE_DESCRIPTION "bakes the daylight of a room
 Programs that compute how the daylight outside is reflected inside a room
 (daylit-precompute), answer for points of it (daylit-probe), and simulate it
 by path tracing (daylit-simulate). No camera, no graphics.")

set(CPACK_DEBIAN_RUN_PACKAGE_NAME daylit-run)
set(CPACK_COMPONENT_RUN_DESCRIPTION "virtual objects in the daylight of a real room
 Draws virtual objects into camera pictures of a room, lit by the daylight
 that a fish-eye camera measures outside (daylit-run, and a systemd unit).")
# OpenGL and the window are opened only where they are wanted.
set(CPACK_DEBIAN_RUN_PACKAGE_RECOMMENDS "libegl-mesa0, libgl1-mesa-dri")
set(CPACK_DEBIAN_RUN_PACKAGE_SUGGESTS "daylit-bake, daylit-calibrate, libosmesa6")
set(CPACK_DEBIAN_RUN_PACKAGE_CONTROL_EXTRA "${CMAKE_CURRENT_LIST_DIR}/postinst;${CMAKE_CURRENT_LIST_DIR}/prerm")

set(CPACK_DEBIAN_CALIBRATE_PACKAGE_NAME daylit-calibrate)
set(CPACK_COMPONENT_CALIBRATE_DESCRIPTION "calibrates the cameras and the room of daylit
 Lens, response, fall-off, colour and orientation of the cameras, and what the
 walls of the room reflect, from pictures, each with a verdict and a report.")

set(CPACK_DEBIAN_BENCH_PACKAGE_NAME daylit-bench)
set(CPACK_COMPONENT_BENCH_DESCRIPTION "accuracy and speed of daylit on this machine
 Measures error against time of every part of daylit, and checks closed-form
 lighting cases on the machine where it runs (daylit-bench selftest).")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libdaylit-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)
set(CPACK_COMPONENT_DEV_DESCRIPTION "libraries of daylit
 Headers and static libraries: spherical harmonics (sh), rooms, skies and baked
 volumes (scene), the augmented picture (runtime). For find_package(daylit).")
# The static libraries need what they were built with: see daylitConfig.cmake.
set(dev_packages libglm-dev libhwy-dev libembree-dev libtbb-dev libfmt-dev libimath-dev libopenexr-dev libpng-dev zlib1g-dev
  libjpeg62-turbo-dev nlohmann-json3-dev libtomlplusplus-dev libyaml-cpp-dev libxxhash-dev liberfa-dev pkg-config)
if(DAYLIT_RUNTIME)
  list(APPEND dev_packages libglfw3-dev libmeshoptimizer-dev libopencv-dev libopencv-contrib-dev libegl-dev libgl-dev libopengl-dev
    libaravis-dev libcpp-httplib-dev libusb-1.0-0-dev libv4l-dev)
endif()
list(JOIN dev_packages ", " CPACK_DEBIAN_DEV_PACKAGE_DEPENDS)

file(ARCHIVE_CREATE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/changelog.gz" PATHS "${CMAKE_CURRENT_LIST_DIR}/changelog"
  FORMAT raw COMPRESSION GZip)
# Programs that link CGAL (radiosity) fall under the GPL as binaries.
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  set(daylit_licence_of_binary "")
  if(DAYLIT_BAKE AND component MATCHES "^(bake|bench|calibrate)$")
    set(daylit_licence_of_binary "
Files: usr/bin/daylit-precompute usr/bin/daylit-bench usr/bin/daylit-calibrate
Copyright: 2026 the daylit authors, the CGAL project
License: GPL-3+
 These binaries contain parts of CGAL, which are under the GNU General Public License, version 3 or later, in
 /usr/share/common-licenses/GPL-3.")
  endif()
  if(component MATCHES "^(bake|run|dev)$")
    string(APPEND daylit_licence_of_binary "
Files: usr/bin/daylit-run usr/bin/daylit-precompute usr/lib/libdaylit_runtime.a
Comment: the pages that they serve or write contain three.js
Copyright: 2010-2019 three.js authors
License: MIT
 Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated
 documentation files (the \"Software\"), to deal in the Software without restriction, including without limitation the
 rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the Software, and to permit
 persons to whom the Software is furnished to do so, subject to the following conditions:
 .
 The above copyright notice and this permission notice shall be included in all copies or substantial portions of the
 Software.
 .
 THE SOFTWARE IS PROVIDED \"AS IS\", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE
 WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR
 COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR
 OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.")
  endif()
  string(TOUPPER ${component} upper)
  set(package ${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  configure_file(copyright.in "${CMAKE_CURRENT_BINARY_DIR}/${package}/copyright" @ONLY)
  install(FILES "${CMAKE_CURRENT_BINARY_DIR}/${package}/copyright" "${CMAKE_CURRENT_BINARY_DIR}/changelog.gz"
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
endforeach()
include(CPack)
