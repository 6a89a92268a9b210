#include "runtime/reflect/lobe_places.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include <gtest/gtest.h>

namespace daylit {
namespace {

TEST(LobePlaces, sixteen_pixels_in_a_square_have_sixty_four_places_apart) {
  std::set<std::pair<int, int>> cells; // of 8 x 8, of the places before they are moved
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x)
      for (int k = 0; k < kLobeRays; ++k) {
        const glm::vec2 place = glm::fract(lobe_place(x, y, k) - 0.125f * shift_of(x, y) + 1.0f);
        cells.insert({static_cast<int>(8.0f * place.x), static_cast<int>(8.0f * place.y)});
      }
  EXPECT_EQ(cells.size(), 64u);
}

/// Whatever the place in the first lobe, those in the lobes after it are everywhere alike.
TEST(LobePlaces, the_places_of_later_lobes_do_not_depend_on_those_before) {
  constexpr int kCells = 4, kSide = 256;
  for (const int lobes : {1, 2, 7}) {
    std::array<std::array<int, kCells * kCells>, kCells * kCells> count{};
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        for (int k = 0; k < kLobeRays; ++k) {
          const auto cell = [](const glm::vec2& p) {
            return static_cast<std::size_t>(kCells * p.x) + kCells * static_cast<std::size_t>(kCells * p.y);
          };
          const glm::vec2 first = lobe_place(x, y, k), next = place_after(first, lobes);
          ASSERT_TRUE(next.x >= 0.0f && next.x < 1.0f && next.y >= 0.0f && next.y < 1.0f);
          ++count[cell(first)][cell(next)];
        }
    constexpr int kEach = kLobeRays * kSide * kSide / (kCells * kCells * kCells * kCells); // 1024
    for (const auto& row : count)
      for (const int n : row)
        EXPECT_NEAR(n, kEach, 5 * 32) << lobes; // five standard deviations
  }
}

TEST(LobePlaces, the_first_lobe_has_the_pixels_own_place) {
  EXPECT_EQ(place_after({0.3f, 0.8f}, 0), glm::vec2(0.3f, 0.8f));
}

} // namespace
} // namespace daylit
