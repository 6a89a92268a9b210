// The whole way at half size, through the programs as a user runs them: simulate, bake, draw, compare with the truth.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace {

const std::string kBin = DAYLIT_BINARY_DIR "/bin/";

int shell(const std::string& command) { return std::system(command.c_str()); }

/// Simulates as `scene` says, bakes, draws and compares: the errors that daylit-simulate compare prints; empty when a
/// program failed.
nlohmann::json picture_error(const std::string& scene, const std::string& folder) {
  std::filesystem::create_directories(folder);
  const std::string steps[] = {
      kBin + "daylit-simulate " + scene + " -o " + folder + " --quiet",
      kBin + "daylit-precompute " + folder + "/room.obj -o " + folder + "/room.volume --quiet",
      kBin + "daylit-run " + folder + "/CONFIG.toml --quiet",
      kBin + "daylit-simulate compare " + folder + " --json > " + folder + "/errors.json",
  };
  for (const std::string& step : steps)
    if (shell(step) != 0) {
      ADD_FAILURE() << "failed: " << step;
      return {};
    }
  std::ifstream file(folder + "/errors.json");
  return nlohmann::json::parse(file, nullptr, false);
}

nlohmann::json picture_error(const std::string& demo) {
  return picture_error("--demo " + demo + " --size 256,248", DAYLIT_BINARY_DIR "/demo-test/" + demo);
}

/// Room beside the object: no glow, no dark line.
void expect_contact_within(const nlohmann::json& contact, double bar) {
  EXPECT_LE(contact["relative_rms"].get<double>(), bar);
  EXPECT_LE(contact["brightest"].get<double>(), 0.20);
  EXPECT_GE(contact["darkest"].get<double>(), -0.25);
}

/// Relative RMS on the object and beside it; the truth's own standard error must be 0.3 of the bar at most.
void expect_object_within(const std::string& scene, double bar, double contact_bar) {
  const nlohmann::json e = picture_error(scene);
  ASSERT_TRUE(e.is_object()) << e.dump();
  std::printf("%s: %s\n", scene.c_str(), e.dump().c_str());
  EXPECT_LE(e["object"]["relative_rms"].get<double>(), bar);
  EXPECT_LE(e["object"]["truth_standard_error"].get<double>(), 0.3 * bar);
  EXPECT_GE(e["mask_iou"].get<double>(), 0.97);
  EXPECT_GE(e["object_fraction"].get<double>(), 0.05);
  EXPECT_LE(e["object_fraction"].get<double>(), 0.15);
  expect_contact_within(e["contact"], contact_bar);
}

// Measured 3.9 and 6.2 %, of which the truth's own noise is 1.3 and 1.8 %; beside the object 1.2 and 1.5, in the shade
// 1.9 %.
TEST(Demo, object_under_the_overcast_sky_is_within_five_percent) { expect_object_within("overcast", 0.05, 0.02); }
TEST(Demo, object_in_the_sun_is_within_seven_and_a_half_percent) { expect_object_within("sun", 0.075, 0.025); }

/// A ball of radius 6 cm around the origin, with its material.
void write_ball(const std::string& folder, const std::string& name, const std::string& reflectance) {
  constexpr int kAround = 48, kAcross = 24;
  std::ofstream(folder + "/" + name + ".mtl") << "newmtl ball\nKd " << reflectance << "\n";
  std::ofstream out(folder + "/" + name + ".obj");
  out << "mtllib " << name << ".mtl\nusemtl ball\n";
  for (int i = 0; i < kAround; ++i)
    for (int j = 0; j <= kAcross; ++j) {
      const double u = 2.0 * std::numbers::pi * i / kAround,
                   v = std::numbers::pi * (static_cast<double>(j) / kAcross - 0.5);
      const double n[3] = {std::cos(u) * std::cos(v), std::sin(u) * std::cos(v), std::sin(v)};
      out << "v " << 0.06 * n[0] << " " << 0.06 * n[1] << " " << 0.06 * n[2] << "\n"
          << "vn " << n[0] << " " << n[1] << " " << n[2] << "\n";
    }
  const auto corner = [](int i, int j) {
    const std::string index = std::to_string(i % kAround * (kAcross + 1) + j + 1);
    return " " + index + "//" + index;
  };
  for (int i = 0; i < kAround; ++i)
    for (int j = 0; j < kAcross; ++j) {
      if (j > 0)
        out << "f" << corner(i, j) << corner(i + 1, j) << corner(i + 1, j + 1) << "\n";
      if (j + 1 < kAcross)
        out << "f" << corner(i, j) << corner(i + 1, j + 1) << corner(i, j + 1) << "\n";
    }
}

TEST(Demo, balls_beside_each_other_are_within_two_and_a_quarter_percent) {
  // A white ball and a dark red one 8 mm apart. Without light between them 2.9 %: the white one takes the room's light
  // from where the dark one stands.
  const std::string folder = DAYLIT_BINARY_DIR "/demo-test/balls";
  std::filesystem::create_directories(folder);
  ASSERT_EQ(shell(kBin + "daylit-simulate --demo overcast -o " + folder + " --size 192,186 --spp 16 --quiet"), 0);
  write_ball(folder, "white", "0.7 0.7 0.7");
  write_ball(folder, "dark", "0.2 0.03 0.03");
  std::ifstream file(folder + "/scene.toml");
  std::string scene{std::istreambuf_iterator<char>(file), {}};
  const std::size_t first = scene.find("[[object]]"), last = scene.find("\n[", first);
  ASSERT_NE(first, std::string::npos);
  scene.replace(first, last - first, R"([[object]]
model = "white.obj"
position = [1.9, 1.9, 0.06]
[[object]]
model = "dark.obj"
position = [1.775, 1.93, 0.06]
)");
  std::ofstream(folder + "/balls.toml") << scene;
  const nlohmann::json e = picture_error(folder + "/balls.toml --spp 512", folder);
  ASSERT_TRUE(e.is_object()) << e.dump();
  std::printf("balls: %s\n", e.dump().c_str());
  EXPECT_LE(e["object"]["relative_rms"].get<double>(), 0.0225); // measured 0.0180
  EXPECT_LE(e["object"]["truth_standard_error"].get<double>(), 0.018) << "part of that";
}

TEST(Demo, object_in_the_shade_beside_a_sun_patch_is_within_nine_percent) {
  const nlohmann::json e = picture_error("shade");
  ASSERT_TRUE(e.is_object());
  std::printf("shade: %s\n", e.dump().c_str());
  EXPECT_LE(e["object"]["relative_rms"].get<double>(), 0.09); // measured 0.070, the truth's own noise 0.036
  expect_contact_within(e["contact"], 0.03);
}

} // namespace
