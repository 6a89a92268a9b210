# Text files compiled into a program.
set(daylit_embedded "${CMAKE_CURRENT_BINARY_DIR}/generated")
# daylit_embed(shaders HEADER runtime/gl/shaders.h FILES a.glsl b.glsl)
function(daylit_embed namespace)
  cmake_parse_arguments(E "" "HEADER" "FILES" ${ARGN})
  set(header "${daylit_embedded}/${E_HEADER}")
  get_filename_component(folder "${header}" DIRECTORY)
  file(MAKE_DIRECTORY "${folder}")
  add_custom_command(OUTPUT "${header}"
    COMMAND ${CMAKE_COMMAND} "-DHEADER=${header}" "-DNAMESPACE=${namespace}" "-DFILES=${E_FILES}"
            -P "${PROJECT_SOURCE_DIR}/cmake/embed_text.cmake"
    DEPENDS ${E_FILES} "${PROJECT_SOURCE_DIR}/cmake/embed_text.cmake"
    COMMENT "Embedding ${namespace}" VERBATIM)
endfunction()

# three.js draws rooms in the browser: Debian's, so that a page loads nothing from elsewhere.
find_file(DAYLIT_THREE_JS three.min.js PATHS /usr/share/javascript/three REQUIRED NO_DEFAULT_PATH)
