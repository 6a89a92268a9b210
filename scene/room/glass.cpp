#include "scene/room/glass.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace daylit {

double clear_slab_transmittance(double cos_incidence, double refractive_index) {
  const double ci = std::min(std::abs(cos_incidence), 1.0), n = refractive_index;
  // (1 - c)(1 + c) keeps the digits of sin^2 near normal incidence.
  const double ct = std::sqrt(std::max(0.0, 1.0 - (1.0 - ci) * (1.0 + ci) / (n * n)));
  // (1 - R) / (1 + R) with R = ((a - b) / (a + b))^2 is 2 a b / (a^2 + b^2).
  const auto through = [](double a, double b) { return 2.0 * a * b / (a * a + b * b); };
  return ci > 0.0 ? 0.5 * (through(ci, n * ct) + through(n * ci, ct)) : 0.0;
}

std::string pane_model_name(float refractive_index) {
  return refractive_index > 0.0f ? fmt::format("clear glass, index {:.4g}", refractive_index) : "constant";
}

} // namespace daylit
