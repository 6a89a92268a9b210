#include "scene/volume/sh_layout.h"

#include <cmath>
#include <numbers>

#include "sh/sh9.h"

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi;

/// Constants in front of y, z, x, xy, yz, 3zz - 1, xz, xx - yy of the orthonormal basis, after that of 1.
const std::array<double, 9> kConstant{
    std::sqrt(1.0 / (4 * kPi)),  std::sqrt(3.0 / (4 * kPi)),  std::sqrt(3.0 / (4 * kPi)),
    std::sqrt(3.0 / (4 * kPi)),  std::sqrt(15.0 / (4 * kPi)), std::sqrt(15.0 / (4 * kPi)),
    std::sqrt(5.0 / (16 * kPi)), std::sqrt(15.0 / (4 * kPi)), std::sqrt(15.0 / (16 * kPi))};

/// Factor of each coefficient in the engine's numbers, after the turn into its axes.
double factor(std::size_t k, ShLayout layout) {
  switch (layout) {
  case ShLayout::unity: {
    constexpr std::array<double, 9> kLobe{1.0,       2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 1.0 / 4.0,
                                          1.0 / 4.0, 1.0 / 4.0, 1.0 / 4.0, 1.0 / 4.0}; // A_l / pi
    return kLobe[k] * kConstant[k];
  }
  case ShLayout::unreal:
    return k == 1 || k == 3 || k == 5 || k == 7 ? -1.0 : 1.0;
  case ShLayout::three:
    break;
  }
  return 1.0;
}

glm::dvec3 world_axes(const glm::dvec3& d, ShLayout layout) {
  if (layout == ShLayout::three)
    return {d.x, -d.z, d.y};
  return engine_axes(d, layout); // exchanging or mirroring axes twice changes nothing
}

struct Node {
  glm::dvec3 direction;
  double weight_sr;
};

/// The cubature of 26 points over the sphere, exact to degree 7 (Lebedev 1976).
std::array<Node, 26> lebedev_26() {
  std::array<Node, 26> nodes{};
  std::size_t count = 0;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const int axes = std::abs(x) + std::abs(y) + std::abs(z);
        if (axes == 0)
          continue;
        const double weight = axes == 1 ? 1.0 / 21.0 : axes == 2 ? 4.0 / 105.0 : 9.0 / 280.0;
        nodes[count++] = {glm::dvec3(x, y, z) / std::sqrt(double(axes)), 4 * kPi * weight};
      }
  return nodes;
}

/// Coefficients of the function d -> f(source(d)): integral of f(source(d)) Y_lm(d) over the sphere. The integrand is a
/// polynomial of degree 4, which the cubature integrates exactly.
template <class Source>
std::array<glm::dvec3, 9> turned(const std::array<glm::dvec3, 9>& f, Source source) {
  std::array<glm::dvec3, 9> out{};
  for (const Node& node : lebedev_26()) {
    const std::array<double, 9> there = sh::evaluate9<double>(source(node.direction)),
                                here = sh::evaluate9<double>(node.direction);
    glm::dvec3 value(0.0);
    for (std::size_t k = 0; k < 9; ++k)
      value += there[k] * f[k];
    for (std::size_t k = 0; k < 9; ++k)
      out[k] += node.weight_sr * here[k] * value;
  }
  return out;
}

/// Where a coefficient's channel is among the 27 numbers.
std::size_t offset_of(std::size_t k, std::size_t channel, ShLayout layout) {
  return layout == ShLayout::three ? 3 * k + channel : 9 * channel + k;
}

} // namespace

glm::dvec3 engine_axes(const glm::dvec3& d, ShLayout layout) {
  switch (layout) {
  case ShLayout::unity:
    return {d.x, d.z, d.y};
  case ShLayout::unreal:
    return {d.x, -d.y, d.z};
  case ShLayout::three:
    break;
  }
  return {d.x, d.z, -d.y};
}

std::array<float, 27> to_engine(const Sh9Rgb& radiance, ShLayout layout) {
  std::array<glm::dvec3, 9> ours{};
  for (std::size_t k = 0; k < 9; ++k)
    ours[k] = glm::dvec3(radiance[k]);
  const auto theirs = turned(ours, [&](const glm::dvec3& d) { return world_axes(d, layout); });
  std::array<float, 27> numbers{};
  for (std::size_t k = 0; k < 9; ++k)
    for (std::size_t c = 0; c < 3; ++c)
      numbers[offset_of(k, c, layout)] = static_cast<float>(factor(k, layout) * theirs[k][static_cast<int>(c)]);
  return numbers;
}

} // namespace daylit
