#pragma once

// The parts of `daylit-bench maps`. Each returns a JSON value and prints nothing.

#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "bench/maps_probe.h"
#include "scene/core/result.h"

namespace daylit::bench {

/// Called between measurements with what comes next and the fraction done; false stops the run.
using Step = std::function<bool(const std::string&, double)>;

/// |value - truth| of many texels and channels.
struct MapErrors {
  double mean = 0.0, percentile_95 = 0.0, largest = 0.0; ///< relative to the texel itself
  double mean_of_mean = 0.0;                             ///< mean, relative to the mean of the truth
};
MapErrors map_errors(const std::vector<double>& truth, const std::vector<double>& values);
nlohmann::json as_json(const MapErrors& e);

/// Radiance at some texels: [texel][3].
std::vector<double> values_at(const RadianceMap& map, const std::vector<std::size_t>& outputs);

/// Direct summation in double (bench/lobe_reference.h) by all threads: [exponent of kExponents][output][channel].
std::vector<std::vector<double>> direct_by_exponent(const AngularMap& map, const std::vector<std::size_t>& outputs);

/// Eight maps by three methods: time, error against the plain sum on the same texels, and the plain sum's time.
Result<nlohmann::json> measure_map_methods(const Probe& probe, const Step& step);

/// Tables 6.1 to 6.8 of the thesis for one probe.
Result<nlohmann::json> measure_thesis_tables(const Probe& probe, const Step& step);

} // namespace daylit::bench
