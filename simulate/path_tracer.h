#pragma once

// Unbiased light transport between diffuse surfaces: unlimited bounces with Russian roulette. Four ways to find light,
// combined with the balance heuristic (Veach 1997): directions through the openings, bright spots of a sky image,
// cosine-distributed directions, and, for the sun, its disc seen from a surface or a sunlit surface seen from another.
//
// Objects may mirror, refract and send light. What the camera sees through any number of such surfaces is exact, the
// sun's disc too. Caustics are left out, as in the renderer: light of diffuse surfaces goes straight through
// transparent objects, weakened, and finds neither the sun's disc nor bright spots of a sky image in a mirror.

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
    float share = 1.0f;     ///< of paths that go on from here as from a diffuse surface
  };
  /// Dimension pairs of one vertex.
  enum Pair : std::uint32_t { kBounce, kOpening, kSpot, kSun, kBeamSun, kBeamPoint, kRoulette, kLobe, kPairsPerVertex };
  struct Path {
    const SampleStream& samples;
    bool with_object;
    bool touched = false;
    std::uint32_t depth = 0, first = 0; ///< of the vertex, of the first vertex
    float full = 1e-30f;                ///< largest channel of the weight there
    int channel = -1;                   ///< the one that is left where colours are bent apart
    bool diffuse_before = false;        ///< a diffuse surface has scattered the path

    glm::vec2 point(Pair pair) const { return samples.point(depth * kPairsPerVertex + pair); }
  };
  /// Irradiance at a vertex because of a sunlit surface, and where that is.
  struct BeamLight {
    Rgb irradiance{0.0f};
    glm::vec3 direction{0.0f};
  };
  Vertex vertex_at(const SurfacePoint& point) const;
  Rgb open_cosine(const Vertex& v, const glm::vec3& direction, Path& path) const;
  Rgb sky_from_openings(const Vertex& v, const glm::vec2& u, Path& path) const;
  Rgb sky_from_spots(const Vertex& v, const glm::vec2& u, Path& path) const;
  Rgb sun(const Vertex& v, const glm::vec2& u, const Vertex* previous, Path& path) const;
  float bounce_weight(const Vertex& v, const Vertex* previous, const glm::vec3& to_sun, const Path& path) const;
  BeamLight sunlit_surface(const Vertex& v, Path& path) const;
  Rgb direct(const Vertex& v, const Vertex* previous, Path& path) const;
  Rgb first_hit(const glm::vec3& direction, const SurfacePoint& hit, Path& path) const;
  Rgb scattered(Vertex v, Rgb throughput, const Vertex* previous, bool direct_at_first, Path& path) const;
  float escape_weight(const Vertex& v, const glm::vec3& direction) const;
  bool survives(Rgb& throughput, const Path& path) const;
  glm::vec3 sun_direction(const glm::vec2& u) const;

  // Surfaces that are not plainly diffuse: glossy_paths.cpp.
  struct Met;
  Rgb from_glossy(SurfacePoint hit, glm::vec3 direction, Rgb throughput, const Vertex* previous, Path& path) const;
  Met met(const SurfacePoint& hit, const glm::vec3& direction, Rgb& throughput, Path& path) const;
  Rgb glossy_direct(const Met& m, const Vertex* previous, Path& path) const;
  Rgb glossy_sky(const Met& m, const glm::vec3& direction, Path& path) const;
  Rgb glossy_sun(const Met& m, const Vertex* previous, Path& path) const;
  Rgb open_base(const Met& m, const glm::vec3& direction, bool open, Path& path) const;
  bool open_glossy(const Met& m, const glm::vec3& direction, Path& path) const;
  Rgb escaped(const Met& m, const glm::vec3& direction, const Path& path) const;
  Rgb base_brdf(const SurfacePoint& y, const glm::vec3& to, const glm::vec3& from) const;
};

/// Direction about `normal` with density cos / pi, from a point of the unit square (concentric map, Shirley & Chiu
/// 1997).
glm::vec3 sample_cosine(const glm::vec3& normal, const glm::vec2& u);

} // namespace daylit
