#pragma once

// Unbiased light transport between diffuse surfaces: unlimited bounces with Russian roulette. Four ways to find light,
// combined with the balance heuristic (Veach 1997): directions through the openings, bright spots of a sky image,
// cosine-distributed directions, and, for the sun, its disc seen from a surface or a sunlit surface seen from another.

#include <cstdint>

#include "simulate/low_discrepancy.h"
#include "simulate/trace_scene.h"

namespace daylit {

/// What one path found, and whether it would have found the same without the object.
struct PathResult {
  Rgb value{0.0f};
  bool touched = false;   ///< some ray of it met the object
  bool on_object = false; ///< a camera ray whose first surface is the object
};

class PathTracer {
public:
  explicit PathTracer(const TraceScene& scene) : scene_(&scene) {}

  /// Radiance that arrives at `local_origin` from `direction`, sky and sun disc included.
  PathResult radiance(const glm::vec3& local_origin, const glm::vec3& direction, const SampleStream& samples,
                      bool with_object) const;
  /// The same without light that comes straight from the sky: what "indirect" means.
  PathResult indirect_radiance(const glm::vec3& local_origin, const glm::vec3& direction, const SampleStream& samples,
                               bool with_object) const;
  /// Irradiance estimates at a free point in the air (an infinitesimal receiver with a unit normal).
  PathResult indirect_irradiance(const glm::vec3& local_point, const glm::vec3& normal, const SampleStream& samples,
                                 bool with_object) const;
  PathResult direct_irradiance(const glm::vec3& local_point, const glm::vec3& normal, const SampleStream& samples,
                               bool with_object) const;

private:
  const TraceScene* scene_;

  /// A diffuse scattering point: the radiance out is `albedo / pi` times the irradiance.
  struct Vertex {
    glm::vec3 position{0.0f}, geometric_normal{0.0f}, normal{0.0f};
    glm::vec3 origin{0.0f}; ///< position moved off the surface: where rays start
  };
  struct Path;
  Vertex vertex_at(const SurfacePoint& point) const;
  float open_cosine(const Vertex& v, const glm::vec3& direction, Path& path) const;
  Rgb sky_from_openings(const Vertex& v, const glm::vec2& u, Path& path) const;
  Rgb sky_from_spots(const Vertex& v, const glm::vec2& u, Path& path) const;
  Rgb sun(const Vertex& v, const glm::vec2& u, const Vertex* previous, Path& path) const;
  Rgb sunlit_surface(const Vertex& v, const glm::vec2& u_sun, const glm::vec2& u_beam, Path& path) const;
  Rgb direct(const Vertex& v, std::uint32_t depth, const Vertex* previous, Path& path) const;
  Rgb scattered(Vertex v, Rgb throughput, std::uint32_t depth, bool direct_at_first, Path& path) const;
  float escape_weight(const Vertex& v, const glm::vec3& direction) const;
  glm::vec3 sun_direction(const glm::vec2& u) const;
};

/// Direction about `normal` with density cos / pi, from a point of the unit square (concentric map, Shirley & Chiu
/// 1997).
glm::vec3 sample_cosine(const glm::vec3& normal, const glm::vec2& u);

} // namespace daylit
