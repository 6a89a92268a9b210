#include <dlfcn.h>

#include <array>
#include <string>

#include <GL/osmesa.h>

#include "runtime/gl/gl_context.h"

namespace daylit {

namespace {

Error osmesa_error(const std::string& what) {
  return {ErrorCode::device, what, "OSMesa", "install libosmesa6, or use EGL (libegl1 libgl1-mesa-dri)"};
}

/// The library, opened once and never closed: it holds state of the whole process. Its symbols stay its own, so that
/// they do not stand in for another driver's.
struct OsMesaLibrary {
  void* handle = nullptr;
  decltype(&OSMesaCreateContextAttribs) create = nullptr;
  decltype(&OSMesaDestroyContext) destroy = nullptr;
  decltype(&OSMesaMakeCurrent) make_current = nullptr;
  decltype(&OSMesaGetProcAddress) address = nullptr;

  OsMesaLibrary() {
    handle = dlopen("libOSMesa.so.8", RTLD_NOW | RTLD_LOCAL);
    if (!handle)
      handle = dlopen("libOSMesa.so.6", RTLD_NOW | RTLD_LOCAL);
    if (!handle)
      return;
    load("OSMesaCreateContextAttribs", create);
    load("OSMesaDestroyContext", destroy);
    load("OSMesaMakeCurrent", make_current);
    load("OSMesaGetProcAddress", address);
  }
  bool complete() const { return create && destroy && make_current && address; }

private:
  template <class Function>
  void load(const char* name, Function& function) {
    function = reinterpret_cast<Function>(dlsym(handle, name));
  }
};

const OsMesaLibrary& library() {
  static const OsMesaLibrary loaded;
  return loaded;
}

class OsMesaContext : public GlContext {
public:
  ~OsMesaContext() override {
    if (context_)
      library().destroy(context_);
  }

  Result<void> start() {
    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_DEPTH_BITS,
                              24,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              4,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              5,
                              0,
                              0};
    context_ = library().create(attributes, nullptr);
    if (!context_)
      return osmesa_error("no OpenGL 4.5 core context");
    return make_current();
  }

  Result<void> make_current() override {
    if (!library().make_current(context_, surface_.data(), GL_UNSIGNED_BYTE, kSide, kSide))
      return osmesa_error("the context cannot be made current");
    return {};
  }

  void* resolve(const char* name) override { return reinterpret_cast<void*>(library().address(name)); }
  std::string backend() const override { return "osmesa"; }

private:
  static constexpr int kSide = 16;
  OSMesaContext context_ = nullptr;
  std::array<unsigned char, 4 * kSide * kSide> surface_{}; ///< nothing is drawn into it, but there must be one
};

} // namespace

Result<std::unique_ptr<GlContext>> create_osmesa_context() {
  if (!library().complete())
    return osmesa_error("the library libOSMesa.so.8 is not installed, or lacks a function");
  auto context = std::make_unique<OsMesaContext>();
  if (const auto started = context->start(); !started)
    return started.error();
  return std::unique_ptr<GlContext>(std::move(context));
}

} // namespace daylit
