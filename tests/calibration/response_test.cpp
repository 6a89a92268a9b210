// Responses from exposure brackets: known curves found again, real ones beside what is published.

#include <cmath>
#include <random>
#include <tuple>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "calibration/fisheye_picture.h"
#include "calibration/response_fit.h"
#include "capture/frames/recording.h"
#include "capture/hdr/bracket.h"
#include "scene/image/image_formats.h"
#include "scene/lens/fall_off.h"
#include "tests/calibration/calibrate_program.h"

namespace daylit::calibration {
namespace {

namespace fs = std::filesystem;

const fs::path kData = fs::path(DAYLIT_SOURCE_DIR) / "../shared/data";

/// A soft scene over four orders of magnitude, exposed for `time`, through the curve `code_of`.
template <class Curve>
CodePicture exposed(double time, int bits, const Curve& code_of, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, bits == 8 ? 0.4 : 20.0);
  CodePicture picture{"picture", RgbImage(320, 240), bits, {}};
  const double largest = (1 << bits) - 1;
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x)
      for (int c = 0; c < 3; ++c) {
        const double radiance = std::pow(10.0, 2.0 * std::sin(0.015 * x + c) + 2.0 * std::sin(0.02 * y));
        const double value = static_cast<double>(code_of(std::min(radiance * time, 1.0)));
        const double code = std::round(largest * value + noise(random));
        picture.code.at(x, y)[c] = static_cast<float>(std::clamp(code, 0.0, largest) / largest);
      }
  return picture;
}

template <class Curve>
std::vector<PlaceCodes> bracket(int bits, const Curve& code_of) {
  std::mt19937 random(4);
  std::vector<PlaceCodes> places;
  for (int k = -5; k <= 5; ++k)
    places.push_back(place_codes(exposed(std::pow(3.0, k), bits, code_of, random), std::pow(3.0, k), {}));
  return places;
}

class Response : public testing::TestWithParam<ResponseMethod> {};

TEST_P(Response, a_known_curve_is_found_within_two_per_cent) {
  const auto fit =
      fit_response(bracket(8, [](double e) { return srgb_encode(static_cast<float>(e)); }), GetParam(), false);
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_LT(fit->residual, 0.03);
  EXPECT_GT(fit->linear_deviation, 0.3);
  for (int c = 0; c < 3; ++c)
    for (int code = 30; code <= 235; ++code) {
      const auto v = static_cast<float>(code) / 255.0f;
      const float found = fit->curve.exposure(v, c) / fit->curve.exposure(0.5f, c);
      EXPECT_NEAR(found, srgb_decode(v) / srgb_decode(0.5f), 0.02f * found) << "code " << code;
    }
}

TEST_P(Response, a_linear_sensor_of_16_bits_is_seen_to_be_linear) {
  const auto fit = fit_response(bracket(16, [](double e) { return e; }), GetParam(), true);
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_LT(fit->linear_deviation, 0.01);
  EXPECT_LT(fit->residual, 0.02);
}

TEST_P(Response, a_pedestal_is_no_light) {
  const double pedestal = 20.0 / 255;
  const auto fit = fit_response(bracket(8, [&](double e) { return pedestal + (1 - pedestal) * e; }), GetParam(), false);
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_NEAR(fit->curve.black(1), pedestal, 2.5 / 255);
  EXPECT_NEAR(fit->curve.exposure(0.75f, 1) / fit->curve.exposure(0.4f, 1), (0.75 - pedestal) / (0.4 - pedestal), 0.03);
}

INSTANTIATE_TEST_SUITE_P(Both, Response, testing::Values(ResponseMethod::debevec, ResponseMethod::robertson));

TEST(ResponseFit, a_wrong_exposure_time_is_named) {
  auto places = bracket(8, [](double e) { return e; });
  places[6].time *= 2.0;
  const auto fit = fit_response(places, ResponseMethod::debevec, false);
  ASSERT_TRUE(fit);
  EXPECT_LT(fit->stated_ratio[6], 0.7);
  for (const double ratio : fit->stated_ratio)
    EXPECT_TRUE(ratio == 0 || ratio >= fit->stated_ratio[6]) << "the wrong one is the farthest";
}

/// Correlation of ln luminance.
double log_correlation(const RgbImage& a, const RgbImage& b) {
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::size_t i = 0; i < a.texels.size(); ++i) {
    const auto ya = static_cast<double>(luminance(a.texels[i])), yb = static_cast<double>(luminance(b.texels[i]));
    if (ya <= 0 || yb <= 0)
      continue;
    const double x = std::log(ya), y = std::log(yb);
    n += 1;
    sa += x;
    sb += y;
    saa += x * x;
    sbb += y * y;
    sab += x * y;
  }
  return (n * sab - sa * sb) / std::sqrt((n * saa - sa * sa) * (n * sbb - sb * sb));
}

