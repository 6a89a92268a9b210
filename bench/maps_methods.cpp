#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <random>

#include "bench/lobe_reference.h"
#include "bench/maps_sections.h"
#include "bench/plain_lobes.h"
#include "bench/timing.h"
#include "runtime/maps/prefilter.h"
#include "scene/core/parallel.h"
#include "scene/core/program.h"

namespace daylit::bench {
namespace {

constexpr int kCell = 16; ///< the reference takes one texel of so many squared
constexpr std::size_t kPlainOutputs = 512;
constexpr std::size_t kLobes = 8, kNarrow = 2; ///< lobes from kNarrow on have exponents from 40 on

struct Method {
  const char* name;
  PrefilterMethod method;
  double tolerance;
  int runs;
};
constexpr Method kMethods[] = {{"mip chain", PrefilterMethod::mip_chain, 1e-5, 7},
                               {"harmonics", PrefilterMethod::harmonics, 1e-4, 7},
                               {"exact", PrefilterMethod::exact, 1e-5, 1}};

std::vector<Lobe> eight_lobes() {
  std::vector<Lobe> lobes;
  for (const double s : kEightExponents)
    lobes.push_back({s, kProbeSide});
  return lobes;
}

struct Reference {
  std::vector<std::size_t> outputs;
  std::vector<std::vector<double>> truth; ///< [lobe][output and channel]
};

Reference reference_of(const AngularMap& map, int cell) {
  Reference r;
  r.outputs = one_per_cell(map, kProbeSide, cell, 21);
  const auto all = direct_by_exponent(map, r.outputs);
  for (const double s : kEightExponents)
    r.truth.push_back(all[std::size_t(std::find(kExponents.begin(), kExponents.end(), s) - kExponents.begin())]);
  return r;
}

/// Elapsed, and of the processor by all threads: other load on the machine counts in the first only.
struct Seconds {
  double wall = std::numeric_limits<double>::infinity(), processor = wall;
};

template <class Body>
void keep_least(Seconds& least, Body&& body) {
  const double wall = wall_seconds(), processor = process_seconds();
  body();
  least = {std::min(least.wall, wall_seconds() - wall), std::min(least.processor, process_seconds() - processor)};
}

struct Run {
  Seconds all, narrow;
  std::vector<RadianceMap> maps;
};

Result<Run> run_method(const RadianceMap& source, const Method& m) {
  const auto lobes = eight_lobes();
  const PrefilterOptions options{m.tolerance, {}, {}};
  Run run;
  for (int r = 0; r < m.runs; ++r) {
    Result<std::vector<RadianceMap>> maps = std::vector<RadianceMap>{};
    keep_least(run.all, [&] { maps = prefilter(source, lobes, m.method, options); });
    if (!maps)
      return maps.error();
    run.maps = std::move(*maps);
    keep_least(run.narrow, [&] { (void)prefilter(source, std::span(lobes).subspan(kNarrow), m.method, options); });
  }
  return run;
}

/// Of the plain sum for all texels, from some of them: the work is the same for each.
void time_plain(const AngularMap& texels, std::size_t first, Seconds& least) {
  std::vector<std::size_t> outputs;
  for (std::size_t k = 0; k < kPlainOutputs; ++k)
    outputs.push_back(k * texels.x.size() / kPlainOutputs);
  Seconds some;
  keep_least(some, [&] {
    parallel_for(tbb::blocked_range<std::size_t>(0, kPlainOutputs, 32), [&](const auto& range) {
      (void)plain_lobes(texels, std::span(outputs).subspan(range.begin(), range.size()), first);
    });
  });
  const double whole = double(texels.x.size()) / double(kPlainOutputs);
  least = {std::min(least.wall, some.wall * whole), std::min(least.processor, some.processor * whole)};
}

/// What the octahedral texels change beside the angular map's pixels: both by the plain sum.
nlohmann::json resampling_errors(const Probe& probe) {
  const Reference angular = reference_of(probe.angular, 24);
  std::vector<glm::dvec3> directions;
  for (const std::size_t o : angular.outputs)
    directions.emplace_back(probe.angular.x[o], probe.angular.y[o], probe.angular.z[o]);
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t k = 0; k < kLobes; ++k) {
    std::vector<double> values;
    for (const glm::dvec3& v : plain_prefilter(probe.map, kEightExponents[k], directions))
      values.insert(values.end(), {v.x, v.y, v.z});
    rows.push_back(as_json(map_errors(angular.truth[k], values)));
  }
  return rows;
}

nlohmann::json rows_of(const Reference& reference, const std::vector<RadianceMap>& maps) {
  nlohmann::json rows = nlohmann::json::array();
  double mean = 0.0, largest = 0.0;
  for (std::size_t k = 0; k < kLobes; ++k) {
    const MapErrors e = map_errors(reference.truth[k], values_at(maps[k], reference.outputs));
    mean += e.mean / double(kLobes);
    largest = std::max(largest, e.largest);
    rows.push_back(as_json(e));
  }
  return {{"maps", rows}, {"mean_error", mean}, {"largest_error", largest}};
}

} // namespace

