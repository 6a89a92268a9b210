// Direct light through the windows against the reference rooms: what their total rows have above their indirect rows.

#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "scene/room/aperture.h"
#include "scene/sky/direct_sky.h"
#include "tests/simulate/truth_cases.h"

namespace daylit {
namespace {

struct Difference {
  double nrms = 0, noise = 0, worst_deviations = 0;
};

/// Ours against total - indirect of the reference, which share no random numbers: their variances add.
Difference compare(const std::string& scene, const std::string& sky_name) {
  const auto room = read_room(test::kTruthFolder / (scene == "S1" ? "s1_daylit_cornell.obj" : "s3_furnace.obj"));
  const auto rays = RayScene::build(room->room);
  const auto apertures = find_apertures(room->room, *rays);
  const Sky sky(*test::truth_sky(sky_name));
  const DirectSky direct(room->room, apertures->list, *rays, sky);
  const auto indirect = test::truth_rows(scene, sky_name, "indirect"),
             total = test::truth_rows(scene, sky_name, "total");
  EXPECT_EQ(total.size(), indirect.size());
  Difference result;
  double error = 0, power = 0, variance = 0;
  for (std::size_t i = 0; i < total.size(); ++i) {
    const Rgb ours = direct.irradiance(total[i].receiver.position, total[i].receiver.normal);
    for (int c = 0; c < 3; ++c) {
      const double truth = static_cast<double>(total[i].value[c]) - static_cast<double>(indirect[i].value[c]);
      const double v = std::pow(static_cast<double>(total[i].standard_error[c]), 2) +
                       std::pow(static_cast<double>(indirect[i].standard_error[c]), 2);
      const double d = static_cast<double>(ours[c]) - truth;
      error += d * d;
      power += truth * truth;
      variance += v;
      if (v > 0)
        result.worst_deviations = std::max(result.worst_deviations, std::abs(d) / std::sqrt(v));
    }
  }
  result.nrms = std::sqrt(error / power);
  result.noise = std::sqrt(variance / power);
  return result;
}

TEST(DirectTruth, window_light_of_the_reference_rooms_is_met_within_their_noise) {
  for (const auto& [scene, sky] : {std::pair("S1", "E1"), std::pair("S1", "E2"), std::pair("S3", "E1")}) {
    const Difference d = compare(scene, sky);
    std::printf("direct light %s/%s: %.3f %% nrms, noise of the reference %.3f %%, largest deviation %.1f sigma\n",
                scene, sky, 100 * d.nrms, 100 * d.noise, d.worst_deviations);
    EXPECT_LE(d.nrms, 3.0 * d.noise + 1e-3) << scene << "/" << sky;
  }
}

} // namespace
} // namespace daylit
