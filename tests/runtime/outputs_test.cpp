#include "runtime/output/outputs.h"

#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

namespace daylit {
namespace {

class Outputs : public testing::Test {
protected:
  static constexpr int kWidth = 40, kHeight = 30;
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "daylit-outputs-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    output_.png = folder_ / "a.png";
    output_.exr = folder_ / "a.exr";
    output_.mask = folder_ / "mask.exr";
    photo_ = {RgbImage(kWidth, kHeight, Rgb(0.25f)), {}, ResponseCurve::srgb()};
    photo_.original = encode_picture(photo_.response, photo_.linear);
    composite_ = {photo_.linear, std::vector<std::uint8_t>(kWidth * kHeight), std::vector<float>(kWidth * kHeight), 0,
                  0};
    for (int y = 0; y < kHeight; ++y) // an object in the left half
      for (int x = 0; x < kWidth / 2; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * kWidth + x;
        composite_.picture.texels[i] = Rgb(0.75f);
        composite_.touched[i] = 2;
        composite_.coverage[i] = 1.0f;
      }
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
  OutputConfig output_;
  Photograph photo_;
  Composite composite_;
};

TEST_F(Outputs, pictures_have_the_size_that_is_configured) {
  output_.width_px = 4;
  output_.height_px = 3;
  ASSERT_TRUE(check_output_size(output_, kWidth, kHeight));
  ASSERT_TRUE(write_outputs(output_, photo_, composite_));
  const auto png = read_ldr_image(output_.png);
  const auto exr = read_hdr_image(output_.exr), mask = read_hdr_image(output_.mask);
  ASSERT_TRUE(png && exr && mask);
  EXPECT_EQ(png->width, 4);
  EXPECT_EQ(png->height, 3);
  ASSERT_EQ(exr->radiance.texels.size(), 12u);
  ASSERT_EQ(mask->radiance.texels.size(), 12u);
  EXPECT_FLOAT_EQ(exr->radiance.at(1, 2).g, 0.75f);
  EXPECT_FLOAT_EQ(exr->radiance.at(2, 2).g, 0.25f);
  EXPECT_FLOAT_EQ(mask->radiance.at(1, 0).g, 1.0f);
  EXPECT_EQ(png->bytes[3], photo_.response.encode(0.75f, 0));
  EXPECT_EQ(png->bytes[6], photo_.response.encode(0.25f, 0));
}

TEST_F(Outputs, a_pixel_across_the_edge_is_the_mean_in_linear_light) {
  output_.width_px = 1;
  output_.height_px = 1;
  ASSERT_TRUE(write_outputs(output_, photo_, composite_));
  const auto png = read_ldr_image(output_.png);
  const auto exr = read_hdr_image(output_.exr);
  ASSERT_TRUE(png && exr);
  EXPECT_NEAR(exr->radiance.at(0, 0).g, 0.5f, 1e-6f);
  EXPECT_EQ(png->bytes[0], photo_.response.encode(0.5f, 0));
}

TEST_F(Outputs, without_a_size_or_in_its_own_untouched_bytes_stay) {
  photo_.original.bytes[3 * (kWidth - 1)] = 7; // not what the response says of the pixel
  for (const int width : {0, kWidth}) {
    output_.width_px = width;
    output_.height_px = width ? kHeight : 0;
    ASSERT_TRUE(write_outputs(output_, photo_, composite_));
    const auto png = read_ldr_image(output_.png);
    ASSERT_TRUE(png);
    EXPECT_EQ(png->width, kWidth);
    EXPECT_EQ(png->bytes[3 * (kWidth - 1)], 7);
  }
}

TEST_F(Outputs, absurd_sizes_are_refused) {
  for (const auto& [width, height, good] : {std::tuple{0, 0, true},
                                            {20, 15, true},
                                            {160, 120, true},
                                            {7, 5, true},
                                            {164, 123, false},
                                            {40, 40, false},
                                            {400, 30, false},
                                            {80, 62, false}}) {
    output_.width_px = width;
    output_.height_px = height;
    const auto r = check_output_size(output_, kWidth, kHeight);
    EXPECT_EQ(static_cast<bool>(r), good) << width << " x " << height;
    if (!r) {
      EXPECT_EQ(r.error().where, "[output] size");
    }
  }
}

} // namespace
} // namespace daylit
