// Frames of a sky camera made radiance: brackets, responses, and a sun beyond the range.

#include "runtime/input/sky_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>

#include "runtime/input/camera_pictures.h"
#include "scene/image/image_formats.h"
#include "scene/sky/sun_position.h"

namespace daylit {
namespace {

constexpr int kSide = 96;
constexpr float kSun = 90.0f; ///< nine tenths of the range in 10 us

class SkyReaderTest : public testing::Test {
protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "daylit-sky-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    const LensModel lens = ideal_fisheye(kSide, kSide, 3.3);
    ASSERT_TRUE(write_lens(folder_ / "sky.yaml", lens));
    config_.camera.emplace();
    config_.projection = "fisheye";
    config_.lens = folder_ / "sky.yaml";
    config_.ground = {GroundFill::Kind::albedo, 0.2f};
    geometry_ = *SkyGeometry::make(kSide, kSide, FisheyeProjection{lens, 0.0});
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// A gradient and a sun of 2 x 2 pixels.
  static RgbImage sky(float sun) {
    RgbImage radiance(kSide, kSide);
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        radiance.at(x, y) = Rgb(0.5f + 0.01f * static_cast<float>(x), 1.0f, 1.5f);
    for (int k = 0; k < 4; ++k)
      radiance.at(60 + k % 2, 40 + k / 2) += sun;
    return radiance;
  }
  /// 16 bits, 1 = the largest code value in a millisecond, through `code` of the exposure.
  template <class Code>
  static CameraFrame frame(const RgbImage& radiance, int exposure_us, double stated_us, int index, const Code& code) {
    CameraFrame f{radiance.width, radiance.height, {Mosaic::rgb, 16}, {}, std::uint64_t(index)};
    f.time_ns = 1'600'000'000'000'000'000 + std::int64_t(index) * 33'000'000;
    f.exposure_us = stated_us;
    for (const Rgb& t : radiance.texels)
      for (int c = 0; c < 3; ++c) {
        const double v = code(std::clamp(double(t[c]) * 1e-3 * exposure_us, 0.0, 1.0));
        const auto value = static_cast<unsigned>(std::lround(65535 * v));
        f.bytes.push_back(static_cast<std::uint8_t>(value));
        f.bytes.push_back(static_cast<std::uint8_t>(value >> 8));
      }
    return f;
  }
  static double linear(double v) { return v; }
  SkyImage image(RgbImage radiance) const { return *SkyImage::make(std::move(radiance), geometry_, config_.ground); }

