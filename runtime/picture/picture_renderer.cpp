#include "runtime/picture/picture_renderer.h"

#include <numeric>

namespace daylit {

Result<void> check_vertex_light(std::span<const std::uint32_t> vertices, std::size_t lights, std::size_t vertex_count) {
  if (lights == vertices.size() && (vertices.empty() || vertices.back() < vertex_count))
    return {};
  return Error{ErrorCode::value_invalid,
               "light of " + std::to_string(lights) + " for " + std::to_string(vertices.size()) +
                   " vertices, the objects have " + std::to_string(vertex_count),
               "renderer", "set the objects first"};
}

std::vector<std::uint32_t> every_vertex(std::size_t count) {
  std::vector<std::uint32_t> vertices(count);
  std::iota(vertices.begin(), vertices.end(), 0u);
  return vertices;
}

} // namespace daylit
