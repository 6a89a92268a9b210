#pragma once

// Where OpenGL comes from. The renderer draws into its own framebuffers only, so a context is all it needs.

#include <memory>
#include <string>

#include "scene/core/result.h"

namespace daylit {

/// An OpenGL 4.5 core context. Used from one thread at a time.
class GlContext {
public:
  virtual ~GlContext() = default;
  GlContext() = default;
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  virtual Result<void> make_current() = 0;
  /// Address of a GL entry point, null when the driver has none.
  virtual void* resolve(const char* name) = 0;
  /// "egl surfaceless", "egl device", "osmesa", "window"
  virtual std::string backend() const = 0;
};

enum class GlBackend {
  egl,    ///< no window, no display server: surfaceless Mesa, else the first EGL device
  osmesa, ///< the processor draws; needs one library and no driver files (gone from Mesa 25.1 on)
  window, ///< of a hidden GLFW window: what a desktop's display server gives; main thread only
};

/// Error device: what the driver said, and the package that helps.
Result<std::unique_ptr<GlContext>> create_gl_context(GlBackend backend = GlBackend::egl);
Result<std::unique_ptr<GlContext>> create_egl_context();
Result<std::unique_ptr<GlContext>> create_osmesa_context();
Result<std::unique_ptr<GlContext>> create_window_context();

} // namespace daylit
