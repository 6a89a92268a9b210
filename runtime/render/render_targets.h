#pragma once

#include <array>
#include <vector>

#include <glm/vec4.hpp>

#include "runtime/render/gl_objects.h"

namespace daylit {

/// Three float colour targets and depth, several samples per pixel, and their single-sample averages.
class RenderTargets {
public:
  static constexpr int kColours = 3;
  static Result<RenderTargets> make(const Gl& gl, int width_px, int height_px, int samples);

  void bind_and_clear() const;
  /// Averages the samples and reads one target back, row 0 first.
  Result<std::vector<glm::vec4>> read(int colour) const;
  void resolve() const;
  int width_px() const { return width_; }
  int height_px() const { return height_; }

private:
  Gl gl_;
  GlFramebuffer multi_, single_;
  std::array<GlTexture, kColours> multi_colour_, single_colour_;
  GlTexture multi_depth_;
  int width_ = 0, height_ = 0;
};

} // namespace daylit
