// The windows' light on the vertices of an object that hides some of it from itself, against rays to many points of
// the window.

#include "runtime/indirect/window_shares.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "test_session.h"

namespace daylit {
namespace {

/// A ring before the window of the box room, whose near side hides the window from its inside.
struct Ring {
  static constexpr int kPoints = 24; ///< per side of the window
  test::Studio studio;
  RayScene room = *RayScene::build(test::box_room());
  std::vector<Aperture> panes = test::box_window();
  WindowVisibility windows{room, panes};
  VirtualObjects objects;

  Ring() {
    studio.config.objects[0].rotation_deg = {20.0, 0.0, 0.0};
    objects =
        *load_virtual_objects(studio.config.objects, studio.folder, [](const std::string&, double) { return true; });
  }
  struct Light {
    double past_ring = 0.0, all = 0.0;
  };
  /// Sums of cos cos' / r^2 over points of the window, those that a sender sees past the ring and all.
  Light light(const RayScene& ring, std::size_t sender) const {
    const glm::dvec3 x = objects.senders.surface.positions[sender], n(objects.senders.surface.normals[sender]);
    const std::vector<glm::dvec3>& c = panes[0].corners;
    Light sum;
    for (int k = 0; k < kPoints * kPoints; ++k) {
      const double u = (k / kPoints + 0.5) / kPoints, v = (k % kPoints + 0.5) / kPoints;
      const glm::dvec3 d = c[0] + u * (c[1] - c[0]) + v * (c[3] - c[0]) - x;
      const double r2 = glm::dot(d, d), cosine = glm::dot(n, d);
      if (cosine <= 0.0)
        continue;
      const double weight = -cosine * glm::dot(panes[0].inward, d) / (r2 * r2);
      sum.all += weight;
      sum.past_ring += ring.occluded(ring.to_local(x + 1e-3 * n), glm::vec3(d), 0.0f, 1.0f) ? 0.0 : weight;
    }
    return sum;
  }
};

TEST(WindowShares, of_a_ring_are_what_rays_to_the_window_find_past_the_ring) {
  const Ring s;
  const RayScene ring = *RayScene::build(s.objects.surface.positions, s.objects.surface.triangles);
  const WindowShares shares = window_shares(s.windows, nullptr, s.objects, {});
  double error = 0.0, power = 0.0;
  int hidden = 0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const Ring::Light expected = s.light(ring, i);
    error += std::pow(static_cast<double>(shares[i][0]) * expected.all - expected.past_ring, 2.0);
    power += expected.past_ring * expected.past_ring;
    hidden += expected.all > 0.0 && expected.past_ring < 0.1 * expected.all;
  }
  EXPECT_GT(hidden, shares.size() / 20) << "the inside faces the window through the ring's near side";
  EXPECT_LT(std::sqrt(error / power), 0.08) << "by nine coefficients it is 0.12";
}

TEST(WindowShares, of_an_object_that_hides_nothing_from_itself_are_those_of_the_room) {
  Ring s;
  for (VertexTransfer& t : s.objects.senders.transfer)
    t.front[0] = 0.5f * std::sqrt(std::numbers::pi_v<float>); // of the whole hemisphere
  for (const auto& share : window_shares(s.windows, nullptr, s.objects, {}))
    EXPECT_FLOAT_EQ(share[0], 1.0f) << "nothing of the room stands before the window";
}

} // namespace
} // namespace daylit