/// The church of Debevec and Malik, every `step`th exposure.
void expect_memorial(int step) {
  const fs::path data = kData / "exposures-memorial";
  if (!fs::exists(data))
    GTEST_SKIP() << "the shared photographs are not here";
  std::vector<fs::path> files;
  for (int k = 61; k <= 76; k += step)
    files.push_back(data / ("memorial00" + std::to_string(k) + ".png"));
  const auto list = bracket_files(files, {}, data / "image_list.txt");
  ASSERT_TRUE(list) << list.error().message();
  std::vector<CodePicture> pictures;
  std::vector<PlaceCodes> places;
  for (const BracketFile& f : list->file) {
    pictures.push_back(*read_code_picture(f.path));
    places.push_back(place_codes(pictures.back(), f.time, pixels_of_colour(pictures.back().code, Rgb(0, 0, 255))));
  }
  const auto fit = fit_response(places, ResponseMethod::debevec, false);
  ASSERT_TRUE(fit) << fit.error().message();
  BracketMerger merger(512, 768, {fit->curve, usual_noise(8)});
  for (std::size_t k = 0; k < pictures.size(); ++k)
    ASSERT_TRUE(merger.add(pictures[k].code, list->file[k].time, pixels_of_colour(pictures[k].code, Rgb(0, 0, 255))));
  const auto published = read_hdr_image(data / "memorial.hdr");
  ASSERT_TRUE(published);
  EXPECT_GE(log_correlation(merger.result().radiance, published->radiance), 0.994);
}

TEST(ResponseFit, the_published_radiance_map_of_the_church_is_found) { expect_memorial(1); }
TEST(ResponseFit, eight_exposures_of_the_church_suffice) { expect_memorial(2); }

TEST(CodePictures, a_photograph_tells_its_luminance) {
  EXPECT_FALSE(full_scale_luminance({0.1, 0.0, 100.0}));
  EXPECT_NEAR(*full_scale_luminance({0.05, 5.6, 100.0}), 87 * 5.6 * 5.6 / 5.0, 1e-9);
}

TEST(FallOffOfALens, illuminance_of_a_uniform_sky_is_pi_whatever_fell_off) {
  const LensModel lens = ideal_fisheye(201, 201, 3.14159265358979);
  const FallOff fall_off{{-0.1, 0.01}};
  RgbImage sky(201, 201);
  for (int y = 0; y < 201; ++y)
    for (int x = 0; x < 201; ++x)
      if (const auto d = lens.unproject({x, y}))
        sky.at(x, y) = Rgb(static_cast<float>(fall_off.at(std::acos(d->z))));
  const auto sensitivity = pixel_sensitivity(lens, fall_off, 201, 201);
  ASSERT_TRUE(sensitivity);
  divide(sky, *sensitivity);
  EXPECT_NEAR(illuminance_at(sky, lens), 3.14159265, 0.003);
  EXPECT_FALSE(pixel_sensitivity(lens, FallOff{{-1.0}}, 201, 201)) << "not positive at the edge";
  const fs::path file = test::fresh_folder("falloff") / "fall.txt";
  ASSERT_TRUE(write_fall_off(file, fall_off));
  const auto read = read_fall_off(file);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->coefficient, fall_off.coefficient);
}

/// Three exposures as PNG files; their names, in one line.
std::string png_bracket(const fs::path& folder) {
  std::mt19937 random(8);
  std::string names;
  for (int k = 0; k < 5; ++k) {
    const auto picture = exposed(
        std::pow(4.0, k - 2), 8, [](double e) { return e; }, random);
    const std::string name = "e" + std::to_string(k) + ".png";
    EXPECT_TRUE(write_png(folder / name, view_of(picture.code, false)));
    names += name + " ";
  }
  return names;
}

TEST(ResponseProgram, one_exposure_only_is_said) {
  const fs::path folder = test::fresh_folder("one");
  const std::string names = png_bracket(folder);
  for (const char* command : {"response ", "merge --response linear "}) {
    const auto same = test::calibrate(folder, command + names + "--exposures 1,1,1,1,1 -o out.txt");
    EXPECT_EQ(same.exit_code, 1);
    EXPECT_EQ(same.json.value("verdict", ""), "repeat");
    EXPECT_TRUE(test::says(same, "one exposure only")) << same.json;
    EXPECT_FALSE(fs::exists(folder / "out.txt"));
    EXPECT_TRUE(test::says(test::calibrate(folder, std::string(command) + "e1.png -o out.txt"), "one exposure only"));
    EXPECT_TRUE(
        test::says(test::calibrate(folder, std::string(command) + "e1.png e1.png e1.png --exposures 1,2,4 -o out.txt"),
                   "all pictures are alike although their times differ"));
  }
}

