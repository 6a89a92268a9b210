#pragma once

// Light that goes from one part of an object to another, as radiosity has it (Cohen & Wallace 1993, chapter 4): the
// vertices that send light (senders.h) see each other, wherever the object stands.

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/object/relight.h"
#include "runtime/object/self_visibility.h"
#include "runtime/object/senders.h"
#include "runtime/object/vertex_rays.h"
#include "scene/core/result.h"
#include "scene/model/object_mesh.h"
#include "scene/room/ray_scene.h"

namespace daylit {

class SelfExchange {
public:
  static constexpr int kRays = 128; ///< from each side of each

  /// Of an object whose parts do not see each other.
  SelfExchange() = default;
  /// `closed`: nobody sees a back. `scene`: the mesh in its own frame. Error: interrupted.
  static Result<SelfExchange> make(const ObjectMesh& mesh, const RayScene& scene, const MeshSenders& senders,
                                   bool closed, const Progress& progress = kUnwatched);

  /// Irradiance of both sides of each from the radiance that all send: E_i = pi sum_k F_ik L_k.
  std::vector<TwoSided> irradiance(std::span<const TwoSided> radiance) const;
  /// L = from_outside + rho / pi E(direct + L), by Jacobi steps from the `radiance` that is there. `direct`: what they
  /// send that does not count to L. One entry per vertex that sends light.
  void reflect(std::span<const TwoSided> direct, std::span<const TwoSided> from_outside,
               std::span<const Rgb> reflectance, std::span<TwoSided> radiance) const;
  /// What its rays found.
  const SelfVisibility& visibility() const { return visibility_; }
  /// None of it sees another.
  bool empty() const { return seen_.empty(); }

private:
  struct Seen {
    std::uint32_t side; ///< of a vertex that sends light: twice its number, and 1 for its back
    float weight;       ///< pi F
  };
  static std::vector<Seen> row_of(const std::vector<SeenPoint>& seen, const ObjectMesh& mesh,
                                  std::span<const std::uint32_t> sender, float weight);

  std::vector<std::uint32_t> first_; ///< in seen_, of the front and the back of each vertex, and the end
  std::vector<Seen> seen_;
  SelfVisibility visibility_;
};

} // namespace daylit
