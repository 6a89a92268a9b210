// Moving sequences against path-traced truth: camera and sun move, one session draws (daylit-bench sequence, at fewer
// frames and pixels than its defaults).

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace {

nlohmann::json sequence(const std::string& scene, const std::string& more = "") {
  const std::string folder = DAYLIT_BINARY_DIR "/sequence-test", report = folder + "-" + scene + ".json";
  const std::string command = DAYLIT_BINARY_DIR "/bin/daylit-bench sequence --folder " + folder + " --scenes " + scene +
                              " --frames 6 --stride 16 " + more + " --quiet -o " + report + " > /dev/null";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  std::ifstream file(report);
  const nlohmann::json document = nlohmann::json::parse(file, nullptr, false);
  if (!document.is_object())
    return {};
  const nlohmann::json result = document["scenes"][0];
  std::printf("%s%s: object %.2f %%, shadow %.2f %%\n", scene.c_str(), more.c_str(),
              100.0 * result["object"]["relative_rms"].get<double>(),
              100.0 * result["shadow"]["relative_rms"].get<double>());
  return result;
}

double rms(const nlohmann::json& result, const char* region) {
  return result.is_object() ? result[region]["relative_rms"].get<double>() : 1.0;
}

TEST(Sequence, under_the_overcast_sky_object_and_shadow_pixels_are_within_four_and_a_half_percent) {
  const nlohmann::json r = sequence("overcast");
  EXPECT_LE(rms(r, "object"), 0.0425); // measured 0.0327
  EXPECT_LE(rms(r, "shadow"), 0.045);  // measured 0.0371
  EXPECT_GE(r["mask_iou"].get<double>(), 0.97);
}

TEST(Sequence, in_the_sun_object_and_shadow_pixels_are_within_five_percent) {
  const nlohmann::json r = sequence("sun");
  EXPECT_LE(rms(r, "object"), 0.05);   // measured 0.0393
  EXPECT_LE(rms(r, "shadow"), 0.0425); // measured 0.0335
}

TEST(Sequence, in_the_shade_the_effect_on_the_room_takes_most_of_the_shadow_error) {
  const nlohmann::json with = sequence("shade", " --spp 512"),
                       without = sequence("shade", " --spp 512 --no-indirect-shadow");
  EXPECT_LE(rms(with, "object"), 0.09);                          // measured 0.0716
  EXPECT_LE(rms(with, "shadow"), 0.04);                          // measured 0.0310
  EXPECT_LE(rms(with, "shadow"), 0.22 * rms(without, "shadow")); // measured 0.16
}

} // namespace
