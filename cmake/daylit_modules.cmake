# The direction of dependencies (docs/design.md). An entry lists what a module may use; nothing else may be
# linked, and nothing else may be included: the build stops when a source file reaches upwards.
set(DAYLIT_MAY_USE_sh "")
set(DAYLIT_MAY_USE_scene sh)
set(DAYLIT_MAY_USE_radiosity sh scene)
set(DAYLIT_MAY_USE_precompute sh scene radiosity)
set(DAYLIT_MAY_USE_runtime sh scene)
set(DAYLIT_MAY_USE_calibration sh scene radiosity)
set(DAYLIT_MAY_USE_simulate sh scene radiosity precompute runtime calibration)
set(DAYLIT_MAY_USE_bench sh scene radiosity precompute runtime calibration simulate)
set(DAYLIT_MODULES sh scene radiosity precompute runtime calibration simulate bench)

function(daylit_check_uses name)
  foreach(used IN LISTS ARGN)
    if(NOT used IN_LIST DAYLIT_MAY_USE_${name})
      message(FATAL_ERROR "module '${name}' may not use '${used}' (allowed: ${DAYLIT_MAY_USE_${name}}); see cmake/daylit_modules.cmake")
    endif()
  endforeach()
endfunction()

add_custom_target(check_dependencies ALL
  COMMAND ${CMAKE_COMMAND} -DSOURCE_DIR=${PROJECT_SOURCE_DIR} -P ${CMAKE_CURRENT_LIST_DIR}/check_includes.cmake
  COMMENT "Checking the direction of dependencies" VERBATIM)
