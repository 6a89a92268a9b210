#include "radiosity/energy.h"

#include <array>
#include <cmath>

namespace daylit::radiosity {

namespace {

/// w_i = sum_j G_ij (1 - rho_j), m^2 per patch and channel: how much of what patch i sends the others absorb, per unit
/// of its radiosity. G is symmetric, so three products serve any number of columns.
std::vector<std::array<float, 3>> absorbed_by_others(const PatchSet& set, const ExchangeMatrix& exchange) {
  const std::size_t n = set.patches.size();
  std::vector<std::array<float, 3>> weight(n), product(n), result(n);
  for (std::size_t k = 0; k < n; ++k) {
    const Rgb& rho = set.patches[exchange.order()[k]].reflectance;
    weight[k] = {1.0f - rho[0], 1.0f - rho[1], 1.0f - rho[2]};
  }
  if (n > 0)
    exchange.multiply(weight[0].data(), 3, product[0].data());
  for (std::size_t k = 0; k < n; ++k)
    result[exchange.order()[k]] = product[k];
  return result;
}

} // namespace

/// entering = sum_i A_i H_i, absorbed = sum_i (1 - rho_i) A_i H_i + w_i B_i, leaving = sum_i A_i F_i,outside B_i.
EnergyBalance audit_energy(const PatchSet& set, const ExchangeMatrix& exchange, const FirstBounce& light,
                           const Radiosity& radiosity, const RowClosure* closed) {
  EnergyBalance balance;
  const std::size_t regions = light.columns();
  const auto others = absorbed_by_others(set, exchange);
  double unclosed = 0;
  for (std::size_t i = 0; i < set.patches.size(); ++i) {
    const Patch& e = set.patches[i];
    const double opening = static_cast<double>(light.opening[i]);
    const double gain = closed ? e.area_m2 * static_cast<double>(closed->deviation[i]) : 0.0;
    for (std::size_t k = 0; k < radiosity.columns; ++k) {
      const std::size_t channel = k / regions;
      const auto c = static_cast<int>(channel);
      const double direct = e.area_m2 * static_cast<double>(light.row(i, c)[k % regions]);
      const double b = static_cast<double>(radiosity.row(i)[k]);
      balance.entering += direct;
      balance.absorbed +=
          (1.0 - static_cast<double>(e.reflectance[c])) * direct + static_cast<double>(others[i][channel]) * b;
      balance.leaving += e.area_m2 * b * opening;
      unclosed += gain * b;
    }
  }
  if (balance.entering > 0) {
    balance.imbalance = std::abs(balance.entering - balance.absorbed - balance.leaving) / balance.entering;
    balance.unclosed = std::abs(unclosed) / balance.entering;
  }
  return balance;
}

} // namespace daylit::radiosity
