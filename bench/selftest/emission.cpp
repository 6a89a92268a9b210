#include "bench/selftest/emission.h"

#include <algorithm>

namespace daylit::bench {

std::vector<float> exchange_product(const radiosity::ExchangeMatrix& exchange, std::span<const float> columns,
                                    std::size_t width) {
  const std::size_t n = exchange.size();
  std::vector<float> x(n * width), y(n * width), product(n * width);
  for (std::size_t k = 0; k < n; ++k)
    std::copy_n(columns.data() + exchange.order()[k] * width, width, x.data() + k * width);
  exchange.multiply(x.data(), width, y.data());
  for (std::size_t k = 0; k < n; ++k)
    std::copy_n(y.data() + k * width, width, product.data() + exchange.order()[k] * width);
  return product;
}

Result<radiosity::FirstBounce> emitted_light(const radiosity::PatchSet& set, const radiosity::ExchangeMatrix& exchange,
                                             std::span<const Rgb> exitance) {
  const std::size_t n = set.patches.size();
  if (exitance.size() != n || exchange.size() != n)
    return Error{ErrorCode::value_invalid, "the exitances are not as many as the patches", "emission", ""};
  radiosity::FirstBounce light;
  light.patches = n;
  light.region = {0};
  light.opening.assign(n, 0.0f);
  light.irradiance = exchange_product(exchange, {&exitance.data()->x, 3 * n}, 3);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      light.irradiance[3 * i + c] /= static_cast<float>(set.patches[i].area_m2);
  return light;
}

void add_exitance(std::span<const Rgb> exitance, radiosity::Radiosity& radiosity) {
  const std::size_t per_channel = radiosity.columns / 3;
  for (std::size_t i = 0; i < radiosity.patches; ++i)
    for (std::size_t k = 0; k < radiosity.columns; ++k)
      radiosity.b[i * radiosity.columns + k] += exitance[i][static_cast<int>(k / per_channel)];
}

} // namespace daylit::bench