TEST(ResponseProgram, a_bracket_that_is_white_throughout_is_said) {
  const fs::path folder = test::fresh_folder("white");
  std::mt19937 random(8);
  for (const int k : {2, 8}) {
    const auto picture = exposed(
        1e3 * k, 8, [](double e) { return e; }, random);
    EXPECT_TRUE(write_png(folder / fmt::format("{}.png", k), view_of(picture.code, false)));
  }
  const auto white = test::calibrate(folder, "response 2.png 8.png --exposures 2,8 -o out.txt");
  EXPECT_EQ(white.exit_code, 1);
  EXPECT_TRUE(test::says(white, "over-exposed: ")) << white.json;
}

TEST(MergeProgram, a_bracket_that_is_dark_throughout_is_said) {
  const fs::path folder = test::fresh_folder("dark");
  std::mt19937 random(8);
  for (const int k : {2, 8}) {
    const auto picture = exposed(
        1e-6 * k, 8, [](double e) { return e; }, random);
    EXPECT_TRUE(write_png(folder / fmt::format("{}.png", k), view_of(picture.code, false)));
  }
  const auto dark = test::calibrate(folder, "merge 2.png 8.png --response linear --exposures 2,8 -o out.exr");
  EXPECT_EQ(dark.json.value("verdict", ""), "repeat");
  EXPECT_TRUE(test::says(dark, "under-exposed")) << dark.json;
  EXPECT_FALSE(
      test::says(test::calibrate(folder, "merge " + png_bracket(folder) +
                                             "--response linear --exposures 0.0625,0.25,1,4,16 -o out.exr --force"),
                 "under-exposed"));
}

TEST(ResponseProgram, equal_large_steps_before_a_curve_are_said) {
  const fs::path folder = test::fresh_folder("steps");
  std::mt19937 random(8);
  for (const auto& [name, exposures, repeats] :
       {std::tuple{"even", std::vector{0.0625, 0.25, 1.0, 4.0, 16.0}, true},
        {"uneven", std::vector{0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0}, false}}) {
    std::string names, times;
    for (const double e : exposures) {
      const auto picture = exposed(
          e, 8, [](double v) { return std::log1p(40 * v) / std::log(41.0); }, random);
      names += fmt::format("{}{}.png ", name, e);
      times += fmt::format("{}{}", times.empty() ? "" : ",", e);
      EXPECT_TRUE(write_png(folder / fmt::format("{}{}.png", name, e), view_of(picture.code, false)));
    }
    const auto done = test::calibrate(folder, "response " + names + "--exposures " + times + " -o out.txt --force");
    EXPECT_EQ(test::says(done, "each exposure is 4 times the one before"), repeats) << done.json["why"];
  }
}

TEST(ResponseProgram, a_time_that_is_15_per_cent_wrong_is_named) {
  const fs::path folder = test::fresh_folder("wrong-time");
  std::mt19937 random(8);
  std::string names;
  for (const double e : {0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0}) {
    const auto picture = exposed(
        e, 8, [](double v) { return std::pow(v, 1 / 2.2); }, random);
    names += fmt::format("e{}.png ", e);
    EXPECT_TRUE(write_png(folder / fmt::format("e{}.png", e), view_of(picture.code, false)));
  }
  const auto right =
      test::calibrate(folder, "response " + names + "--exposures 0.05,0.1,0.2,0.5,1,2,5,10 -o right.txt");
  EXPECT_FALSE(test::says(right, "as long as stated")) << right.json;
  const auto wrong =
      test::calibrate(folder, "response " + names + "--exposures 0.05,0.1,0.2,0.575,1,2,5,10 -o wrong.txt");
  EXPECT_TRUE(test::says(wrong, "e0.5.png was exposed 0.87 times as long as stated")) << wrong.json;
}

TEST(ResponseProgram, what_is_said_twice_or_not_said_of_pictures_is_refused) {
  const fs::path folder = test::fresh_folder("unsaid");
  const std::string names = png_bracket(folder);
  std::ofstream(folder / "list.txt") << "e0.png 0.0625\ne1.png 0.25\ne2.png 1\ne3.png 4\ne4.png 16\ne0.png 0.5\n";
  EXPECT_EQ(test::calibrate(folder, "response " + names + "--exposure-list list.txt -o out.txt").exit_code, 1);
  RgbImage mosaic(64, 48, Rgb(0.2f));
  for (int y = 0; y < 48; y += 2)
    for (int x = 0; x < 64; x += 2)
      mosaic.at(x, y) = Rgb(0.1f);
  const CodePicture raw{"raw.png", mosaic, 8, {}}, even{"even.png", RgbImage(64, 48, Rgb(0.2f)), 8, {}};
  EXPECT_FALSE(check_mosaic_given(raw));
  EXPECT_TRUE(check_mosaic_given(even));
}

