# Compiler settings and the one way in which a module or a program is declared.
include(daylit_modules)
include(GNUInstallDirs)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")
set_property(GLOBAL PROPERTY JOB_POOLS heavy=1) # CGAL translation units take 1-2 GB each

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
find_program(DAYLIT_CCACHE ccache)
if(DAYLIT_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${DAYLIT_CCACHE}")
endif()

add_library(daylit_settings INTERFACE)
target_include_directories(daylit_settings INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/daylit>)
target_compile_features(daylit_settings INTERFACE cxx_std_20)

include(daylit_highway)

add_library(daylit_warnings INTERFACE)
target_compile_options(daylit_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast -Wconversion -Wno-sign-conversion
  -Wdouble-promotion -Werror
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>) # GCC 12 reports false overlaps in string concatenation (PR 105651)
if(DAYLIT_SANITIZE)
  add_compile_options(-O1 -g1 -fsanitize=${DAYLIT_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${DAYLIT_SANITIZE})
  if(DAYLIT_SANITIZE MATCHES "undefined")
    add_compile_options(-fno-sanitize-recover=all)
  endif()
  add_library(daylit_sanitizers OBJECT "${PROJECT_SOURCE_DIR}/cmake/sanitizer_suppressions.cpp")
endif()

# daylit_module(scene USES sh SOURCES a.cpp LINK glm::glm LINK_PRIVATE OpenEXR::OpenEXR)
function(daylit_module name)
  cmake_parse_arguments(M "" "" "USES;SOURCES;LINK;LINK_PRIVATE" ${ARGN})
  daylit_check_uses(${name} ${M_USES})
  add_library(daylit_${name} STATIC ${M_SOURCES})
  add_library(daylit::${name} ALIAS daylit_${name})
  set_target_properties(daylit_${name} PROPERTIES EXPORT_NAME ${name})
  target_link_libraries(daylit_${name} PUBLIC daylit_settings ${M_LINK} PRIVATE $<BUILD_INTERFACE:daylit_warnings> ${M_LINK_PRIVATE})
  foreach(used IN LISTS M_USES)
    target_link_libraries(daylit_${name} PUBLIC daylit_${used})
  endforeach()
endfunction()

# daylit_program(daylit-probe PACKAGE bake SOURCES probe_main.cpp LINK daylit_scene)
# PACKAGE: the Debian package that it is part of (packaging/CMakeLists.txt).
function(daylit_program name)
  cmake_parse_arguments(P "" "PACKAGE" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${P_SOURCES})
  target_link_libraries(${name} PRIVATE daylit_warnings ${P_LINK} $<TARGET_NAME_IF_EXISTS:daylit_sanitizers>)
  target_compile_definitions(${name} PRIVATE DAYLIT_VERSION="${PROJECT_VERSION}")
  install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${P_PACKAGE})
  set_property(GLOBAL APPEND PROPERTY DAYLIT_PROGRAMS_${P_PACKAGE} ${name})
endfunction()

# daylit_test(scene_volume SOURCES volume_test.cpp LINK daylit_scene [LABELS long] [ALONE])
# One executable per call; every TEST in it becomes one ctest case. ALONE: no other test beside it.
function(daylit_test name)
  cmake_parse_arguments(T "ALONE" "TIMEOUT" "SOURCES;LINK;LABELS" ${ARGN})
  if(NOT T_TIMEOUT)
    set(T_TIMEOUT 120)
  endif()
  if(DAYLIT_SANITIZE)
    math(EXPR T_TIMEOUT "15 * ${T_TIMEOUT}")
  endif()
  if(NOT T_LABELS)
    set(T_LABELS unit)
  endif()
  if(T_ALONE OR "long" IN_LIST T_LABELS) # long tests use every core, or measure time
    set(alone RUN_SERIAL TRUE)
  endif()
  add_executable(test_${name} ${T_SOURCES})
  target_link_libraries(test_${name} PRIVATE daylit_warnings ${T_LINK} GTest::gtest_main $<TARGET_NAME_IF_EXISTS:daylit_sanitizers>)
  if(DAYLIT_SANITIZE AND "long" IN_LIST T_LABELS) # only the short tests run under the sanitizers
    set_target_properties(test_${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
  target_compile_options(test_${name} PRIVATE $<$<CONFIG:Release>:-O1>) # compiles faster; the libraries keep -O3
  target_compile_definitions(test_${name} PRIVATE
    DAYLIT_SOURCE_DIR="${PROJECT_SOURCE_DIR}" DAYLIT_BINARY_DIR="${CMAKE_BINARY_DIR}")
  gtest_discover_tests(test_${name} TEST_PREFIX ${name}. DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
    PROPERTIES LABELS "${T_LABELS}" TIMEOUT ${T_TIMEOUT} SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\]" ${alone})
endfunction()
