#pragma once

// What objects hide from themselves does not depend on where they stand: it is found once per mesh, in many directions,
// and saves most shadow rays on objects.
//
// Each vertex knows in which of 256 directions around the object something of it is in the way. A light is taken to
// reach a facet, or not to, where the four directions nearest to it agree at all three corners; else rays are traced.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/shading/light_hints.h"
#include "runtime/trace/packet_scene.h"

namespace daylit {

class SelfVisibility {
public:
  /// Of one rigid object. `scene` holds nothing else; `starts`: where rays from its vertices begin. Empty for meshes of
  /// more vertices than kMostVertices.
  static SelfVisibility find(const PacketScene& scene, std::span<const glm::vec3> starts,
                            std::span<const glm::vec3> normals);
  static constexpr std::size_t kMostVertices = 20000;

  bool empty() const { return vertices_ == 0; }
  /// What is known of each light at each vertex. `directions`: unit, in the frame that the object was found in.
  void set_lights(std::span<const glm::vec3> directions);
  /// Lights 64 `word` to 64 `word` + 63 at all points of a facet.
  KnownLights at(const std::array<std::uint32_t, 3>& facet, std::size_t word) const;
  std::size_t words() const { return words_; }

private:
  using Row = std::vector<std::uint64_t>; ///< a bit per vertex
  std::size_t vertices_ = 0, words_ = 0;
  std::vector<glm::vec3> directions_;
  std::vector<Row> blocked_, faced_; ///< per direction
  std::vector<KnownLights> known_;     ///< per vertex and word
};

} // namespace daylit
