#pragma once

// Directions from a point through the openings of a room, uniform in solid angle within an opening. Sample, density
// and the crossings come together.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/room/room.h"

namespace daylit {

/// Solid angle of a triangle seen from the origin, sr (Van Oosterom & Strackee 1983, eq. 8). Corners: any lengths.
double triangle_solid_angle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);
/// Unit direction through a triangle seen from the origin, uniform in solid angle (Arvo 1995). Its solid angle > 0.
glm::dvec3 sample_triangle_direction(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::vec2& u);

struct ApertureSample {
  glm::vec3 direction{0.0f};
  float density = 0.0f; ///< per sr, of ApertureSampler::sample at this direction
  Rgb transmittance{1.0f};
};

/// Keeps the openings relative to a local origin (RayScene::origin()) in float range.
class ApertureSampler {
public:
  ApertureSampler(std::span<const Aperture> apertures, const glm::dvec3& origin);

  bool empty() const { return panes_.empty(); }
  /// A direction towards one opening that faces `local_point`, openings chosen by their solid angle. Empty when no
  /// opening is seen (all behind, or edge on).
  std::optional<ApertureSample> sample(const glm::vec3& local_point, const glm::vec2& u) const;
  /// Density of sample() in a direction; 0 when the ray crosses no opening from the inside.
  float density(const glm::vec3& local_point, const glm::vec3& direction) const;
  /// Product over the panes that the ray crosses, from either side.
  Rgb transmittance(const glm::vec3& local_point, const glm::vec3& direction) const;

  /// A point on an opening, uniform in the cross-section of the beam that enters along -to_sun; openings are chosen by
  /// their cross-section. Empty when the beam enters nowhere.
  std::optional<glm::vec3> sample_beam(const glm::vec3& to_sun, const glm::vec2& u) const;
  /// Density, per m^2 of beam cross-section, with which sample_beam() picks the beam that meets a point of the room.
  float beam_density(const glm::vec3& local_point, const glm::vec3& to_sun) const;

private:
  struct Pane {
    std::vector<glm::dvec3> corners; ///< local
    glm::dvec3 inward{0.0};
    Rgb transmittance{1.0f};
    float refractive_index = 0.0f; ///< 0: constant transmittance
    bool is_open() const { return transmittance == Rgb(1.0f) && refractive_index == 0.0f; }
    Rgb at(const glm::dvec3& unit_direction) const;
  };
  /// Fans of triangles that cover the panes; panes own runs of them.
  struct Part {
    std::uint32_t pane = 0;
    glm::dvec3 a{0.0}, b{0.0}, c{0.0}; ///< local
    double area_m2 = 0.0;
  };
  std::vector<Pane> panes_;
  std::vector<Part> parts_;

  static bool crosses(const Pane& pane, const glm::dvec3& point, const glm::dvec3& direction, double& distance);
  bool faces(const Pane& pane, const glm::dvec3& point) const;
  /// Solid angle of a part, 0 from behind.
  double seen_solid_angle(const Part& part, const glm::dvec3& point) const;
  double cross_section(const Part& part, const glm::dvec3& to_sun) const;
};

} // namespace daylit
