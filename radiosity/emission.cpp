#include "radiosity/emission.h"

#include <algorithm>

#include <tbb/parallel_for.h>

namespace daylit::radiosity {

std::vector<float> exchange_product(const ExchangeMatrix& exchange, std::span<const float> columns, std::size_t width) {
  std::vector<float> product(exchange.size * width);
  tbb::parallel_for(std::size_t{0}, exchange.size, [&](std::size_t i) {
    const float* g = exchange.row(i);
    std::vector<double> sum(width, 0.0);
    for (std::size_t j = 0; j < exchange.size; ++j)
      for (std::size_t k = 0; k < width; ++k)
        sum[k] += static_cast<double>(g[j]) * static_cast<double>(columns[j * width + k]);
    std::ranges::transform(sum, product.begin() + static_cast<std::ptrdiff_t>(i * width),
                           [](double x) { return static_cast<float>(x); });
  });
  return product;
}

Result<FirstBounce> emitted_light(const ElementSet& set, const ExchangeMatrix& exchange,
                                  std::span<const Rgb> exitance) {
  const std::size_t n = set.elements.size();
  if (exitance.size() != n || exchange.size != n)
    return Error{ErrorCode::value_invalid, "the exitances are not as many as the elements", "emission", ""};
  FirstBounce light;
  light.elements = n;
  light.region = {0};
  light.opening.assign(n, 0.0f);
  light.irradiance = exchange_product(exchange, {&exitance.data()->x, 3 * n}, 3);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      light.irradiance[3 * i + c] /= static_cast<float>(set.elements[i].area_m2);
  return light;
}

void add_exitance(std::span<const Rgb> exitance, Radiosity& radiosity) {
  const std::size_t per_channel = radiosity.columns / 3;
  for (std::size_t i = 0; i < radiosity.elements; ++i)
    for (std::size_t k = 0; k < radiosity.columns; ++k)
      radiosity.b[i * radiosity.columns + k] += exitance[i][static_cast<int>(k / per_channel)];
}

} // namespace daylit::radiosity
