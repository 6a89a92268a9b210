#pragma once

// The rays that GlossyRays follows, for its sources.

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/reflect/glossy_surface.h"

namespace daylit {

/// A ray of the tree, from outside or inside the objects.
struct GlossyRays::Branch {
  WorldRay ray;
  Rgb weight{1.0f};           ///< what of the light along it reaches the camera
  Rgb absorption_per_m{0.0f}; ///< of what it runs through
  std::uint32_t tree = 0;
  int depth = 0, channel = kAllColours;
  bool inside = false;
  float width_rad = 0.0f;     ///< RoomRay::width_rad
  float lobe_density = 0.0f;  ///< of all samples of its lobe, per sr
  std::size_t light_step = 0; ///< every how many-th light finds the sky, too; 0: none
  /// From its origin: to before the surface that it went through, which may lie on the room.
  glm::dvec3 room_from{0.0};
  bool sky_is_known = false; ///< where it ends in the sky: by lights, as it left the surface
  int uncounted = 0;         ///< reflections before that `depth` does not count
  int lobes = 0;             ///< wide ones before, each with a place of its own
};

/// Trees of rays, each of one sample of a lobe at the camera, grown together.
struct GlossyRays::Work {
  struct Tree {
    Rgb* radiance = nullptr;           ///< where its light is added to
    float share = 1.0f;                ///< times this
    glm::vec2 u{0.5f};                 ///< place in the lobes
    std::uint32_t of_coat = kThisTree; ///< that the camera's ray of a narrow coat goes to
    bool takes_lights = true;          ///< `u` is one of many
    int lights = 0;                    ///< as CameraPoint
    /// Places in the lobe of the next surface: where the camera sees a picture, no neighbour shares what that shows.
    std::span<const glm::vec2> next_places{};
    int* met = nullptr; ///< counts the camera's rays that meet an object
  };
  static constexpr std::uint32_t kThisTree = ~0u;
  std::vector<Tree> trees;
  std::vector<Branch> level, next;
  std::uint64_t rays = 0;

  void add(std::uint32_t tree, const Rgb& radiance) { *trees[tree].radiance += trees[tree].share * radiance; }
};

} // namespace daylit
