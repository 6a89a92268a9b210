#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/gl/renderer.h"
#include "runtime/picture/picture_renderer.h"

namespace daylit {

enum class Backend {
  automatic, ///< OpenGL where a graphics processor runs it, rays elsewhere
  opengl,
  osmesa, ///< OpenGL by the library that needs no driver: slow, for comparison
  window, ///< OpenGL of a desktop's display server
  rays,
  rays_reference, ///< every pixel traces every light: the slow twin of rays
};

/// `notes`: what was chosen against expectation; `settings`: of the picture by OpenGL. Error: the chosen one does
/// not start.
Result<std::unique_ptr<PictureRenderer>> choose_renderer(Backend backend, const Room& room,
                                                         std::span<const Aperture> apertures,
                                                         std::vector<std::string>& notes,
                                                         const RenderSettings& settings = {});

} // namespace daylit
