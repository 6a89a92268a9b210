# The direction of dependencies (docs/design.md). An entry lists what a module, or a folder of a module, may use: nothing
# else may be linked, and nothing else may be included. The build stops when a source file reaches upwards.
set(DAYLIT_MODULES sh scene radiosity precompute capture runtime calibration simulate bench)
set(DAYLIT_MAY_USE_sh "")
set(DAYLIT_MAY_USE_scene sh)
set(DAYLIT_MAY_USE_radiosity sh scene)
set(DAYLIT_MAY_USE_precompute sh scene radiosity)
set(DAYLIT_MAY_USE_capture sh scene)
set(DAYLIT_MAY_USE_runtime sh scene capture)
set(DAYLIT_MAY_USE_calibration sh scene capture radiosity)
set(DAYLIT_MAY_USE_simulate sh scene radiosity precompute capture runtime calibration)
set(DAYLIT_MAY_USE_bench sh scene radiosity precompute capture runtime calibration simulate)

# Floors of scene, lowest first.
set(DAYLIT_FOLDERS_scene core image lens format room sky model volume config placing)
set(DAYLIT_MAY_USE_scene_core "")
set(DAYLIT_MAY_USE_scene_image core)
set(DAYLIT_MAY_USE_scene_lens core image)
set(DAYLIT_MAY_USE_scene_format core image)
set(DAYLIT_MAY_USE_scene_room core image format)
set(DAYLIT_MAY_USE_scene_sky core image lens format room)
set(DAYLIT_MAY_USE_scene_model core image format)
set(DAYLIT_MAY_USE_scene_volume core image format room sky)
set(DAYLIT_MAY_USE_scene_config core image lens format sky)
set(DAYLIT_MAY_USE_scene_placing core image room model config)

# Floors of capture, lowest first.
set(DAYLIT_FOLDERS_capture markers hdr frames)
set(DAYLIT_MAY_USE_capture_markers "")
set(DAYLIT_MAY_USE_capture_hdr "")
set(DAYLIT_MAY_USE_capture_frames "")

# Floors of runtime, lowest first.
set(DAYLIT_FOLDERS_runtime base sky object picture indirect shading trace gl composite input session window output http page live doctor cmd)
set(DAYLIT_MAY_USE_runtime_base "")
set(DAYLIT_MAY_USE_runtime_sky base)
set(DAYLIT_MAY_USE_runtime_object base sky)
set(DAYLIT_MAY_USE_runtime_picture base sky object)
set(DAYLIT_MAY_USE_runtime_indirect base sky object)
set(DAYLIT_MAY_USE_runtime_shading base sky picture)
set(DAYLIT_MAY_USE_runtime_trace base sky object picture shading)
set(DAYLIT_MAY_USE_runtime_gl base object picture shading)
set(DAYLIT_MAY_USE_runtime_composite base picture indirect)
set(DAYLIT_MAY_USE_runtime_input base)
set(DAYLIT_MAY_USE_runtime_session base sky object picture indirect trace gl composite)
set(DAYLIT_MAY_USE_runtime_window base gl session)
set(DAYLIT_MAY_USE_runtime_output composite input)
set(DAYLIT_MAY_USE_runtime_live base composite input session output)
set(DAYLIT_MAY_USE_runtime_http "")
set(DAYLIT_MAY_USE_runtime_page base object session window http)
set(DAYLIT_MAY_USE_runtime_doctor gl input http)
set(DAYLIT_MAY_USE_runtime_cmd base composite input session window output live http page doctor)

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
