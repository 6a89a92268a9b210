// How many rays the picture of objects that mirror takes.

#include <gtest/gtest.h>

#include "test_session.h"

namespace daylit {
namespace {

using test::Studio;

double rays_of(Studio& studio, const char* material) {
  studio.config.objects[0].material = material;
  const auto frame = studio.render(Backend::rays);
  EXPECT_TRUE(frame);
  return frame ? static_cast<double>(frame->report.glossy_rays) : 0.0;
}

/// Brass and aluminium: roughness 0.15 and 0.2.
TEST(GlossyPicture, metal_that_sees_itself_in_a_narrow_lobe_takes_more_rays_there) {
  Studio ring, ball;
  test::write_ply(ball.config.objects[0].model, test::torus(0.0f, 0.2f, 64, 32));
  EXPECT_GT(rays_of(ring, "brass"), 1.08 * rays_of(ring, "aluminium"));
  EXPECT_NEAR(rays_of(ball, "brass") / rays_of(ball, "aluminium"), 1.0, 0.02);
}

} // namespace
} // namespace daylit
