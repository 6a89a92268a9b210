#include "sh/algebra.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sh/detail/check.h"

namespace daylit::sh {
namespace {

Expected<int> degree_of(std::size_t count, int channels, const char* where) {
  const std::size_t per_channel = channels > 0 ? count / std::size_t(channels) : 0;
  const int degree = int(std::lround(std::sqrt(double(per_channel)))) - 1;
  if (channels < 1 || degree < 0 || degree > kMaxDegree || coefficient_count(degree) * std::size_t(channels) != count)
    return Error{ErrorCode::wrong_count,
                 std::to_string(count) + " coefficients do not fit " + std::to_string(channels) + " channels", where};
  return degree;
}

double energy_of(const RingGrid& grid, const ImageView<const float>& image) {
  double total = 0.0;
  for (int i = 0; i < grid.rings(); ++i) {
    double row = 0.0;
    for (int j = 0; j < grid.longitudes; ++j)
      for (int c = 0; c < image.channels; ++c) {
        const double v = double(image.data[i * image.row_stride + j * image.pixel_stride + c * image.channel_stride]);
        row += v * v;
      }
    total += row * grid.weight_sr[std::size_t(i)];
  }
  return total;
}

} // namespace

double inner_product(std::span<const double> f, std::span<const double> g) {
  double sum = 0.0;
  for (std::size_t i = 0; i < std::min(f.size(), g.size()); ++i)
    sum += f[i] * g[i];
  return sum;
}

Expected<std::vector<double>> product(std::span<const double> f, std::span<const double> g, int degree) {
  constexpr const char* where = "product";
  const auto df = degree_of(f.size(), 1, where), dg = degree_of(g.size(), 1, where);
  if (!df || !dg)
    return !df ? df.error() : dg.error();
  if (const auto ok = detail::check_degree(degree, where, kMaxDegree / 4); !ok)
    return ok.error();
  // Gauss rules with n nodes are exact to 2n - 1, the ring to 2n + 1 samples: n - 1 = half of the sum of degrees.
  const auto grid = gauss_legendre_grid((*df + *dg + degree + 1) / 2);
  if (!grid)
    return grid.error();
  auto tf = RingTransform::create(*grid, *df), tg = RingTransform::create(*grid, *dg),
       tp = RingTransform::create(*grid, degree);
  if (!tf || !tg || !tp)
    return !tf ? tf.error() : !tg ? tg.error() : tp.error();
  std::vector<double> a(grid->samples()), b(grid->samples()), out(coefficient_count(degree));
  const int width = grid->longitudes;
  if (const auto ok = tf->synthesise(f, interleaved(a.data(), width, 1)); !ok)
    return ok.error();
  if (const auto ok = tg->synthesise(g, interleaved(b.data(), width, 1)); !ok)
    return ok.error();
  for (std::size_t i = 0; i < a.size(); ++i)
    a[i] *= b[i];
  if (const auto ok = tp->analyse(interleaved<const double>(a.data(), width, 1), out); !ok)
    return ok.error();
  return out;
}

Expected<std::vector<double>> band_energies(std::span<const double> coefficients, int channels) {
  const auto degree = degree_of(coefficients.size(), channels, "band_energies");
  if (!degree)
    return degree.error();
  std::vector<double> energy(std::size_t(*degree) + 1, 0.0);
  const std::size_t step = std::size_t(channels);
  for (std::size_t l = 0; l < energy.size(); ++l)
    for (std::size_t i = l * l * step; i < (l + 1) * (l + 1) * step; ++i)
      energy[l] += coefficients[i] * coefficients[i];
  return energy;
}

Expected<OrderChoice> choose_degree(std::span<const double> bands, std::span<const double> energies, double rest_energy,
                                    double tolerance) {
  constexpr const char* where = "choose_degree";
  if (energies.empty() || bands.size() < energies.size())
    return Error{ErrorCode::wrong_count, "a factor is needed for every band", where};
  if (!(tolerance >= 0.0) || !(rest_energy >= 0.0))
    return Error{ErrorCode::parameter_out_of_range, "tolerance and rest_energy must not be negative", where};
  constexpr double sphere = 4.0 * std::numbers::pi;
  const double last = std::abs(bands[energies.size() - 1]);
  double square = last * last * rest_energy, sup = 0.0;
  OrderChoice choice{int(energies.size()) - 1, std::sqrt(square / sphere), sup};
  for (std::size_t l = energies.size() - 1; l > 0; --l) {
    square += bands[l] * bands[l] * energies[l];
    sup += std::abs(bands[l]) * std::sqrt((2.0 * double(l) + 1.0) / sphere * energies[l]);
    if (std::sqrt(square / sphere) > tolerance)
      break;
    choice = {int(l) - 1, std::sqrt(square / sphere), sup};
  }
  return choice;
}

Expected<AdaptiveAnalysis> analyse_to_tolerance(const RingGrid& grid, const ImageView<const float>& image,
                                                double relative_tolerance) {
  constexpr const char* where = "analyse_to_tolerance";
  if (!(relative_tolerance > 0.0))
    return Error{ErrorCode::parameter_out_of_range, "relative_tolerance must be positive", where};
  AdaptiveAnalysis result;
  const int most = grid.exact_degree / 2;
  for (int degree = std::min(15, most);; degree = std::min(2 * degree + 1, most)) {
    auto transform = RingTransform::create(grid, degree);
    if (!transform)
      return transform.error();
    result.coefficients.assign(coefficient_count(degree) * std::size_t(std::max(1, image.channels)), 0.0);
    if (const auto ok = transform->analyse(image, result.coefficients); !ok)
      return ok.error();
    if (result.total_energy == 0.0) // the first round; analyse() has checked the image by now
      result.total_energy = energy_of(grid, image);
    const auto energies = band_energies(result.coefficients, image.channels);
    if (!energies)
      return energies.error();
    double known = 0.0;
    for (const double e : *energies)
      known += e;
    const double rest = std::max(0.0, result.total_energy - known);
    const double tolerance = relative_tolerance * std::sqrt(result.total_energy / (4.0 * std::numbers::pi));
    const std::vector<double> ones(energies->size(), 1.0);
    const auto choice = choose_degree(ones, *energies, rest, tolerance);
    if (!choice)
      return choice.error();
    result.choice = *choice;
    if (choice->rms_left <= tolerance || degree == most)
      break;
  }
  result.coefficients.resize(coefficient_count(result.choice.degree) * std::size_t(image.channels));
  return result;
}

} // namespace daylit::sh
