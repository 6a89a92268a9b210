#pragma once

// The parts of `daylit-bench sh`. Each returns a JSON value and prints nothing.

#include <functional>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "bench/sh_peer.h"
#include "scene/core/program.h"
#include "scene/image/rgb_image.h"

namespace daylit::bench {

/// Called between measurements with what comes next and the fraction done; false stops the run.
using Step = std::function<bool(const std::string&, double)>;

/// Error of one harmonic against long double, by degree: recurrence and factorials, double and float; time per call.
nlohmann::json measure_basis();

/// Time and round-trip error of the ring transforms, ours beside the peer's, by degree.
Result<nlohmann::json> measure_transforms(bool high_degrees, const std::optional<ShPeer>& peer, const Step& step);

/// Nine coefficients of a million directions against the store bandwidth of the same run.
nlohmann::json measure_nine();

/// Rotation against evaluation in the rotated frame.
nlohmann::json measure_rotation();

/// Phong-lobe maps of a 512 x 512 angular map against direct summation; the thesis' order 35 beside it.
Result<nlohmann::json> measure_lobe_maps(const RgbImage& cross, const Step& step);

/// Eight maps of 512 x 1024 pixels, exponents up to 1280.
Result<nlohmann::json> measure_eight_maps(const RgbImage& cross);

} // namespace daylit::bench