TEST(ResponseProgram, a_bracket_becomes_a_response_and_a_picture) {
  const fs::path folder = test::fresh_folder("bracket");
  const std::string names = png_bracket(folder), times = "--exposures 0.0625,0.25,1,4,16 --report r ";
  const auto response = test::calibrate(folder, "response " + names + times + "-o response.txt");
  EXPECT_EQ(response.exit_code, 0);
  EXPECT_EQ(response.json.value("verdict", ""), "pass") << response.json;
  EXPECT_TRUE(response.json.value("linear", false));
  const auto merged = test::calibrate(folder, "merge " + names + times + "--response response.txt -o out.exr");
  EXPECT_EQ(merged.exit_code, 0);
  EXPECT_EQ(merged.json["exposures"].size(), 5u);
  const auto picture = read_hdr_image(folder / "out.exr");
  ASSERT_TRUE(picture);
  EXPECT_NEAR(picture->radiance.at(0, 0).r, 1.0f, 0.05f);
  EXPECT_TRUE(fs::exists(folder / "r/report.html"));
  const auto wrong = test::calibrate(folder, "merge " + names + "-o out.exr");
  EXPECT_EQ(wrong.exit_code, 1) << "no exposure times";
}

TEST(MergeProgram, a_picture_without_a_reading_is_relative_and_codes_are_no_light) {
  const fs::path folder = test::fresh_folder("unit");
  const std::string merge = "merge " + png_bracket(folder) + "--exposures 0.0625,0.25,1,4,16 -o out.exr ";
  EXPECT_TRUE(write_lens(folder / "lens.yaml", ideal_fisheye(320, 240, 3.0)));
  EXPECT_EQ(test::calibrate(folder, merge).exit_code, 1) << "8 bits, and no response";
  EXPECT_FALSE(fs::exists(folder / "out.exr"));
  const auto relative = test::calibrate(folder, merge + "--response linear --lens lens.yaml");
  EXPECT_EQ(relative.json.value("unit", ""), "relative") << relative.json;
  EXPECT_FALSE(relative.json.contains("illuminance_lx"));
  const auto absolute = test::calibrate(folder, merge + "--response linear --lens lens.yaml --illuminance 1000");
  EXPECT_EQ(absolute.json.value("unit", ""), "cd/m2");
  EXPECT_NEAR(absolute.json.value("illuminance_lx", 0.0), 1000.0, 1e-6);
  EXPECT_EQ(
      test::calibrate(folder, merge + "--response linear --lens lens.yaml --illuminance 1000 --scale 3").exit_code, 2);
}

/// A camera that cycles through three exposures, each setting a frame late, before a scene with a lamp.
TEST(MergeProgram, exposures_of_a_recording_are_learned_and_its_settings_were_late) {
  const fs::path folder = test::fresh_folder("recording");
  auto writer = RecordingWriter::create(folder / "tape");
  ASSERT_TRUE(writer);
  const double times[] = {10, 640, 40960};
  for (std::uint64_t k = 0; k < 12; ++k) {
    CameraFrame frame{64, 48, {Mosaic::mono, 16}, {}, k, static_cast<std::int64_t>(k) * 1000, times[k % 3]};
    const double exposed = times[(k + 2) % 3];
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x) {
        const double radiance = (x > 30 && x < 34 && y > 20 && y < 24 ? 0.06 : 2e-6 * (1 + x));
        const auto code = static_cast<std::uint16_t>(std::min(65535.0, std::round(65535 * radiance * exposed)));
        frame.bytes.push_back(static_cast<std::uint8_t>(code & 255));
        frame.bytes.push_back(static_cast<std::uint8_t>(code >> 8));
      }
    ASSERT_TRUE(writer->add(frame));
  }
  const auto merged = test::calibrate(folder, "merge tape -o out.exr --report r");
  EXPECT_EQ(merged.exit_code, 0) << merged.json;
  EXPECT_EQ(merged.json.value("verdict", ""), "pass") << merged.json;
  for (const auto& frame : merged.json["frames"]) {
    const double exposed = times[(frame["id"].get<std::size_t>() + 2) % 3];
    EXPECT_TRUE(frame["id"] < 6 || frame["exposed_us"] == exposed) << frame;
  }
  const auto picture = read_hdr_image(folder / "out.exr");
  ASSERT_TRUE(picture);
  EXPECT_NEAR(picture->radiance.at(32, 22).g, 0.06f, 0.001f);
  EXPECT_NEAR(picture->radiance.at(50, 40).g, 2e-6f * 51, 1e-6f);
  const auto every = test::calibrate(folder, "merge tape -o all.exr --every");
  EXPECT_EQ(every.exit_code, 0);
  EXPECT_TRUE(fs::exists(folder / "all-00010.exr"));
}

} // namespace
} // namespace daylit::calibration
