#pragma once

// Points where the lights are asked one by one, and what they answer.

#include <cstddef>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace daylit {

struct LightPoints {
  std::vector<glm::vec4> offset; ///< xyz: from the centre of the objects' sphere
  std::vector<glm::vec4> normal; ///< xyz: unit, to the side that is lit
  std::size_t size() const { return offset.size(); }
  void resize(std::size_t count) {
    offset.resize(count);
    normal.resize(count);
  }
  void set(std::size_t k, const glm::vec3& o, const glm::vec3& n) {
    offset[k] = glm::vec4(o, 1.0f);
    normal[k] = glm::vec4(n, 0.0f);
  }
};

/// Per point, sums over the lights of a group (rgb).
struct LightAnswers {
  std::vector<glm::vec4> unblocked, lost; ///< with nothing in the way; what the objects take of what passes the room
  std::vector<glm::vec4> past_room;       ///< empty: as unblocked
  const glm::vec4& past(std::size_t k) const { return past_room.empty() ? unblocked[k] : past_room[k]; }
};

} // namespace daylit
