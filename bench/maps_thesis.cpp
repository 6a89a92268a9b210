#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/lobe_reference.h"
#include "bench/maps_sections.h"
#include "bench/timing.h"
#include "runtime/maps/prefilter.h"
#include "scene/core/parallel.h"
#include "scene/core/program.h"
#include "sh/direction_transform.h"
#include "sh/transform.h"
#include "sh/zonal.h"

namespace daylit::bench {
namespace {

constexpr int kOrders[] = {86, 75, 63, 50, 35, 25, 15, 10, 7, 5, 3}; ///< table 6.3
constexpr int kFirstErrorOrder = 3;                                  ///< of kOrders: tables 6.4 and 6.5 start at 50
struct Bounds {
  double exponent, width; ///< of the square in the angular map, section 6.2.2
};
constexpr Bounds kBounds[] = {{80, 0.24}, {320, 0.14}, {1280, 0.0666}};

using Table = std::vector<std::vector<double>>; ///< [exponent][output and channel]

nlohmann::json column(const Table& truth, const Table& values) {
  nlohmann::json out = nlohmann::json::array();
  for (std::size_t k = 0; k < truth.size(); ++k)
    out.push_back(as_json(map_errors(truth[k], values[k])));
  return out;
}

/// Fifteen maps of one method at the outputs.
Result<Table> our_values(const Probe& probe, PrefilterMethod method, double tolerance,
                         const std::vector<std::size_t>& outputs) {
  std::vector<Lobe> lobes;
  for (const double s : kExponents)
    lobes.push_back({s, kProbeSide});
  const auto maps = prefilter(probe.map, lobes, method, {tolerance, {}, {}});
  if (!maps)
    return maps.error();
  Table out;
  for (const RadianceMap& map : *maps)
    out.push_back(values_at(map, outputs));
  return out;
}

/// The thesis' own mip maps, equations 4.1 to 4.3: one texel of the level log2 N - log2 min(max(s / 2, 4), N).
Table thesis_mip_values(const Probe& probe, const std::vector<std::size_t>& outputs) {
  std::vector<RadianceMap> chain{probe.map};
  while (chain.back().side > 4)
    chain.push_back(halved(chain.back()));
  Table out;
  for (const double s : kExponents) {
    const double side = std::clamp(s / 2.0, 4.0, double(kProbeSide));
    const double level = std::log2(kProbeSide / side);
    const std::size_t fine = std::min(std::size_t(level), chain.size() - 2);
    const float part = float(level - double(fine));
    std::vector<double> values;
    for (const std::size_t o : outputs) {
      const glm::vec3 w(probe.map.direction(o));
      const Rgb v = (1.0f - part) * chain[fine].lookup(w) + part * chain[fine + 1].lookup(w);
      values.insert(values.end(), {double(v.r), double(v.g), double(v.b)});
    }
    out.push_back(std::move(values));
  }
  return out;
}

/// Coefficients of the texels with their weights as a fourth channel, to the highest order of the error tables.
std::vector<double> analyse_texels(const AngularMap& map, int degree) {
  std::vector<double> four;
  for (std::size_t i = 0; i < map.x.size(); ++i)
    four.insert(four.end(), {map.values[3 * i], map.values[3 * i + 1], map.values[3 * i + 2], 1.0});
  std::vector<double> c(sh::coefficient_count(degree) * 4);
  (void)sh::DirectionTransform::create(map.x, map.y, map.z, degree)->analyse(four, map.solid_angle, 4, c);
  return c;
}

/// Exact series cut at an order, at the outputs; nothing is clamped.
Table cut_values(const AngularMap& map, const std::vector<double>& coefficients, int order,
                 const std::vector<std::size_t>& outputs) {
  std::vector<double> x, y, z, four(4 * outputs.size());
  for (const std::size_t o : outputs) {
    x.push_back(map.x[o]);
    y.push_back(map.y[o]);
    z.push_back(map.z[o]);
  }
  auto transform = *sh::DirectionTransform::create(x, y, z, order - 1);
  Table out;
  for (const double s : kExponents) {
    std::vector<double> c(coefficients.begin(),
                          coefficients.begin() + std::ptrdiff_t(sh::coefficient_count(order - 1) * 4));
    (void)sh::convolve(*sh::phong_mean_bands(s, order - 1), 4, c);
    (void)transform.synthesise(c, 4, four);
    std::vector<double> values;
    for (std::size_t o = 0; o < outputs.size(); ++o)
      for (std::size_t k = 0; k < 3; ++k)
        values.push_back(four[4 * o + k] / four[4 * o + 3]);
    out.push_back(std::move(values));
  }
  return out;
}

/// Table 6.3: coefficients of the map, and eight maps from them, one thread.
nlohmann::json order_times(const AngularMap& map) {
  nlohmann::json rows = nlohmann::json::array();
  auto plan = *sh::DirectionTransform::create(map.x, map.y, map.z, 0);
  std::vector<double> values(3 * map.x.size());
  for (const int order : kOrders) {
    auto transform = *plan.at_degree(order - 1);
    std::vector<double> c(sh::coefficient_count(order - 1) * 3);
    const double analysis = time_once([&] { (void)transform.analyse(map.values, map.solid_angle, 3, c); });
    const double maps = time_once([&] {
      for (int k = 0; k < 8; ++k)
        (void)transform.synthesise(c, 3, values);
    });
    rows.push_back({{"order", order}, {"analysis_ms", 1e3 * analysis}, {"eight_maps_ms", 1e3 * maps}});
  }
  return rows;
}

/// Algorithm 6.1 on the angular map: only pixels of a square of `width` about the output's, moved inside the picture.
Table bounded_values(const AngularMap& map, double width, const std::vector<std::size_t>& outputs) {
  Table out(kExponents.size(), std::vector<double>(3 * outputs.size()));
  const int wide = int(width * kProbeSide);
  const auto first_of = [&](int at) { return std::clamp(at - wide / 2, 0, kProbeSide - wide); };
  parallel_for(std::size_t(0), outputs.size(), [&](std::size_t k) {
    const std::size_t o = outputs[k];
    const int column = first_of(map.column[o]), row = first_of(map.row[o]);
    double sum[kExponents.size()][4] = {};
    for (std::size_t i = 0; i < map.x.size(); ++i) {
      if (map.column[i] < column || map.column[i] >= column + wide || map.row[i] < row || map.row[i] >= row + wide)
        continue;
      const double t = map.x[i] * map.x[o] + map.y[i] * map.y[o] + map.z[i] * map.z[o];
      for (std::size_t e = 0; t > 0.0 && e < kExponents.size(); ++e) {
        const double f = std::pow(t, kExponents[e]) * map.solid_angle[i];
        for (std::size_t c = 0; c < 3; ++c)
          sum[e][c] += f * map.values[3 * i + c];
        sum[e][3] += f;
      }
    }
    for (std::size_t e = 0; e < kExponents.size(); ++e)
      for (std::size_t c = 0; c < 3; ++c)
        out[e][3 * k + c] = sum[e][c] / sum[e][3];
  });
  return out;
}

/// Tables 6.7 and 6.8.
nlohmann::json bounds_errors(const Probe& probe) {
  const auto outputs = one_per_cell(probe.angular, kProbeSide, 24, 22);
  const Table truth = direct_by_exponent(probe.angular, outputs);
  nlohmann::json out = nlohmann::json::object();
  for (const Bounds& b : kBounds)
    out[std::to_string(int(b.exponent))] = column(truth, bounded_values(probe.angular, b.width, outputs));
  return out;
}

/// Table 6.6: one map each; and their values at the outputs.
Result<nlohmann::json> bounds_times(const Probe& probe, const std::vector<std::size_t>& outputs, Table& values) {
  nlohmann::json rows = nlohmann::json::array();
  for (const double s : kExponents) {
    const Lobe lobe{s, kProbeSide};
    Result<std::vector<RadianceMap>> maps = std::vector<RadianceMap>{};
    const double seconds = wall_time_once([&] {
      maps = prefilter(probe.map, std::span(&lobe, 1), PrefilterMethod::exact, {1e-5, {}, {}});
    });
    if (!maps)
      return maps.error();
    values.push_back(values_at((*maps)[0], outputs));
    rows.push_back({{"exponent", s}, {"exact_ms", 1e3 * seconds}});
  }
  return rows;
}

} // namespace

Result<nlohmann::json> measure_thesis_tables(const Probe& probe, const Step& step) {
  const auto at = [&](const char* what, double done) { return step(probe.name + ": tables, " + what, done); };
  if (!at("plain sums", 0.0))
    return interrupted_error("daylit-bench maps");
  const auto outputs = one_per_cell(probe.texels, kProbeSide, 16, 23);
  const Table truth = direct_by_exponent(probe.texels, outputs);
  nlohmann::json methods{{"thesis mip maps", column(truth, thesis_mip_values(probe, outputs))}}, orders;
  const std::vector<double> coefficients = analyse_texels(probe.texels, kOrders[kFirstErrorOrder] - 1);
  for (std::size_t k = kFirstErrorOrder; k < std::size(kOrders); ++k)
    orders[std::to_string(kOrders[k])] = column(truth, cut_values(probe.texels, coefficients, kOrders[k], outputs));
  const std::tuple<const char*, PrefilterMethod, double> ours[] = {{"mip chain", PrefilterMethod::mip_chain, 1e-5},
                                                                   {"harmonics", PrefilterMethod::harmonics, 1e-4}};
  for (const auto& [name, method, tolerance] : ours) {
    if (!at(name, 0.3))
      return interrupted_error("daylit-bench maps");
    const auto values = our_values(probe, method, tolerance, outputs);
    if (!values)
      return values.error();
    methods[name] = column(truth, *values);
  }
  if (!at("bounds", 0.7))
    return interrupted_error("daylit-bench maps");
  Table exact;
  auto times = bounds_times(probe, outputs, exact);
  if (!times)
    return times.error();
  methods["exact"] = column(truth, exact);
  return nlohmann::json{
      {"exponents", kExponents}, {"compared_texels", outputs.size()},        {"methods", methods},
      {"orders", orders},        {"order_times", order_times(probe.texels)}, {"fixed_bounds", bounds_errors(probe)},
      {"bounds_times", *times}};
}

} // namespace daylit::bench
