#pragma once

// A point of the lattice of receivers: what is known there, and for which placement, sky and light it holds. Each value
// is renewed when it is first asked for, by one thread.

#include <atomic>
#include <cstdint>
#include <mutex>
#include <vector>

#include "runtime/indirect/interreflection.h"
#include "runtime/indirect/lit_points.h"

namespace daylit {

struct ReceiverLattice::Node {
  std::size_t number = 0;
  std::uint32_t triangle = 0; ///< one of its plane
  glm::dvec3 x{0.0}, n{0.0};
  double cell_m = 0, farthest = 0.0; ///< of its level; farthest: radii
  const DirectionPattern* pattern = nullptr;
  Receiver receiver;
  RoomPoint here;     ///< light of the room, interpolated, with the sky unshadowed
  Rgb mirrored{0.0f}; ///< irradiance that metals send more than as diffuse surfaces
  Rgb hidden{0.0f};   ///< irradiance from what the objects hide
  Rgb before{0.0f};   ///< without the objects, sun excepted
  IndirectChange change;
  Rgb rescaled{0.0f};    ///< to be added where it is drawn: LitScene::gain_scale()
  Rgb lost_sun{0.0f};    ///< irradiance from the sun that the objects keep away
  LitPoint open;         ///< light without the objects, unshadowed
  Rgb blocked{0.0f};     ///< part of the windows that they keep away
  float visible = 0.0f;  ///< part of the windows that the room leaves
  float distance = 0.0f; ///< to the nearest surface of an object, radii
  std::atomic<std::uint64_t> light_version{0}, lost_version{0}, distance_version{0}, blocked_version{0},
      visible_version{0};
  std::uint64_t placement_version = 0, sky_version = 0, mirrored_version = 0;
  std::mutex renewing;

  std::vector<ChangedSurface> around; ///< other surfaces of the room, until an object moves
  LampView lamps;                     ///< the same: what a lamp's light comes back from
  Rgb reflected{0.0f};                ///< change of irradiance from them, lamps' light from everywhere
  std::uint64_t around_version = 0;
  std::atomic<std::uint64_t> reflected_version{0};
  std::mutex reflecting; ///< held while others renew
};

} // namespace daylit
