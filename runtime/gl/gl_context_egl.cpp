#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <string>

#include "runtime/gl/gl_context.h"

namespace daylit {

namespace {

Error egl_error(const std::string& what) {
  return {ErrorCode::device, what + " (EGL code " + std::to_string(eglGetError()) + ")", "EGL",
          "install a driver with EGL and OpenGL 4.5 (Debian: libegl1 libgl1-mesa-dri)"};
}

class EglContext : public GlContext {
public:
  EglContext(EGLDisplay display, std::string backend) : display_(display), backend_(std::move(backend)) {}

  ~EglContext() override {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context_ != EGL_NO_CONTEXT)
      eglDestroyContext(display_, context_);
    // The display is shared by every context of the process: it is not terminated here.
  }

  Result<void> start() {
    if (!eglBindAPI(EGL_OPENGL_API))
      return egl_error("EGL offers no desktop OpenGL");
    const EGLint config_attributes[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                        EGL_NONE};
    EGLConfig config = EGL_NO_CONFIG_KHR;
    EGLint configs = 0;
    if (!eglChooseConfig(display_, config_attributes, &config, 1, &configs) || configs == 0)
      config = EGL_NO_CONFIG_KHR;
    // Without its last pair the list asks for no word about resets, which some drivers cannot give.
    EGLint context_attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                   4,
                                   EGL_CONTEXT_MINOR_VERSION,
                                   5,
                                   EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                   EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                   EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY,
                                   EGL_LOSE_CONTEXT_ON_RESET,
                                   EGL_NONE};
    context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, context_attributes);
    if (context_ == EGL_NO_CONTEXT) {
      context_attributes[6] = EGL_NONE;
      context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, context_attributes);
    }
    if (context_ == EGL_NO_CONTEXT)
      return egl_error("no OpenGL 4.5 core context");
    return make_current();
  }

  Result<void> make_current() override {
    if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
      return Error{ErrorCode::device,
                   "the context cannot be made current (EGL code " + std::to_string(eglGetError()) + "): it is lost",
                   "EGL", "create the renderer again"};
    return {};
  }

  void* resolve(const char* name) override { return reinterpret_cast<void*>(eglGetProcAddress(name)); }
  std::string backend() const override { return backend_; }

private:
  EGLDisplay display_;
  EGLContext context_ = EGL_NO_CONTEXT;
  std::string backend_;
};

EGLDisplay surfaceless_display() {
  const auto get = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
  return get ? get(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr) : EGL_NO_DISPLAY;
}

EGLDisplay device_display() {
  const auto get = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
  const auto query = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
  EGLDeviceEXT device = EGL_NO_DEVICE_EXT;
  EGLint devices = 0;
  if (!get || !query || !query(1, &device, &devices) || devices == 0)
    return EGL_NO_DISPLAY;
  return get(EGL_PLATFORM_DEVICE_EXT, device, nullptr);
}

} // namespace

Result<std::unique_ptr<GlContext>> create_egl_context() {
  Error last{ErrorCode::device, "no EGL display", "EGL", "install libegl1 and libgl1-mesa-dri"};
  const std::pair<EGLDisplay (*)(), const char*> platforms[] = {{surfaceless_display, "egl surfaceless"},
                                                                {device_display, "egl device"}};
  for (const auto& [open, name] : platforms) {
    const EGLDisplay display = open();
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, nullptr, nullptr))
      continue;
    auto context = std::make_unique<EglContext>(display, name);
    const auto started = context->start();
    if (started)
      return std::unique_ptr<GlContext>(std::move(context));
    last = started.error();
  }
  return last;
}

Result<std::unique_ptr<GlContext>> create_gl_context(GlBackend backend) {
  if (backend == GlBackend::window)
    return create_window_context();
  return backend == GlBackend::osmesa ? create_osmesa_context() : create_egl_context();
}

} // namespace daylit
