#include "scene/image/image_formats.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "scene/core/atomic_file.h"
#include "scene/core/read_file.h"
#include "scene/sky/sky_image.h"

namespace daylit {
namespace {

using Bytes = std::vector<std::uint8_t>;

class ImageFormats : public testing::Test {
protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "daylit-images-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

RgbImage hdr_noise(int width, int height) {
  RgbImage image(width, height);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> exponent(-10, 16);
  for (Rgb& t : image.texels)
    t = Rgb(std::exp2(exponent(random)), std::exp2(exponent(random)), std::exp2(exponent(random)));
  return image;
}

Bytes ascii(const std::string& text) { return Bytes(text.begin(), text.end()); }

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Bytes rgbe_header(const std::string& variables, const std::string& resolution) {
  return ascii("#?RADIANCE\n" + variables + "FORMAT=32-bit_rle_rgbe\n\n" + resolution + "\n");
}

/// (m + 1/2) 2^(e - 136)
float rgbe(int mantissa, int exponent) { return float(std::ldexp(mantissa + 0.5, exponent - 136)); }

/// Damages a file in many ways; every read must give an image or an Error.
template <class Read>
void expect_survives_damage(const Bytes& good, const Read& read, bool detects_truncation = true) {
  for (std::size_t keep = 0; keep < good.size(); keep += 1 + good.size() / 97) {
    const auto r = read(Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(keep)));
    if (detects_truncation && keep < good.size() - 64) {
      EXPECT_FALSE(r) << "accepted the first " << keep << " of " << good.size() << " bytes";
    }
    if (!r) {
      EXPECT_FALSE(r.error().what.empty());
      EXPECT_FALSE(r.error().hint.empty());
    }
  }
  std::mt19937 random(11);
  for (int i = 0; i < 400; ++i) {
    Bytes bad = good;
    const std::size_t reach = i % 2 ? bad.size() : std::min<std::size_t>(bad.size(), 400);
    for (int k = 0; k < 1 + i % 5; ++k)
      bad[random() % reach] ^= static_cast<std::uint8_t>(1u << (random() % 8));
    (void)read(bad);
  }
}

TEST_F(ImageFormats, exr_round_trip_is_exact) {
  const RgbImage image = hdr_noise(37, 21);
  ASSERT_TRUE(write_exr(folder_ / "a.exr", image, {{"daylit:unit", "cd/m2"}}));
  const auto back = read_hdr_image(folder_ / "a.exr");
  ASSERT_TRUE(back) << back.error().message();
  ASSERT_EQ(back->radiance.width, 37);
  EXPECT_EQ(back->radiance.texels, image.texels);
  EXPECT_EQ(back->attributes.at("daylit:unit"), "cd/m2");
}

TEST_F(ImageFormats, damaged_exr_never_crashes) {
  ASSERT_TRUE(write_exr(folder_ / "a.exr", hdr_noise(40, 30)));
  const Bytes good = *read_whole_file(folder_ / "a.exr");
  expect_survives_damage(good, [](const Bytes& b) { return read_hdr_image(b, "bad.exr"); });
}

TEST_F(ImageFormats, exr_that_claims_gigabytes_is_refused_before_allocation) {
  ASSERT_TRUE(write_exr(folder_ / "a.exr", RgbImage(8, 8)));
  const Bytes good = *read_whole_file(folder_ / "a.exr");
  const auto set_int = [](Bytes& b, std::size_t at, std::uint32_t v) {
    for (std::size_t i = 0; i < 4; ++i)
      b[at + i] = static_cast<std::uint8_t>(v >> (8 * i));
  };
  const auto value_of = [&](const std::string& name) {
    const std::string text(good.begin(), good.end());
    return text.find(name) + name.size() + 1 + std::string("box2i").size() + 1 + 4;
  };
  Bytes huge = good;
  for (const char* window : {"dataWindow", "displayWindow"}) {
    set_int(huge, value_of(window) + 8, 20000);
    set_int(huge, value_of(window) + 12, 12000);
  }
  const auto claimed = read_hdr_image(huge, "huge.exr");
  ASSERT_FALSE(claimed);
  EXPECT_NE(claimed.error().what.find("20001 x 12001"), std::string::npos) << claimed.error().what;
  Bytes long_attribute = good;
  set_int(long_attribute, value_of("dataWindow") - 4, 0x7fffffff);
  EXPECT_FALSE(read_hdr_image(long_attribute, "long.exr"));
  Bytes cropped = good;
  set_int(cropped, value_of("dataWindow") + 8, 6);
  EXPECT_FALSE(read_hdr_image(cropped, "cropped.exr"));
}

TEST(RadianceHdr, flat_pixels_are_read_with_the_half_step_of_ward) {
  const auto image = read_hdr_image(rgbe_header("", "-Y 1 +X 2") + Bytes{128, 64, 32, 129, 9, 9, 9, 0}, "a.hdr");
  ASSERT_TRUE(image) << image.error().message();
  EXPECT_EQ(image->radiance.at(0, 0), Rgb(rgbe(128, 129), rgbe(64, 129), rgbe(32, 129)));
  EXPECT_EQ(image->radiance.at(1, 0), Rgb(0.0f));
}

TEST(RadianceHdr, exposure_and_colour_correction_are_divided_out) {
  const auto image =
      read_hdr_image(rgbe_header("EXPOSURE=2\nEXPOSURE= 4.0\nCOLORCORR=1 2 4\nSOFTWARE=test\n", "-Y 1 +X 1") +
                         Bytes{128, 128, 128, 129},
                     "a.hdr");
  ASSERT_TRUE(image) << image.error().message();
  const float v = rgbe(128, 129);
  EXPECT_EQ(image->radiance.at(0, 0), Rgb(v / 8, v / 16, v / 32));
  EXPECT_EQ(image->attributes.at("SOFTWARE"), "test");
  EXPECT_FALSE(read_hdr_image(rgbe_header("EXPOSURE=x\n", "-Y 1 +X 1") + Bytes{1, 2, 3, 128}, "a.hdr"));
}

TEST(RadianceHdr, an_exposure_of_zero_is_taken_as_one_with_a_note) {
  const Bytes pixel{128, 64, 32, 129};
  const auto unset = read_hdr_image(rgbe_header("EXPOSURE=0.0\nEXPOSURE=2\n", "-Y 1 +X 1") + pixel, "a.hdr");
  const auto twice = read_hdr_image(rgbe_header("EXPOSURE=2\n", "-Y 1 +X 1") + pixel, "b.hdr");
  ASSERT_TRUE(unset && twice);
  EXPECT_EQ(unset->radiance.texels, twice->radiance.texels);
  ASSERT_EQ(unset->notes.size(), 1u);
  EXPECT_NE(unset->notes[0].find("a.hdr: EXPOSURE=0"), std::string::npos);
  EXPECT_TRUE(twice->notes.empty());
  EXPECT_FALSE(read_hdr_image(rgbe_header("EXPOSURE=-1\n", "-Y 1 +X 1") + pixel, "c.hdr"));
}

TEST(RadianceHdr, run_lengths_old_and_new_give_the_same_image) {
  const int width = 20;
  Bytes flat = rgbe_header("", "-Y 1 +X 20"), old_runs = flat, new_runs = flat;
  for (int x = 0; x < width; ++x)
    flat = flat + (x < 3 ? Bytes{10, 20, 30, 130} : Bytes{50, 60, 70, 131});
  old_runs = old_runs + Bytes{10, 20, 30, 130, 1, 1, 1, 2, 50, 60, 70, 131, 1, 1, 1, 16};
  new_runs = new_runs + Bytes{2, 2, 0, 20};
  for (int c = 0; c < 4; ++c) {
    const std::uint8_t first = Bytes{10, 20, 30, 130}[static_cast<std::size_t>(c)];
    const std::uint8_t second = Bytes{50, 60, 70, 131}[static_cast<std::size_t>(c)];
    new_runs = new_runs + Bytes{3, first, first, first, 128 + 17, second};
  }
  const auto a = read_hdr_image(flat, "flat"), b = read_hdr_image(old_runs, "old"), c = read_hdr_image(new_runs, "new");
  ASSERT_TRUE(a && b && c);
  EXPECT_EQ(a->radiance.texels, b->radiance.texels);
  EXPECT_EQ(a->radiance.texels, c->radiance.texels);
  EXPECT_EQ(a->radiance.at(19, 0).r, rgbe(50, 131));
}

TEST(RadianceHdr, all_eight_orientations_put_the_first_texel_in_its_corner) {
  // 2 wide, 3 high; the first texel of the file is the marked one, the second of the file lies along the second axis.
  struct Case {
    const char* resolution;
    int x, y, second_x, second_y;
  };
  for (const Case& c : {Case{"-Y 3 +X 2", 0, 0, 1, 0}, Case{"-Y 3 -X 2", 1, 0, 0, 0}, Case{"+Y 3 +X 2", 0, 2, 1, 2},
                        Case{"+Y 3 -X 2", 1, 2, 0, 2}, Case{"+X 2 -Y 3", 0, 0, 0, 1}, Case{"-X 2 -Y 3", 1, 0, 1, 1},
                        Case{"+X 2 +Y 3", 0, 2, 0, 1}, Case{"-X 2 +Y 3", 1, 2, 1, 1}}) {
    Bytes bytes = rgbe_header("", c.resolution) + Bytes{200, 0, 0, 128, 100, 0, 0, 128};
    for (int i = 0; i < 4; ++i)
      bytes = bytes + Bytes{0, 0, 0, 128};
    const auto image = read_hdr_image(bytes, "a.hdr");
    ASSERT_TRUE(image) << c.resolution;
    ASSERT_EQ(image->radiance.width, 2);
    EXPECT_EQ(image->radiance.at(c.x, c.y).r, rgbe(200, 128)) << c.resolution;
    EXPECT_EQ(image->radiance.at(c.second_x, c.second_y).r, rgbe(100, 128)) << c.resolution;
  }
}

TEST(RadianceHdr, bad_files_are_errors) {
  const Bytes pixel{1, 2, 3, 128};
  EXPECT_FALSE(read_hdr_image(rgbe_header("", "-Y 1 +X 2") + pixel, "truncated"));
  EXPECT_FALSE(read_hdr_image(rgbe_header("", "-Y 0 +X 1") + pixel, "empty"));
  EXPECT_FALSE(read_hdr_image(rgbe_header("", "-Y 1 +Y 1") + pixel, "axes"));
  EXPECT_FALSE(read_hdr_image(rgbe_header("", "-Y 999999999 +X 999999999") + pixel, "huge"));
  EXPECT_FALSE(read_hdr_image(rgbe_header("", "-Y 30000 +X 8000") + pixel, "implausible"));
  EXPECT_FALSE(read_hdr_image(rgbe_header("", "-Y 1 +X 1") + Bytes{1, 1, 1, 1}, "run without a texel"));
  EXPECT_FALSE(read_hdr_image(rgbe_header("", "-Y 1 +X 2") + pixel + Bytes{1, 1, 1, 9}, "run over the end"));
  EXPECT_FALSE(read_hdr_image(rgbe_header("", "-Y 1 +X 8") + Bytes{2, 2, 0, 8, 0, 0}, "empty literal"));
  EXPECT_FALSE(read_hdr_image(rgbe_header("", "-Y 1 +X 8") + Bytes{2, 2, 0, 9, 136, 1}, "wrong line length"));
  EXPECT_FALSE(read_hdr_image(ascii("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n"), "no end of header"));
  EXPECT_FALSE(read_hdr_image(ascii("P6 1 1 255"), "another format"));
  const auto xyz = read_hdr_image(ascii("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n") + pixel, "xyz.hdr");
  ASSERT_FALSE(xyz);
  EXPECT_NE(xyz.error().hint.find("ra_xyze"), std::string::npos);
}

TEST(ImageLimits, a_picture_above_the_limit_is_refused_by_its_header) {
  // 16,000 x 12,000: the header of a PNG, and of an .hdr, before half a megabyte of anything.
  const Bytes png = ascii("\x89PNG\r\n\x1a\n") + Bytes{0, 0, 0, 13} + ascii("IHDR") +
                    Bytes{0, 0, 0x3e, 0x80, 0, 0, 0x2e, 0xe0, 8, 0, 0, 0, 0, 0x0b, 0x3f, 0x13, 0x96} +
                    Bytes{0, 8, 0, 0} + ascii("IDAT") + Bytes(600'000);
  const auto photo = read_ldr_image(png, "a.png");
  ASSERT_FALSE(photo);
  EXPECT_EQ(photo.error().code, ErrorCode::limit_exceeded);
  EXPECT_NE(photo.error().message().find("16000 x 12000"), std::string::npos) << photo.error().message();
  EXPECT_NE(photo.error().message().find("67,108,864"), std::string::npos) << photo.error().message();
  // 1,000,000 x 1,000,000: above the limit of a side, too.
  const Bytes huge = ascii("\x89PNG\r\n\x1a\n") + Bytes{0, 0, 0, 13} + ascii("IHDR") +
                     Bytes{0, 0x0f, 0x42, 0x40, 0, 0x0f, 0x42, 0x40, 8, 2, 0, 0, 0, 0xd3, 0x0f, 0xaf, 0x2a} +
                     Bytes{0, 0, 0, 8} + ascii("IDAT") + Bytes(8);
  const auto vast = read_ldr_image(huge, "a.png");
  ASSERT_FALSE(vast);
  EXPECT_NE(vast.error().message().find("1000000 x 1000000 is above the limit of 32768 per side"), std::string::npos)
      << vast.error().message();
  const auto sky = read_hdr_image(rgbe_header("", "-Y 8192 +X 16384") + Bytes(600'000), "a.hdr");
  ASSERT_FALSE(sky);
  EXPECT_EQ(sky.error().code, ErrorCode::limit_exceeded);
}

TEST(RadianceHdr, damaged_files_never_crash) {
  Bytes good = rgbe_header("EXPOSURE=1.5\n", "-Y 16 +X 24");
  for (int y = 0; y < 16; ++y) {
    good = good + Bytes{2, 2, 0, 24};
    for (int c = 0; c < 4; ++c)
      good = good + Bytes{128 + 14, 77, 10, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  }
  ASSERT_TRUE(read_hdr_image(good, "good"));
  expect_survives_damage(good, [](const Bytes& b) { return read_hdr_image(b, "bad.hdr"); });
}

TEST_F(ImageFormats, png_round_trip_is_exact) {
  Rgb8Image image{19, 11, Bytes(3 * 19 * 11)};
  std::mt19937 random(2);
  for (auto& b : image.bytes)
    b = static_cast<std::uint8_t>(random());
  ASSERT_TRUE(write_png(folder_ / "a.png", image));
  const auto back = read_ldr_image(folder_ / "a.png");
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->bytes, image.bytes);
  expect_survives_damage(
      *read_whole_file(folder_ / "a.png"), [](const Bytes& b) { return read_ldr_image(b, "bad.png"); }, false);
  Bytes cut = *read_whole_file(folder_ / "a.png");
  cut.resize(cut.size() / 2);
  EXPECT_FALSE(read_ldr_image(cut, "cut.png"));
}

std::filesystem::path shared(const std::string& path) {
  return std::filesystem::path(DAYLIT_SOURCE_DIR) / "../shared/data" / path;
}

TEST_F(ImageFormats, an_encoded_jpeg_reads_back_alike_and_an_empty_picture_is_refused) {
  Rgb8Image image{40, 24, std::vector<std::uint8_t>(3 * 40 * 24)};
  for (std::size_t i = 0; i < image.bytes.size(); ++i) // a slope: no edges that the colour resolution could blur
    image.bytes[i] = static_cast<std::uint8_t>(60 + i / 3 % 40 * 3);
  const auto bytes = encoded_jpeg(image, 95);
  ASSERT_TRUE(bytes) << bytes.error().message();
  const auto back = read_ldr_image(*bytes, "back.jpg");
  ASSERT_TRUE(back) << back.error().message();
  ASSERT_EQ(back->bytes.size(), image.bytes.size());
  for (std::size_t i = 0; i < image.bytes.size(); ++i)
    EXPECT_NEAR(back->bytes[i], image.bytes[i], 4) << i;
  EXPECT_FALSE(encoded_jpeg({}, 95));
  EXPECT_FALSE(encoded_jpeg({70000, 1, std::vector<std::uint8_t>(3 * 70000)}, 95)) << "wider than the format allows";
}

TEST_F(ImageFormats, jpeg_photograph_is_read_and_a_truncated_one_refused) {
  const auto path = shared("markers/singlemarkersoriginal.jpg");
  if (!std::filesystem::exists(path))
    GTEST_SKIP() << "the shared photograph is not here";
  const auto photo = read_ldr_image(path);
  ASSERT_TRUE(photo) << photo.error().message();
  EXPECT_EQ(photo->width, 640);
  EXPECT_EQ(photo->height, 480);
  Bytes bytes = *read_whole_file(path);
  for (const double share : {0.01, 0.1, 0.5, 0.95})
    EXPECT_FALSE(
        read_ldr_image(std::span(bytes).first(static_cast<std::size_t>(share * double(bytes.size()))), "cut.jpg"));
  std::mt19937 random(4);
  for (int i = 0; i < 40; ++i) {
    Bytes bad = bytes;
    for (int k = 0; k < 1 + i % 4; ++k)
      bad[random() % (i % 2 ? bad.size() : 700)] ^= static_cast<std::uint8_t>(1u << (random() % 8));
    (void)read_ldr_image(bad, "bad.jpg");
  }
}

TEST(Srgb, curve_round_trips_and_meets_the_standard) {
  for (int i = 0; i <= 255; ++i)
    EXPECT_NEAR(srgb_encode(srgb_decode(float(i) / 255.0f)), float(i) / 255.0f, 1e-6f);
  EXPECT_NEAR(srgb_encode(0.18f), 0.4613561f, 1e-6f); // IEC 61966-2-1
  RgbImage image(1, 1, Rgb(0.18f, 2.0f, -1.0f));
  const Rgb8Image preview = to_srgb8(image, 1.0f);
  EXPECT_EQ(preview.bytes, (Bytes{118, 255, 0}));
}

TEST_F(ImageFormats, an_ldr_image_is_no_radiance) {
  ASSERT_TRUE(write_png(folder_ / "a.png", {1, 1, {1, 2, 3}}));
  const auto r = read_hdr_image(folder_ / "a.png");
  ASSERT_FALSE(r);
  EXPECT_NE(r.error().message().find("8-bit"), std::string::npos);
  EXPECT_EQ(read_hdr_image(folder_ / "missing.exr").error().code, ErrorCode::file_missing);
  EXPECT_FALSE(write_exr(folder_ / "no/such/folder/a.exr", RgbImage(1, 1)));
}

// The same light probe was published as an angular map and as a vertical cross of cube faces.
TEST(Probes, angular_map_agrees_with_the_cube_cross_of_the_same_probe) {
  if (!std::filesystem::exists(shared("probes/rnl_probe.hdr")))
    GTEST_SKIP() << "the shared probes are not here";
  const auto cross = *read_hdr_image(shared("probes/rnl_cross.hdr"));
  const auto sky = read_sky(shared("probes/rnl_probe.hdr"), AngularProjection{});
  ASSERT_TRUE(sky) << sky.error().message();
  // Vertical cross: 3 x 4 faces; row 0 column 1 = up, row 1 = left, forward, right, row 2 = down, row 3 = back turned
  // by 180 degrees. Camera frame of the angular map: right = -y, up = z, forward = x.
  const int face = cross.radiance.width / 3;
  double xy = 0, xx = 0, yy = 0, mx = 0, my = 0;
  int n = 0;
  for (int v = 8; v < face; v += 16)
    for (int u = 8; u < face; u += 16) {
      const double a = 2 * (u + 0.5) / face - 1, b = 1 - 2 * (v + 0.5) / face;
      const std::pair<glm::dvec3, glm::ivec2> faces[] = {{{1, -a, b}, {1, 1}},  {{-b, -a, 1}, {1, 0}},
                                                         {{b, -a, -1}, {1, 2}}, {{a, 1, b}, {0, 1}},
                                                         {{-a, -1, b}, {2, 1}}, {{-1, -a, -b}, {1, 3}}};
      for (const auto& [d, place] : faces) {
        const double p = std::log(1e-3 + double(luminance(cross.radiance.at(place.x * face + u, place.y * face + v))));
        const double q = std::log(1e-3 + double(luminance(sky->radiance(d))));
        mx += p, my += q, xx += p * p, yy += q * q, xy += p * q;
        ++n;
      }
    }
  const double correlation = (xy - mx * my / n) / std::sqrt((xx - mx * mx / n) * (yy - my * my / n));
  EXPECT_GT(correlation, 0.97);
}

} // namespace
} // namespace daylit