  std::filesystem::path folder_;
  SkyConfig config_;
  std::shared_ptr<const SkyGeometry> geometry_;
};

TEST_F(SkyReaderTest, a_bracket_becomes_one_sky_with_each_of_its_shortest_exposures) {
  config_.exposures_us = {640, 10, 40960}; // in any order; one code is 1.5e-5 of the range
  config_.white = 0.01;                    // the sky's radiance in the result is a hundredth
  auto reader = SkyReader::open(config_);
  ASSERT_TRUE(reader) << reader.error().message();
  ASSERT_TRUE(reader->is_bracket());
  const RgbImage radiance = sky(kSun);
  int skies = 0;
  for (int k = 0; k < 15; ++k) {
    const int exposure = config_.exposures_us[static_cast<std::size_t>(std::max(k - 2, 0)) % 3]; // two frames late
    const auto read = reader->read(frame(radiance, exposure, 0.0, k, linear));
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_TRUE(exposure == 10 || !*read) << "frame " << k;
    if (!*read)
      continue;
    ++skies;
    RgbImage expected = radiance;
    for (Rgb& t : expected.texels)
      t *= 0.01f;
    const Rgb truth = horizontal_irradiance(image(expected));
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR((*read)->balance.irradiance[c], truth[c], 0.005f * truth[c]);
    EXPECT_NEAR((*read)->sky.image().at(60, 40).g, expected.at(60, 40).g, 0.005f);
    EXPECT_EQ((*read)->balance.over_range, 0u);
  }
  EXPECT_GE(skies, 2);
}

TEST_F(SkyReaderTest, the_fall_off_of_the_lens_is_divided_out_of_a_camera_s_frames_and_of_a_picture) {
  const FallOff fall_off{{-0.12, 0.01}};
  ASSERT_TRUE(write_fall_off(folder_ / "fall.txt", fall_off));
  config_.fall_off = folder_ / "fall.txt";
  const RgbImage radiance = sky(0.0f);
  RgbImage fallen = radiance;
  const auto sensitivity = pixel_sensitivity(*read_lens(config_.lens), fall_off, kSide, kSide);
  ASSERT_TRUE(sensitivity);
  EXPECT_LT(std::ranges::min(*sensitivity), 0.8f);
  for (std::size_t i = 0; i < fallen.texels.size(); ++i)
    fallen.texels[i] *= (*sensitivity)[i];
  auto reader = SkyReader::open(config_);
  ASSERT_TRUE(reader) << reader.error().message();
  const auto live = reader->read(frame(fallen, 100, 100.0, 0, linear));
  ASSERT_TRUE(live && *live);
  config_.image = folder_ / "sky.exr";
  ASSERT_TRUE(write_exr(config_.image, fallen));
  const auto file = read_sky(config_);
  ASSERT_TRUE(file) << file.error().message();
  for (const auto& [x, y] : {std::pair{48, 48}, {20, 50}, {48, 4}})
    for (const SkyImage* found : {&(*live)->sky, &*file})
      EXPECT_NEAR(found->image().at(x, y).g, radiance.at(x, y).g, 0.001f * radiance.at(x, y).g) << x << " " << y;
  ASSERT_TRUE(write_fall_off(config_.fall_off, FallOff{{-1.0}})); // not positive at the edge
  EXPECT_FALSE(read_sky(config_));
  config_.fall_off = folder_ / "none.txt";
  EXPECT_FALSE(read_sky(config_));
  EXPECT_FALSE(SkyReader::open(config_));
}

TEST_F(SkyReaderTest, exposures_that_all_look_alike_are_said) {
  config_.exposures_us = {10, 100};
  auto reader = SkyReader::open(config_);
  ASSERT_TRUE(reader);
  const RgbImage black(kSide, kSide);
  bool said = false;
  for (int k = 0; k < 40 && !said; ++k) {
    const auto read = reader->read(frame(black, config_.exposures_us[std::size_t(k) % 2], 0.0, k, linear));
    said = !read && read.error().where == "[sky] exposures_us";
    EXPECT_TRUE(said || (read && !*read));
  }
  EXPECT_TRUE(said);
}

TEST_F(SkyReaderTest, a_logarithmic_camera_goes_through_its_response) {
  // Code = 1 + log10(exposure) / 4, four decades; black below.
  std::ofstream file(folder_ / "log.txt");
  for (int code = 0; code < 256; ++code)
    file << (code == 0 ? 0.0 : std::pow(10.0, 4 * (code / 255.0 - 1))) << "\n";
  file.close();
  config_.response = (folder_ / "log.txt").string();
  auto reader = SkyReader::open(config_);
  ASSERT_TRUE(reader) << reader.error().message();
  const RgbImage radiance = sky(50.0f);
  const auto read = reader->read(frame(radiance, 16, 16.0, 0, [](double v) { return 1 + std::log10(v) / 4; }));
  ASSERT_TRUE(read && *read);
  for (const auto& [x, y] : {std::pair{60, 40}, {20, 50}, {70, 48}})
    EXPECT_NEAR((*read)->sky.image().at(x, y).g, radiance.at(x, y).g, 0.002f * radiance.at(x, y).g);
}

TEST_F(SkyReaderTest, a_sun_beyond_the_range_is_counted_and_restored_by_a_reading) {
  const RgbImage radiance = sky(20'000.0f);
  const Rgb truth = horizontal_irradiance(image(radiance));
  const CameraFrame clipped = frame(radiance, 100, 100.0, 0, linear); // holds 10
  const auto balance = [&]() -> SkyBalance {
    auto reader = SkyReader::open(config_);
    const auto read = reader->read(clipped);
    EXPECT_TRUE(read && *read);
    return (*read)->balance;
  };
  const SkyBalance lost = balance();
  EXPECT_EQ(lost.over_range, 4u);
  EXPECT_TRUE(lost.sun_lost && !lost.sun_restored);
  EXPECT_LT(lost.irradiance.g, 0.9f * truth.g);
  config_.illuminance = double(luminance(truth));
  const SkyBalance restored = balance();
  EXPECT_TRUE(restored.sun_restored);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(restored.irradiance[c], truth[c], 0.01f * truth[c]);
  config_.illuminance.reset();
  config_.illuminance_file = folder_ / "meter";
  EXPECT_FALSE(balance().sun_restored) << "there is no reading";
  EXPECT_NE(balance().no_reading.find("meter"), std::string::npos) << balance().no_reading;
  std::ofstream(config_.illuminance_file) << "lux 5\n";
  EXPECT_TRUE(balance().no_reading.ends_with("no number in its first line")) << balance().no_reading;
  std::ofstream(config_.illuminance_file) << luminance(truth) << "\n";
  EXPECT_NEAR(balance().irradiance.g, truth.g, 0.01f * truth.g);
  config_.place = SkyPlace{-45.0, -170.0}; // night there
  EXPECT_FALSE(balance().sun_lost) << "what is over range is not the sun";
  EXPECT_EQ(balance().unexplained, 4u);
}

TEST_F(SkyReaderTest, a_sky_that_is_over_range_everywhere_has_no_upper_bound) {
  const CameraFrame white = frame(sky(20'000.0f), 100'000, 100'000.0, 0, linear);             // holds 0.01
  for (const auto& place : {std::optional<SkyPlace>(), std::optional(SkyPlace{51.5, 0.0})}) { // the sun is up there
    config_.place = place;
    auto reader = SkyReader::open(config_);
    const auto read = reader->read(white);
    ASSERT_TRUE(read && *read);
    const SkyBalance& balance = (*read)->balance;
    EXPECT_EQ(balance.over_range, std::uint64_t{kSide} * kSide);
    EXPECT_EQ(balance.sun_lost, place.has_value());
    EXPECT_GT(balance.unexplained, std::uint64_t{kSide} * kSide * 99 / 100);
    EXPECT_FALSE(balance.irradiance_at_most());
  }
}

TEST_F(SkyReaderTest, place_and_time_put_the_sun_where_it_stands) {
  // 2020-09-13 12:26:40 UTC in Greenwich; the camera is half a degree off.
  const glm::dvec3 sun = sun_position({51.5, 0.0, 0.0}, {2020, 9, 13, 12.0 + 26.0 / 60 + 40.0 / 3600}).direction;
  const auto at = geometry_->pixel(sun);
  ASSERT_TRUE(at);
  RgbImage radiance(kSide, kSide, Rgb(1.0f));
  radiance.at(static_cast<int>(std::lround(at->x)), static_cast<int>(std::lround(at->y))) = Rgb(1e5f);
  config_.place = SkyPlace{51.5, 0.0};
  config_.illuminance = 100.0;
  auto reader = SkyReader::open(config_);
  const auto read = reader->read(frame(radiance, 100, 100.0, 0, linear));
  ASSERT_TRUE(read && *read);
  EXPECT_TRUE((*read)->balance.sun_restored);
  EXPECT_NEAR(luminance((*read)->balance.irradiance), 100.0f, 0.1f);
}

TEST(PhotographReader, more_than_8_bits_go_through_the_response_too) {
  CameraFrame frame{3, 1, {Mosaic::mono, 12}, {0x00, 0x08, 0xff, 0x0f, 0x00, 0x00}};
  const auto photo = PhotographReader::open("srgb")->read(frame);
  ASSERT_TRUE(photo) << photo.error().message();
  ASSERT_TRUE(photo->is_hdr());
  EXPECT_NEAR(photo->linear.at(0, 0).g, srgb_decode(2048.0f / 4095), 1e-4f);
  EXPECT_EQ(photo->linear.at(1, 0).g, 1.0f);
  EXPECT_EQ(photo->linear.at(2, 0).g, 0.0f);
}

} // namespace
} // namespace daylit
