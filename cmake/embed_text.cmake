# cmake -DHEADER=out.h -DNAMESPACE=shaders -DFILES="a.glsl;b.glsl" -P embed_text.cmake : each file becomes a string constant
# of daylit::NAMESPACE named after it, up to its first dot.
set(text "#pragma once\n\nnamespace daylit::${NAMESPACE} {\n")
foreach(file IN LISTS FILES)
  get_filename_component(name "${file}" NAME_WE)
  file(READ "${file}" source)
  string(APPEND text "inline constexpr const char* ${name} = R\"embedded(${source})embedded\";\n")
endforeach()
string(APPEND text "} // namespace daylit::${NAMESPACE}\n")
file(WRITE "${HEADER}.new" "${text}")
file(COPY_FILE "${HEADER}.new" "${HEADER}" ONLY_IF_DIFFERENT)
