#include "runtime/gl/gl_functions.h"

namespace daylit {

Result<GlFunctions> load_gl(const std::function<void*(const char*)>& resolve) {
  GlFunctions gl;
  std::string missing;
#define DAYLIT_GL_LOAD(TYPE, NAME)                                                                                     \
  gl.NAME = reinterpret_cast<PFNGL##TYPE##PROC>(resolve("gl" #NAME));                                                  \
  if (!gl.NAME)                                                                                                        \
    missing += " gl" #NAME;
  DAYLIT_GL_FUNCTIONS(DAYLIT_GL_LOAD)
#undef DAYLIT_GL_LOAD
  if (!missing.empty())
    return Error{ErrorCode::device, "the OpenGL driver lacks" + missing, "OpenGL",
                 "install a driver with OpenGL 4.5 (Debian: libgl1-mesa-dri)"};
  return gl;
}

Result<void> check_gl(const GlFunctions& gl, const std::string& where) {
  if (gl.GetGraphicsResetStatus() != GL_NO_ERROR) {
    gl.lost = true;
    return Error{ErrorCode::device, "the graphics processor was reset: everything drawn with it is lost", where,
                 "create the renderer again"};
  }
  const GLenum code = gl.GetError();
  if (code == GL_NO_ERROR)
    return {};
  while (gl.GetError() != GL_NO_ERROR && code != GL_CONTEXT_LOST) {
  }
  const char* what = code == GL_OUT_OF_MEMORY  ? "out of graphics memory"
                     : code == GL_CONTEXT_LOST ? "the graphics context was lost"
                                               : "OpenGL error";
  return Error{ErrorCode::device, std::string(what) + " (code " + std::to_string(code) + ")", where,
               code == GL_OUT_OF_MEMORY ? "use fewer light samples or a smaller picture" : "create the renderer again"};
}

} // namespace daylit
