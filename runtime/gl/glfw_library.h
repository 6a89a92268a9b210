#pragma once

// What both windows need of GLFW: the hidden one that only brings OpenGL, and the one that shows pictures.

#include <string>

#include "scene/core/result.h"

struct GLFWwindow;

namespace daylit {

/// Error device with GLFW's own last words.
Error glfw_error(const std::string& what);
/// With an OpenGL 4.5 core context, not yet current. Starts GLFW when it is first called. Main thread only.
Result<GLFWwindow*> open_glfw_window(int width, int height, const char* title, bool visible);

} // namespace daylit
