#pragma once

// Parallel light through an opening: which part of a patch it meets.

#include <array>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "radiosity/detail/sky_sweep.h"
#include "radiosity/patches.h"

namespace daylit::radiosity {

/// One patch and one part of an opening. Seen along a direction w, the opening's shadow on the patch's plane is
/// its outline moved by -h w / (n . w), h the height of a corner over the plane: an exact clip gives the lit part.
class ApertureBeam {
public:
  /// Only what lies in front of the patch counts; empty() when nothing does.
  ApertureBeam(const Patch& patch, const AperturePart& opening);
  bool empty() const { return front_.size() < 3; }
  /// Corners of what lies in front of the patch, metres, relative to the mesh origin.
  const std::vector<glm::dvec3>& front() const { return front_; }

  /// Only directions whose cosine with the axis is at least cos_spread() can meet the patch through the opening.
  const glm::dvec3& axis() const { return axis_; }
  float cos_spread() const { return cos_spread_; }

  struct LitPart {
    std::array<glm::dvec2, 12> corner; ///< in the patch's plane
    int size = 0;
    double area_m2 = 0;
  };
  /// Met by parallel light from direction w (unit, towards the light).
  LitPart lit(const glm::dvec3& w) const;
  /// A point of the lit part, uniform; metres, relative to the mesh origin.
  glm::dvec3 point(const LitPart& part, glm::dvec2 u) const;

private:
  glm::dvec3 origin_, axis_u_, axis_v_, normal_;
  std::array<glm::dvec2, 3> triangle_;
  double area_m2_;
  bool covers_patch(const LitPart& shadow) const;
  void set_cone(const Patch& patch);
  /// As they are; u, v and height over the patch's plane, in the order in which their shadows turn left.
  std::vector<glm::dvec3> front_, corner_;
  glm::dvec3 axis_{0.0}; ///< towards the middle of the opening
  float cos_spread_ = -2;
};

} // namespace daylit::radiosity
