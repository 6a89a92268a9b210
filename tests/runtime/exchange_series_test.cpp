// Light after all exchanges, told from the first few.

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/session/exchange_series.h"

namespace daylit {
namespace {

/// x <- b + q x, for each sender with a ratio of its own.
struct Exchanges {
  std::vector<float> part, ratio;
  std::vector<TwoSided> direct, sent;

  explicit Exchanges(std::vector<float> q) : part(q.size(), 1.0f), ratio(std::move(q)) {
    direct.assign(ratio.size(), {Rgb(5.0f), Rgb(5.0f)});
    sent.assign(ratio.size(), {});
    for (std::size_t i = 0; i < part.size(); ++i)
      part[i] = 1.0f + 0.1f * static_cast<float>(i);
  }
  void next() {
    for (std::size_t i = 0; i < sent.size(); ++i) {
      sent[i].front = Rgb(part[i]) + ratio[i] * sent[i].front;
      sent[i].back = Rgb(2.0f * part[i]) + ratio[i] * sent[i].back;
    }
  }
  float limit(std::size_t i) const { return part[i] / (1.0f - ratio[i]); }
};

/// RMS error of `all` beside the limit of all exchanges.
double error(const Exchanges& e, std::span<const TwoSided> all) {
  double sum = 0;
  for (std::size_t i = 0; i < all.size(); ++i)
    sum += std::pow(static_cast<double>(all[i].front.g - e.limit(i)), 2);
  return std::sqrt(sum / static_cast<double>(all.size()));
}

TEST(ExchangeSeries, three_terms_of_a_geometric_series_give_its_limit) {
  Exchanges e({0.5f, 0.5f, 0.5f});
  ExchangeSeries series(e.sent, e.direct);
  for (int k = 0; k < 3; ++k) {
    e.next();
    series.add(e.sent);
  }
  EXPECT_GT(error(e, e.sent), 0.2);
  EXPECT_LT(error(e, series.limit()), 1e-4);
  EXPECT_NEAR(series.limit()[1].back.r, 2.0f * e.limit(1), 1e-4f);
}

TEST(ExchangeSeries, where_ratios_differ_what_is_left_is_a_third) {
  Exchanges e({0.2f, 0.3f, 0.4f, 0.5f});
  ExchangeSeries series(e.sent, e.direct);
  for (int k = 0; k < 3; ++k) {
    e.next();
    series.add(e.sent);
  }
  EXPECT_LT(error(e, series.limit()), 0.3 * error(e, e.sent));
}

TEST(ExchangeSeries, light_that_does_not_come_back_ends_it_at_the_second) {
  Exchanges e({0.0f, 0.0f});
  ExchangeSeries series(e.sent, e.direct);
  e.next();
  EXPECT_FALSE(series.add(e.sent)) << "the first change tells nothing of the next";
  e.next();
  EXPECT_TRUE(series.add(e.sent));
  EXPECT_EQ(series.limit()[0].front, e.sent[0].front);
}

TEST(ExchangeSeries, it_goes_on_while_changes_are_large) {
  Exchanges e({0.6f, 0.6f});
  e.direct.assign(2, {});
  ExchangeSeries series(e.sent, e.direct);
  int count = 0;
  do
    e.next();
  while (!series.add(e.sent) && ++count < 20);
  EXPECT_GE(count, 4);
  EXPECT_LT(count, 10);
}

TEST(ExchangeSeries, changes_to_and_fro_are_not_prolonged_and_light_is_not_negative) {
  const std::vector<TwoSided> none(1), one{{Rgb(1.0f), Rgb(1.0f)}}, half{{Rgb(0.5f), Rgb(0.5f)}},
      little{{Rgb(0.1f), Rgb(0.1f)}};
  ExchangeSeries back(none, none);
  back.add(one);
  back.add(half);
  EXPECT_EQ(back.limit()[0].front, half[0].front);
  ExchangeSeries down(std::vector<TwoSided>{{Rgb(1.5f), Rgb(1.5f)}}, none);
  down.add(one);
  down.add(little);
  EXPECT_EQ(down.limit()[0].front, Rgb(0.0f));
}

} // namespace
} // namespace daylit
