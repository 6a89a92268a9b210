// The mean light of a piece of a surface across which the edge of a sun patch runs.

#include "scene/volume/lit_piece.h"

#include <gtest/gtest.h>

namespace daylit {
namespace {

const std::array<glm::dvec3, 3> kPiece{glm::dvec3(0.3, 0.1, 0), glm::dvec3(1.3, 0.1, 0), glm::dvec3(0.3, 1.1, 0)};

TEST(LitPiece, one_that_is_lit_or_dark_all_over_is_looked_at_half_as_often) {
  for (const float light : {0.0f, 3.0f}) {
    int looked = 0;
    const Rgb mean = mean_over_piece(kPiece, [&](const glm::dvec3&, int k) {
      EXPECT_EQ(k, looked++);
      return Rgb(light);
    });
    EXPECT_EQ(looked, kFewPiecePoints);
    EXPECT_EQ(mean, Rgb(light));
  }
}

TEST(LitPiece, one_that_is_lit_in_part_has_that_part_of_the_light) {
  for (const double edge : {0.1, 0.2, 0.4, 0.7}) { // lit up to there: 1 - (1 - edge)^2 of it
    const Rgb mean = mean_over_piece(
        kPiece, [&](const glm::dvec3& p, int) { return Rgb(p.x - 0.3 < edge ? 1.0f : 0.0f, 0.0f, 0.0f); });
    EXPECT_NEAR(static_cast<double>(mean.r), 1.0 - (1.0 - edge) * (1.0 - edge), 0.05) << edge;
    EXPECT_EQ(mean.g, 0.0f);
  }
}

/// Fewer points leave out what none of them meets.
TEST(LitPiece, narrow_strips_keep_most_of_their_light) {
  for (const double width : {0.02, 0.04, 0.08}) {
    double sum = 0, exact = 0;
    for (int k = 0; k < 400; ++k) { // wherever the strip lies
      const double from = 0.3 + 0.002 * k;
      sum += static_cast<double>(mean_over_piece(kPiece, [&](const glm::dvec3& p, int) {
                                   return Rgb(p.x >= from && p.x < from + width ? 1.0f : 0.0f);
                                 }).r);
      exact += width * (2.0 * (1.3 - from) - width);
    }
    EXPECT_GT(sum / exact, 0.75) << width;
    EXPECT_LT(sum / exact, 1.03) << width;
  }
}

TEST(LitPiece, points_lie_in_it_and_differ_from_those_of_the_next) {
  std::array<glm::dvec3, 3> next = kPiece;
  for (glm::dvec3& c : next)
    c.x += 0.01;
  std::vector<glm::dvec3> of[2];
  for (int i = 0; i < 2; ++i)
    mean_over_piece(i == 0 ? kPiece : next, [&](const glm::dvec3& p, int) {
      EXPECT_TRUE(p.x >= 0.3 && p.y >= 0.1 && p.x + p.y <= 1.42);
      of[i].push_back(p);
      return Rgb(0.0f);
    });
  EXPECT_GT(glm::distance(of[0][0] + glm::dvec3(0.01, 0, 0), of[1][0]), 0.02);
}

} // namespace
} // namespace daylit
