// The whole program at default settings, as a user runs it: error against the reference rooms and cost of the run.

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <tuple>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "scene/sky/direct_sky.h"
#include "scene/sky/sky_description.h"
#include "scene/volume/volume_file.h"
#include "tests/simulate/truth_cases.h"

namespace daylit {
namespace {

struct Run {
  BasisVolume volume;
  double cpu_seconds = 0;
  std::shared_ptr<const std::filesystem::path> file; ///< removed with the last run that refers to it
};

std::shared_ptr<const std::filesystem::path> temporary(const std::string& path) {
  return {new std::filesystem::path(path), [](const std::filesystem::path* p) {
            std::filesystem::remove(*p);
            delete p;
          }};
}

/// Bakes one of the reference rooms with the installed program; empty grid: defaults.
Result<Run> bake_with_program(const std::string& scene, const std::string& grid) {
  const std::string room = (test::kTruthFolder / (scene == "S1" ? "s1_daylit_cornell.obj" : "s3_furnace.obj")).string();
  const std::string output = ::testing::TempDir() + "acceptance_" + scene + std::to_string(::getpid()) + ".volume";
  rusage before{}, after{};
  ::getrusage(RUSAGE_CHILDREN, &before);
  std::string command = DAYLIT_BINARY_DIR "/bin/daylit-precompute '" + room + "' -o '" + output + "' --quiet";
  if (!grid.empty())
    command += " --grid " + grid;
  if (std::system(command.c_str()) != 0)
    return Error{ErrorCode::io, "daylit-precompute failed", scene, ""};
  ::getrusage(RUSAGE_CHILDREN, &after);
  auto file = temporary(output);
  auto volume = read_volume(output);
  if (!volume)
    return volume.error();
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return Run{std::move(*volume),
             seconds(after.ru_utime) + seconds(after.ru_stime) - seconds(before.ru_utime) - seconds(before.ru_stime),
             std::move(file)};
}

/// nrms of the irradiance at the 33 reference points; NaN where a point has no light field.
struct IrradianceError {
  double indirect = 0, total = 0;
};

IrradianceError irradiance_error(const BasisVolume& volume, const std::string& scene, const std::string& sky_name) {
  const auto picture = test::truth_sky(sky_name);
  const auto sampler = LightFieldSampler::make(volume);
  const auto rays = RayScene::build(volume.room);
  if (!picture || !sampler || !rays)
    return {std::nan(""), std::nan("")};
  const Sky sky(*picture);
  const DirectSky direct(volume.room, volume.apertures, *rays, sky);
  const LightField field = combine(volume, region_radiance(sky, volume.partition), ShOrder::fourth);
  const auto error = [&](const std::string& kind, bool with_direct) {
    const auto rows = test::truth_rows(scene, sky_name, kind);
    EXPECT_EQ(rows.size(), 198u);
    const auto ours = [&](std::size_t i) {
      const auto coefficients = sampler->sample_all(field, rows[i].receiver.position);
      EXPECT_TRUE(coefficients) << "no light field at reference point " << i / 6;
      if (!coefficients)
        return Rgb(std::nanf(""));
      const Rgb indirect = irradiance(*coefficients, glm::vec3(rows[i].receiver.normal));
      return with_direct ? indirect + direct.irradiance(rows[i].receiver.position, rows[i].receiver.normal) : indirect;
    };
    return test::nrms(rows.size(), ours, [&](std::size_t i) { return rows[i].value; });
  };
  return {error("indirect", false), error("total", true)};
}

std::vector<double> numbers_printed_by(const std::string& command) {
  std::vector<double> numbers;
  FILE* pipe = ::popen(command.c_str(), "r");
  for (double x = 0; pipe && std::fscanf(pipe, "%lf", &x) == 1;)
    numbers.push_back(x);
  EXPECT_TRUE(pipe && ::pclose(pipe) == 0) << command;
  return numbers;
}

/// The skies of the reference, in words.
const char* sky_in_words(const std::string& name) {
  return name == "E1" ? "[sky]\nmodel = \"uniform\"\nzenith_radiance = 1\nground_radiance = 1\n"
                      : "[sky]\nmodel = \"overcast\"\nzenith_radiance = 10\nground_radiance = 0.6\n";
}

struct PrintedError {
  double irradiance = 0, illuminance = 0; ///< nrms
};

/// What daylit-probe prints with --total, as r g b and as lx, against the total rows.
PrintedError error_of_program(const std::filesystem::path& volume, const std::string& scene,
                              const std::string& sky_name) {
  const std::string stem = ::testing::TempDir() + "probe_total_" + std::to_string(::getpid());
  std::ofstream(stem + ".toml") << sky_in_words(sky_name);
  const auto rows = test::truth_rows(scene, sky_name, "total");
  std::ofstream points(stem + ".txt");
  for (const test::TruthRow& row : rows)
    points << fmt::format("{} {} {} {} {} {}\n", row.receiver.position.x, row.receiver.position.y,
                          row.receiver.position.z, row.receiver.normal.x, row.receiver.normal.y, row.receiver.normal.z);
  points.close();
  const std::string command = fmt::format("{0}/bin/daylit-probe '{2}' --sky '{1}.toml' --quiet --total < '{1}.txt'",
                                          DAYLIT_BINARY_DIR, stem, volume.string());
  const std::vector<double> rgb = numbers_printed_by(command), lx = numbers_printed_by(command + " --lux");
  EXPECT_EQ(rgb.size(), 3 * rows.size());
  EXPECT_EQ(lx.size(), rows.size());
  for (const char* extension : {".toml", ".txt"})
    std::filesystem::remove(stem + extension);
  if (rgb.size() != 3 * rows.size() || lx.size() != rows.size())
    return {std::nan(""), std::nan("")};
  const auto light = [&](std::size_t i) { return Rgb(rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]); };
  const auto grey = [](double x) { return Rgb(static_cast<float>(x)); };
  return {test::nrms(rows.size(), light, [&](std::size_t i) { return rows[i].value; }),
          test::nrms(
              rows.size(), [&](std::size_t i) { return grey(lx[i]); },
              [&](std::size_t i) { return grey(kLumensPerWatt * double(luminance(rows[i].value))); })};
}

TEST(Acceptance, default_bake_is_within_one_and_a_half_percent_and_its_processor_time_is_printed) {
  const auto s1 = bake_with_program("S1", "");
  ASSERT_TRUE(s1) << s1.error().message();
  const IrradianceError s1_e1 = irradiance_error(s1->volume, "S1", "E1"),
                        s1_e2 = irradiance_error(s1->volume, "S1", "E2");
  const auto s3 = bake_with_program("S3", "");
  ASSERT_TRUE(s3) << s3.error().message();
  const IrradianceError s3_e1 = irradiance_error(s3->volume, "S3", "E1");
  const double e1 = s1_e1.indirect, e2 = s1_e2.indirect, e3 = s3_e1.indirect;
  std::printf("indirect irradiance, default settings: S1/E1 %.3f %%, S1/E2 %.3f %%, S3/E1 %.3f %% nrms\n", 100 * e1,
              100 * e2, 100 * e3);
  const double t1 = s1_e1.total, t2 = s1_e2.total, t3 = s3_e1.total;
  std::printf("total irradiance, default settings: S1/E1 %.3f %%, S1/E2 %.3f %%, S3/E1 %.3f %% nrms\n", 100 * t1,
              100 * t2, 100 * t3);
  for (const auto& [run, scene, sky] :
       {std::tuple(&*s1, "S1", "E1"), std::tuple(&*s1, "S1", "E2"), std::tuple(&*s3, "S3", "E1")}) {
    const PrintedError printed = error_of_program(*run->file, scene, sky);
    std::printf("daylit-probe --total, %s/%s: %.3f %%, with --lux %.3f %% nrms\n", scene, sky, 100 * printed.irradiance,
                100 * printed.illuminance);
    EXPECT_LE(printed.irradiance, 0.0065); // measured 0.0043, 0.0037, 0.0052
    EXPECT_LE(printed.illuminance, 0.0065);
  }
  for (const double t : {t1, t2, t3}) // direct light is met much better: it lowers the relative error
    EXPECT_LE(t, 0.0065);             // measured 0.0043, 0.0037, 0.0052
  std::printf("processor time of the whole run: S1 %.2f s, S3 %.2f s\n", s1->cpu_seconds, s3->cpu_seconds);
  EXPECT_LE(e1, 0.015); // measured 0.0116
  EXPECT_LE(e2, 0.013); // measured 0.0096
  EXPECT_LE(e3, 0.010); // measured 0.0076
}

TEST(Acceptance, setting_of_the_paper_is_timed_and_its_error_printed) {
  // 64 regions, about 2,000 facets, 8^3 probes; five minutes in Grosch et al. 2007.
  const auto s1 = bake_with_program("S1", "8,8,8 --regions uniform:64 --patches 2000");
  ASSERT_TRUE(s1) << s1.error().message();
  EXPECT_EQ(s1->volume.probes.size(), 512u);
  std::printf("64 regions, 8^3 probes: S1/E1 %.3f %%, S1/E2 %.3f %% nrms, %.2f s of processor time\n",
              100 * irradiance_error(s1->volume, "S1", "E1").indirect,
              100 * irradiance_error(s1->volume, "S1", "E2").indirect, s1->cpu_seconds);
}

} // namespace
} // namespace daylit
