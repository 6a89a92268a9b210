#include "runtime/gl/gl_context.h"

namespace daylit {

Result<std::unique_ptr<GlContext>> create_gl_context(GlBackend backend) {
  if (backend == GlBackend::window)
    return create_window_context();
  return backend == GlBackend::osmesa ? create_osmesa_context() : create_egl_context();
}

} // namespace daylit
