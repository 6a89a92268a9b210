#include <cmath>
#include <random>
#include <vector>

#include "bench/sh_sections.h"
#include "bench/timing.h"
#include "sh/transform.h"

namespace daylit::bench {
namespace {

constexpr int kChannels = 3;

/// Coefficients of one channel in the peer's layout.
std::vector<double> to_peer(const std::vector<double>& c, int degree, int channel) {
  std::vector<double> alm;
  for (std::ptrdiff_t m = 0; m <= degree; ++m)
    for (std::ptrdiff_t l = m; l <= degree; ++l) {
      const double f = (m ? std::sqrt(0.5) : 1.0) * (m % 2 ? -1.0 : 1.0);
      alm.push_back(f * c[std::size_t((l * l + l + m) * kChannels + channel)]);
      alm.push_back(m ? -f * c[std::size_t((l * l + l - m) * kChannels + channel)] : 0.0);
    }
  return alm;
}

struct Case {
  int degree;
  sh::RingGrid grid;
  sh::RingTransform transform;
  std::vector<double> coefficients, back, image;
};

Result<Case> prepare(int degree) {
  auto grid = sh::gauss_legendre_grid(degree);
  if (!grid)
    return Error{ErrorCode::usage, grid.error().what, grid.error().where, ""};
  auto transform = sh::RingTransform::create(*grid, degree);
  if (!transform)
    return Error{ErrorCode::usage, transform.error().what, transform.error().where, ""};
  Case c{degree, *grid, std::move(*transform), {}, {}, {}};
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  c.coefficients.resize(sh::coefficient_count(degree) * kChannels);
  for (double& v : c.coefficients)
    v = double(float(uniform(engine)));
  c.back.resize(c.coefficients.size());
  c.image.resize(c.grid.samples() * kChannels);
  return c;
}

double float_round_trip(Case& c) {
  std::vector<float> image(c.image.size());
  (void)c.transform.synthesise(c.coefficients, sh::interleaved(image.data(), c.grid.longitudes, kChannels));
  (void)c.transform.analyse(sh::interleaved<const float>(image.data(), c.grid.longitudes, kChannels), c.back);
  double worst = 0.0;
  for (std::size_t i = 0; i < c.back.size(); ++i)
    worst = std::max(worst, std::abs(double(float(c.back[i])) - c.coefficients[i]));
  return worst;
}

nlohmann::json measure_case(Case& c, const std::optional<ShPeer>& peer, int repetitions) {
  const int width = c.grid.longitudes, rings = c.grid.rings();
  std::vector<double> alm[kChannels], maps[kChannels], sums(to_peer(c.coefficients, c.degree, 0).size());
  for (int k = 0; k < kChannels && peer; ++k) {
    alm[k] = to_peer(c.coefficients, c.degree, k);
    maps[k].resize(c.grid.samples());
  }
  const auto t = alternate(
      repetitions,
      [&] { (void)c.transform.synthesise(c.coefficients, sh::interleaved(c.image.data(), width, kChannels)); },
      [&] {
        for (int k = 0; k < kChannels && peer; ++k)
          peer->synthesis(c.degree, rings, width, alm[k].data(), maps[k].data());
      },
      [&] { (void)c.transform.analyse(sh::interleaved<const double>(c.image.data(), width, kChannels), c.back); },
      [&] {
        for (int k = 0; k < kChannels && peer; ++k)
          peer->analysis(c.degree, rings, width, maps[k].data(), sums.data());
      });
  double worst = 0.0;
  for (std::size_t i = 0; i < c.back.size(); ++i)
    worst = std::max(worst, std::abs(c.back[i] - c.coefficients[i]));
  nlohmann::json row{{"degree", c.degree},
                     {"rings", rings},
                     {"longitudes", width},
                     {"round_trip_double", worst},
                     {"synthesis_ms", 1e3 * t[0]},
                     {"analysis_ms", 1e3 * t[2]},
                     {"round_trip_float", float_round_trip(c)}};
  if (peer) {
    double apart = 0.0, most = 0.0;
    for (std::size_t i = 0; i < c.image.size(); ++i) {
      apart = std::max(apart, std::abs(c.image[i] - maps[i % kChannels][i / kChannels]));
      most = std::max(most, std::abs(c.image[i]));
    }
    row["peer"] = {{"synthesis_ms", 1e3 * t[1]},
                   {"analysis_ms", 1e3 * t[3]},
                   {"synthesis_ratio", t[0] / t[1]},
                   {"analysis_ratio", t[2] / t[3]},
                   {"images_apart", apart / most}};
  }
  return row;
}

} // namespace

Result<nlohmann::json> measure_transforms(bool high_degrees, const std::optional<ShPeer>& peer, const Step& step) {
  nlohmann::json rows = nlohmann::json::array();
  for (const int degree : {35, 86, 255, 511, 1023, 2047, 4095}) {
    if (degree > 1023 && !high_degrees)
      break;
    if (!step("transforms, degree " + std::to_string(degree), degree / 4096.0))
      return interrupted_error("daylit-bench sh");
    auto c = prepare(degree);
    if (!c)
      return c.error();
    rows.push_back(measure_case(*c, peer, degree <= 255 ? 60 : degree <= 1023 ? 9 : 1));
  }
  return rows;
}

} // namespace daylit::bench
