#include "capture/hdr/response_curve.h"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

namespace daylit {
namespace {

std::string gamma_file(double gamma) {
  std::string text = "# code -> exposure\n";
  for (int i = 0; i < 256; ++i)
    text += std::to_string(100 * std::pow(i / 255.0, gamma)) + (i % 2 ? "\n" : " # comment\n");
  return text;
}

TEST(ResponseCurve, every_code_of_8_bits_round_trips) {
  for (const ResponseCurve& r :
       {ResponseCurve::linear(), ResponseCurve::srgb(), *ResponseCurve::parse(gamma_file(2.2), "g")})
    for (int code = 0; code < 256; ++code) {
      const float exposure = r.table()[1][static_cast<std::size_t>(code)];
      if (code == 1 && exposure == r.table()[1][0])
        continue; // six decimals in the file do not tell the darkest two codes apart
      EXPECT_EQ(r.encode(exposure, 1), code);
      EXPECT_NEAR(r.exposure(static_cast<float>(code) / 255, 1), exposure, 1e-6f);
    }
  EXPECT_EQ(ResponseCurve::srgb().encode(7.0f, 0), 255);
  EXPECT_EQ(ResponseCurve::srgb().encode(-1.0f, 0), 0);
  EXPECT_EQ(ResponseCurve::srgb().encode(std::numeric_limits<float>::quiet_NaN(), 0), 0);
  EXPECT_NEAR(ResponseCurve::srgb().table()[0][118], 0.18f, 0.002f);
}

TEST(ResponseCurve, bad_files_say_the_line) {
  const auto where = [](const std::string& text) { return ResponseCurve::parse(text, "r.txt").error().where; };
  EXPECT_FALSE(ResponseCurve::parse("", "r.txt"));
  EXPECT_EQ(where(gamma_file(2.2) + "101\n"), "r.txt, line 258");
  std::string falling, flat;
  for (int i = 0; i < 256; ++i) {
    falling += std::to_string(i == 99 ? 0 : i) + "\n";
    flat += "3\n";
  }
  EXPECT_EQ(where(falling), "r.txt, line 100");
  EXPECT_EQ(where("1\n\n1 nan\n"), "r.txt, line 3");
  EXPECT_EQ(where("2 1 0 0\n3 1 0 0\n2 1 0 0\n"), "r.txt, line 2") << "the degree of a polynomial";
  EXPECT_FALSE(ResponseCurve::parse("1 2\n", "r.txt"));
  EXPECT_FALSE(ResponseCurve::parse(flat, "r.txt"));
  EXPECT_FALSE(ResponseCurve::named("/no/such/file"));
}

TEST(ResponseCurve, reads_what_it_writes_and_the_polynomials_of_hdrgen) {
  const auto curve = ResponseCurve::parse(ResponseCurve::srgb().text(), "text");
  ASSERT_TRUE(curve);
  for (int k = 0; k <= 100; ++k)
    EXPECT_NEAR(curve->exposure(0.01f * static_cast<float>(k), 1),
                ResponseCurve::srgb().exposure(0.01f * static_cast<float>(k), 1), 1e-6f);
  const auto polynomial = ResponseCurve::parse("2 1 0 0\n2 0.5 0.5 0\n1 2 0\n", "rsp");
  ASSERT_TRUE(polynomial);
  EXPECT_NEAR(polynomial->exposure(0.5f, 0), 0.25f, 1e-5f);
  EXPECT_NEAR(polynomial->exposure(0.5f, 1), 0.375f, 1e-5f);
  EXPECT_NEAR(polynomial->exposure(0.5f, 2), 0.5f, 1e-5f);
  EXPECT_FALSE(ResponseCurve::parse("3 1 0 0\n2 1 0 0\n2 1 0 0\n", "rsp")) << "wrong degree";
  EXPECT_FALSE(ResponseCurve::parse("1\n2\n", "short"));
  EXPECT_FALSE(ResponseCurve::parse("nan\n", "nan"));
}

} // namespace
} // namespace daylit
