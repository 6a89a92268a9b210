#pragma once

// The sides of the vertices that send light, one by one.

#include <algorithm>
#include <numbers>
#include <span>
#include <vector>

#include "runtime/object/relight.h"
#include "runtime/object/self_visibility.h"
#include "runtime/object/virtual_objects.h"
#include "scene/core/parallel.h"

namespace daylit {

/// From the first of ascending vertices that belong to a part to the last.
struct Range {
  std::size_t first = 0, last = 0;
};
inline Range of_part(const VirtualObjects::Part& part, std::span<const std::uint32_t> vertices) {
  const auto place = [&](std::size_t vertex) {
    return static_cast<std::size_t>(std::ranges::lower_bound(vertices, vertex) - vertices.begin());
  };
  return {place(part.first_vertex), place(part.first_vertex + part.mesh().positions.size())};
}

/// One side of a vertex that sends light.
struct LitSide {
  const VirtualObjects& objects;
  const glm::mat3& rotation; ///< of its part
  std::size_t part;
  std::size_t own;     ///< its number in the mesh
  std::size_t number;  ///< among all senders
  std::size_t in_part; ///< among those of its part
  bool back;

  const TransferVector& transfer() const {
    const VertexTransfer& t = objects.senders.transfer[number];
    return back ? t.back : t.front;
  }
  const glm::dvec3& position() const { return objects.senders.surface.positions[number]; }
  glm::dvec3 normal() const { return (back ? -1.0 : 1.0) * glm::dvec3(objects.senders.surface.normals[number]); }
  SenderSide seen() const {
    const VirtualObjects::Part& p = objects.parts[part];
    const glm::vec3& n = p.mesh().normals[own];
    return {&p.model->self.visibility(), in_part, back, rotation * VertexRays::frame(back ? -n : n)};
  }
  Rgb& of(std::span<TwoSided> radiance) const { return back ? radiance[number].back : radiance[number].front; }
  /// L += rho / pi Delta E, never below zero.
  void add_irradiance(const Rgb& change, std::span<TwoSided> radiance) const {
    const Rgb rho_over_pi = objects.senders.surface.reflectance[number] * std::numbers::inv_pi_v<float>;
    of(radiance) = glm::max(of(radiance) + rho_over_pi * change, Rgb(0.0f));
  }
  /// L += rho / pi sum_lm dL_lm C_lm, never below zero.
  void add_coefficients(const Sh9Rgb& change, std::span<TwoSided> radiance) const {
    of(radiance) = add_reflected(of(radiance), change, transfer(), objects.senders.surface.reflectance[number]);
  }
};

/// work(side) for each side that light reaches.
template <class Work>
void for_each_side(const VirtualObjects& objects, const Work& work) {
  const std::vector<std::uint32_t>& vertex = objects.senders.vertex;
  for (std::size_t k = 0; k < objects.parts.size(); ++k) {
    const VirtualObjects::Part& part = objects.parts[k];
    const glm::mat3 rotation = part.rotation();
    const auto [first, last] = of_part(part, vertex);
    parallel_for(tbb::blocked_range<std::size_t>(first, last, 64), [&, begin = first](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i)
        for (const bool back : {false, true})
          if (!back || objects.has_back[vertex[i]])
            work(LitSide{objects, rotation, k, vertex[i] - part.first_vertex, i, i - begin, back});
    });
  }
}

} // namespace daylit