MapErrors map_errors(const std::vector<double>& truth, const std::vector<double>& values) {
  MapErrors e;
  std::vector<double> relative;
  double absolute = 0.0, sum = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double off = std::abs(truth[i] - values[i]);
    relative.push_back(off / (truth[i] + 1e-12)); // equation 6.1
    absolute += off;
    sum += truth[i];
    e.mean += relative.back() / double(truth.size());
  }
  std::sort(relative.begin(), relative.end());
  e.percentile_95 = relative[relative.size() * 95 / 100];
  e.largest = relative.back();
  e.mean_of_mean = absolute / sum;
  return e;
}

nlohmann::json as_json(const MapErrors& e) {
  return {{"mean", e.mean},
          {"percentile_95", e.percentile_95},
          {"largest", e.largest},
          {"mean_over_mean_of_map", e.mean_of_mean}};
}

std::vector<double> values_at(const RadianceMap& map, const std::vector<std::size_t>& outputs) {
  std::vector<double> values;
  for (const std::size_t o : outputs)
    for (int c = 0; c < 3; ++c)
      values.push_back(double(map.radiance[o][c]));
  return values;
}

std::vector<std::vector<double>> direct_by_exponent(const AngularMap& map, const std::vector<std::size_t>& outputs) {
  std::vector<std::vector<double>> out(kExponents.size(), std::vector<double>(3 * outputs.size()));
  parallel_for(tbb::blocked_range<std::size_t>(0, outputs.size(), 16), [&](const auto& range) {
    const auto part = direct_lobes(map, std::span(outputs).subspan(range.begin(), range.size()));
    for (std::size_t o = range.begin(); o != range.end(); ++o)
      for (std::size_t k = 0; k < kExponents.size(); ++k)
        for (std::size_t c = 0; c < 3; ++c)
          out[k][3 * o + c] = part[((o - range.begin()) * kExponents.size() + k) * 3 + c];
  });
  return out;
}

Result<nlohmann::json> measure_map_methods(const Probe& probe, const Step& step) {
  if (!step(probe.name + ": plain sums", 0.0))
    return interrupted_error("daylit-bench maps");
  const Reference reference = reference_of(probe.texels, kCell);
  nlohmann::json methods = nlohmann::json::object();
  Seconds plain, plain_narrow, exact, exact_narrow;
  for (const Method& m : kMethods) {
    if (!step(probe.name + ": " + m.name, 0.2))
      return interrupted_error("daylit-bench maps");
    auto run = run_method(probe.map, m);
    if (!run)
      return run.error();
    time_plain(probe.texels, 0, plain);
    time_plain(probe.texels, kNarrow, plain_narrow);
    nlohmann::json of = rows_of(reference, run->maps);
    of["ms"] = 1e3 * run->all.processor;
    of["wall_ms"] = 1e3 * run->all.wall;
    exact = run->all; // the last one
    exact_narrow = run->narrow;
    of["tolerance"] = m.tolerance;
    methods[m.name] = of;
  }
  if (!step(probe.name + ": resampling", 0.8))
    return interrupted_error("daylit-bench maps");
  return nlohmann::json{{"exponents", kEightExponents},
                        {"texels", probe.map.radiance.size()},
                        {"compared_texels", reference.outputs.size()},
                        {"largest_over_mean", probe.largest_over_mean},
                        {"methods", methods},
                        {"plain_ms", 1e3 * plain.processor},
                        {"plain_wall_ms", 1e3 * plain.wall},
                        {"plain_measured_texels", kPlainOutputs},
                        {"exact_over_plain", exact.processor / plain.processor},
                        {"exact_over_plain_from_exponent_40", exact_narrow.processor / plain_narrow.processor},
                        {"resampling", resampling_errors(probe)}};
}

} // namespace daylit::bench
