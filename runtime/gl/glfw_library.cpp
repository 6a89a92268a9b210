#include "runtime/gl/glfw_library.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

namespace daylit {

namespace {

/// Started once and ended with the process.
struct GlfwLibrary {
  bool started = glfwInit() == GLFW_TRUE;
  ~GlfwLibrary() {
    if (started)
      glfwTerminate();
  }
};

} // namespace

Error glfw_error(const std::string& what) {
  const char* words = nullptr;
  glfwGetError(&words);
  return {ErrorCode::device, what + (words ? std::string(" (") + words + ")" : ""), "window",
          "a desktop with OpenGL 4.5 is needed; without one leave out --window"};
}

Result<GLFWwindow*> open_glfw_window(int width, int height, const char* title, bool visible) {
  static GlfwLibrary library;
  if (!library.started)
    library.started = glfwInit() == GLFW_TRUE; // a display may have appeared
  if (!library.started)
    return glfw_error("no window can be opened");
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_VISIBLE, visible ? GLFW_TRUE : GLFW_FALSE);
  glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  GLFWwindow* window = glfwCreateWindow(width, height, title, nullptr, nullptr);
  if (!window)
    return glfw_error("no window with OpenGL 4.5 can be opened");
  return window;
}

} // namespace daylit
