// Depth pictures on disk: what comes back, what counts as a hole, what is refused.

#include "scene/image/depth_picture.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>

#include "scene/image/image_formats.h"

namespace daylit {
namespace {

class DepthFile : public testing::Test {
protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "daylit-depth-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string refusal(const std::filesystem::path& path) const {
    const auto depth = read_depth_picture(path);
    return depth ? "" : depth.error().message();
  }
  std::filesystem::path folder_;
};

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST_F(DepthFile, a_png_comes_back_to_the_millimetre_and_an_exr_as_it_was) {
  const DepthPicture depth{3, 2, {0.0f, 0.4567f, 1.0f, 2.2222f, 65.535f, 70.0f}};
  ASSERT_TRUE(write_depth_picture(folder_ / "d.png", depth));
  ASSERT_TRUE(write_depth_picture(folder_ / "d.exr", depth));
  const auto png = read_depth_picture(folder_ / "d.png"), exr = read_depth_picture(folder_ / "d.exr");
  ASSERT_TRUE(png && exr);
  EXPECT_EQ(*exr, depth);
  EXPECT_EQ(png->width, 3);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(png->z_m[i], depth.z_m[i], 0.000501f) << i;
  EXPECT_EQ(png->z_m[5], 0.0f) << "70 m do not fit into 16 bits of millimetres: a hole, not another depth";
}

TEST_F(DepthFile, the_unit_of_a_png_is_the_one_that_is_given) {
  ASSERT_TRUE(write_depth_picture(folder_ / "d.png", {2, 1, {1.0f, 2.0f}}));
  const auto depth = read_depth_picture(folder_ / "d.png", 0.0002); // numbers 1000 and 2000
  ASSERT_TRUE(depth);
  EXPECT_FLOAT_EQ(depth->at(0, 0), 0.2f);
  EXPECT_FLOAT_EQ(depth->at(1, 0), 0.4f);
}

TEST_F(DepthFile, what_is_not_above_zero_or_not_finite_is_a_hole) {
  const float inf = std::numeric_limits<float>::infinity();
  RgbImage image(5, 1);
  const float values[] = {-1.0f, 0.0f, std::nanf(""), inf, 1.5f};
  for (int x = 0; x < 5; ++x)
    image.at(x, 0) = Rgb(values[x]);
  ASSERT_TRUE(write_exr(folder_ / "d.exr", image));
  const auto depth = read_depth_picture(folder_ / "d.exr");
  ASSERT_TRUE(depth) << depth.error().message();
  EXPECT_EQ(depth->z_m, (std::vector<float>{0.0f, 0.0f, 0.0f, 0.0f, 1.5f}));
}

TEST_F(DepthFile, pictures_of_another_kind_are_refused_by_name) {
  EXPECT_TRUE(holds(refusal(folder_ / "none.png"), "none.png"));
  ASSERT_TRUE(write_png(folder_ / "colour.png", Rgb8Image{2, 1, {1, 2, 3, 4, 5, 6}}));
  EXPECT_TRUE(holds(refusal(folder_ / "colour.png"), "a colour PNG of 8 bits where one of 16 bits, grey, is needed"))
      << refusal(folder_ / "colour.png");
  // 1 x 1, grey, 8 bits: written by hand.
  const unsigned char grey[] = {0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48,
                                0x44, 0x52, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x08, 0x00, 0x00, 0x00,
                                0x00, 0x3a, 0x7e, 0x9b, 0x55, 0x00, 0x00, 0x00, 0x0a, 0x49, 0x44, 0x41, 0x54, 0x78,
                                0x9c, 0x63, 0xa8, 0x07, 0x00, 0x00, 0x81, 0x00, 0x80, 0xd3, 0x94, 0x53, 0x4a, 0x00,
                                0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
  std::ofstream(folder_ / "grey.png", std::ios::binary)
      .write(reinterpret_cast<const char*>(grey), static_cast<std::streamsize>(sizeof(grey)));
  EXPECT_TRUE(holds(refusal(folder_ / "grey.png"), "a grey PNG of 8 bits")) << refusal(folder_ / "grey.png");
  std::ofstream(folder_ / "text.png") << "depth";
  EXPECT_TRUE(holds(refusal(folder_ / "text.png"), "neither a PNG nor an OpenEXR file"));
}

TEST_F(DepthFile, a_damaged_file_is_refused) {
  DepthPicture depth{64, 64, std::vector<float>(64 * 64)};
  for (std::size_t i = 0; i < depth.z_m.size(); ++i)
    depth.z_m[i] = 1.0f + 0.001f * static_cast<float>(i * i % 977);
  for (const char* name : {"d.png", "d.exr"}) {
    ASSERT_TRUE(write_depth_picture(folder_ / name, depth));
    std::filesystem::resize_file(folder_ / name, std::filesystem::file_size(folder_ / name) / 2);
    EXPECT_FALSE(read_depth_picture(folder_ / name)) << name;
  }
}

TEST_F(DepthFile, its_size_is_the_photographs_or_a_whole_fraction_of_it) {
  const auto fits = [](int width, int height) {
    return bool(check_depth_size({width, height, {}}, 512, 496, "depth.png"));
  };
  EXPECT_TRUE(fits(512, 496));
  EXPECT_TRUE(fits(256, 248));
  EXPECT_TRUE(fits(32, 31));
  EXPECT_FALSE(fits(512, 248));
  EXPECT_FALSE(fits(640, 480));
  EXPECT_FALSE(fits(1024, 992));
  const auto refused = check_depth_size({640, 480, {}}, 512, 496, "depth.png");
  EXPECT_TRUE(holds(refused.error().message(), "depth.png: the depth picture is 640 x 480, the photograph 512 x 496"));
}

} // namespace
} // namespace daylit
