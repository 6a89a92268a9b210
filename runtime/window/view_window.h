#pragma once

// A window that shows pictures and reports what mouse and keyboard do. Main thread only.

#include <functional>
#include <memory>
#include <string>

#include <glm/vec2.hpp>

#include "scene/core/result.h"
#include "scene/image/image_formats.h"

namespace daylit {

struct WindowEvents {
  std::function<void(bool down, const glm::dvec2& pixel)> button; ///< left
  std::function<void(const glm::dvec2& pixel)> move;
  std::function<void(double steps)> scroll;
  std::function<void(char key)> key; ///< digits and small letters
};

class ViewWindow {
public:
  /// Error device: no display, no OpenGL 4.5.
  static Result<ViewWindow> open(int width, int height, const std::string& title);
  ViewWindow(ViewWindow&&) noexcept;
  ViewWindow& operator=(ViewWindow&&) noexcept;
  ~ViewWindow();

  void on(WindowEvents events);
  /// Shows a picture of the window's size, then handles events. False once the user has closed the window (or pressed
  /// Escape).
  Result<bool> show(const Rgb8Image& picture);

private:
  struct State;
  explicit ViewWindow(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace daylit
