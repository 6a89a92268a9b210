#pragma once

#include <memory>
#include <span>

#include "runtime/gl/renderer.h"
#include "runtime/picture/picture_renderer.h"

namespace daylit {

enum class Backend {
  rays,
  opengl,
  osmesa,         ///< OpenGL by the library that needs no driver: slow, for comparison
  window,         ///< OpenGL of a desktop's display server
  rays_reference, ///< every pixel traces every light: the slow twin of rays
};

/// `settings`: of the picture by OpenGL. Error: the chosen one does not start.
Result<std::unique_ptr<PictureRenderer>> choose_renderer(Backend backend, const Room& room,
                                                         std::span<const Aperture> apertures,
                                                         const RenderSettings& settings = {});

} // namespace daylit
