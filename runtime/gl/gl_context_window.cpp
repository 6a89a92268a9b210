
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include "runtime/gl/gl_context.h"
#include "runtime/gl/glfw_library.h"

namespace daylit {

namespace {

class WindowContext : public GlContext {
public:
  explicit WindowContext(GLFWwindow* window) : window_(window) {}
  ~WindowContext() override { glfwDestroyWindow(window_); }

  Result<void> make_current() override {
    glfwMakeContextCurrent(window_);
    return glfwGetCurrentContext() == window_ ? Result<void>() : glfw_error("the context cannot be made current");
  }
  void* resolve(const char* name) override { return reinterpret_cast<void*>(glfwGetProcAddress(name)); }
  std::string backend() const override { return "window"; }

private:
  GLFWwindow* window_;
};

} // namespace

Result<std::unique_ptr<GlContext>> create_window_context() {
  const auto window = open_glfw_window(16, 16, "daylit", false);
  if (!window)
    return window.error();
  auto context = std::make_unique<WindowContext>(*window);
  if (const auto current = context->make_current(); !current)
    return current.error();
  return std::unique_ptr<GlContext>(std::move(context));
}

} // namespace daylit
