#include "runtime/window/view_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include "runtime/gl/gl_functions.h"
#include "runtime/gl/glfw_library.h"

namespace daylit {

struct ViewWindow::State {
  GLFWwindow* window = nullptr;
  int width = 0, height = 0;
  GlFunctions gl;
  GLuint texture = 0, framebuffer = 0;
  WindowEvents events;

  ~State() {
    if (window)
      glfwDestroyWindow(window); // its context goes with all that it holds
  }
  glm::dvec2 mouse() const {
    glm::dvec2 at(0.0);
    glfwGetCursorPos(window, &at.x, &at.y);
    return at - 0.5;
  }
  static State& of(GLFWwindow* window) { return *static_cast<State*>(glfwGetWindowUserPointer(window)); }
  void listen();
};

void ViewWindow::State::listen() {
  glfwSetWindowUserPointer(window, this);
  glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int) {
    if (const State& s = of(w); button == GLFW_MOUSE_BUTTON_LEFT && s.events.button)
      s.events.button(action == GLFW_PRESS, s.mouse());
  });
  glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) {
    if (const State& s = of(w); s.events.move)
      s.events.move(glm::dvec2(x, y) - 0.5);
  });
  glfwSetScrollCallback(window, [](GLFWwindow* w, double, double steps) {
    if (const State& s = of(w); s.events.scroll)
      s.events.scroll(steps);
  });
  glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int) {
    const State& s = of(w);
    if (action != GLFW_PRESS)
      return;
    if (key == GLFW_KEY_ESCAPE)
      glfwSetWindowShouldClose(w, GLFW_TRUE);
    else if (s.events.key && key >= GLFW_KEY_0 && key <= GLFW_KEY_Z)
      s.events.key(static_cast<char>(key <= GLFW_KEY_9 ? '0' + (key - GLFW_KEY_0) : 'a' + (key - GLFW_KEY_A)));
  });
}

Result<ViewWindow> ViewWindow::open(int width, int height, const std::string& title) {
  auto state = std::make_unique<State>();
  const auto window = open_glfw_window(width, height, title.c_str(), true);
  if (!window)
    return window.error();
  state->window = *window;
  state->width = width, state->height = height;
  glfwMakeContextCurrent(*window);
  auto gl = load_gl([](const char* name) { return reinterpret_cast<void*>(glfwGetProcAddress(name)); });
  if (!gl)
    return gl.error();
  state->gl = *gl;
  state->gl.CreateTextures(GL_TEXTURE_2D, 1, &state->texture);
  state->gl.TextureStorage2D(state->texture, 1, GL_RGBA8, width, height);
  state->gl.CreateFramebuffers(1, &state->framebuffer);
  state->gl.NamedFramebufferTexture(state->framebuffer, GL_COLOR_ATTACHMENT0, state->texture, 0);
  state->listen();
  return ViewWindow(std::move(state));
}

ViewWindow::ViewWindow(std::unique_ptr<State> state) : state_(std::move(state)) {}
ViewWindow::ViewWindow(ViewWindow&&) noexcept = default;
ViewWindow& ViewWindow::operator=(ViewWindow&&) noexcept = default;
ViewWindow::~ViewWindow() = default;

void ViewWindow::on(WindowEvents events) { state_->events = std::move(events); }

Result<bool> ViewWindow::show(const Rgb8Image& picture) {
  State& s = *state_;
  if (picture.width != s.width || picture.height != s.height)
    return Error{ErrorCode::value_invalid, "the picture is not of the window's size", "window", ""};
  glfwMakeContextCurrent(s.window);
  std::vector<std::uint8_t> rgba(4 * static_cast<std::size_t>(s.width) * s.height, 255); // rows stay aligned
  for (std::size_t i = 0; i < rgba.size() / 4; ++i)
    std::copy_n(&picture.bytes[3 * i], 3, &rgba[4 * i]);
  s.gl.TextureSubImage2D(s.texture, 0, 0, 0, s.width, s.height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  int wide = 0, high = 0; // in pixels of the screen
  glfwGetFramebufferSize(s.window, &wide, &high);
  s.gl.BlitNamedFramebuffer(s.framebuffer, 0, 0, 0, s.width, s.height, 0, high, wide, 0, GL_COLOR_BUFFER_BIT,
                            GL_LINEAR);
  if (const auto drawn = check_gl(s.gl, "window"); !drawn)
    return drawn.error();
  glfwSwapBuffers(s.window);
  glfwPollEvents();
  return glfwWindowShouldClose(s.window) == GLFW_FALSE;
}

} // namespace daylit
