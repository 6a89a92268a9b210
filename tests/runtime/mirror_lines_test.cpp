// Mirrors that bend: what is narrower in them than a pixel.

#include <gtest/gtest.h>

#include <cmath>

#include "test_session.h"

namespace daylit {
namespace {

using test::Studio;

/// The ring in chrome, in a picture so many times as wide.
Result<Frame> ring_of_chrome(int finer) {
  Studio studio;
  const int width = finer * Studio::kWidth, height = finer * Studio::kHeight;
  studio.config.objects[0].material = "chrome";
  EXPECT_TRUE(write_lens(studio.config.interior.lens, ideal_pinhole(width, height, 0.6)));
  studio.photo = RgbImage(width, height);
  std::ranges::fill(studio.photo.texels, Rgb(0.3f));
  const auto sky = test::sky_image(studio.sky);
  auto session = Session::open(
      studio.config, width, height, [](const std::string&, double) { return true; }, Backend::rays);
  if (!session)
    return session.error();
  const auto frame = session->render({*sky, studio.photo});
  if (!frame)
    return frame.error();
  return **frame;
}

TEST(GlossyPicture, bright_lines_narrower_than_a_pixel_are_lines_and_not_dots) {
  constexpr int kFiner = 8;
  const auto coarse = ring_of_chrome(1), fine = ring_of_chrome(kFiner);
  ASSERT_TRUE(coarse && fine);
  double error = 0.0, light = 0.0, count = 0.0;
  for (int y = 0; y < Studio::kHeight; ++y)
    for (int x = 0; x < Studio::kWidth; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * Studio::kWidth + static_cast<std::size_t>(x);
      if (coarse->composite.coverage[i] < 1.0f)
        continue;
      double mean = 0.0;
      for (int k = 0; k < kFiner * kFiner; ++k)
        mean +=
            static_cast<double>(fine->composite.picture
                                    .texels[static_cast<std::size_t>(
                                        (kFiner * y + k / kFiner) * kFiner * Studio::kWidth + kFiner * x + k % kFiner)]
                                    .g) /
            (kFiner * kFiner);
      error += std::pow(static_cast<double>(coarse->composite.picture.texels[i].g) - mean, 2);
      light += mean;
      ++count;
    }
  ASSERT_GT(count, 300.0);
  EXPECT_LT(std::sqrt(error / count) / (light / count), 0.14) << "0.18 from one ray a pixel";
}

} // namespace
} // namespace daylit
