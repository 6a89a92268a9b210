#include "radiosity/emission.h"

#include <tbb/parallel_for.h>

namespace daylit::radiosity {

Result<FirstBounce> emitted_light(const ElementSet& set, const ExchangeMatrix& exchange,
                                  std::span<const Rgb> exitance) {
  const std::size_t n = set.elements.size();
  if (exitance.size() != n || exchange.size != n)
    return Error{ErrorCode::value_invalid, "the exitances are not as many as the elements", "emission", ""};
  FirstBounce light;
  light.elements = n;
  light.region = {0};
  light.irradiance.resize(3 * n);
  light.opening.assign(n, 0.0f);
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
    const float* g = exchange.row(i);
    glm::dvec3 flux(0.0);
    for (std::size_t j = 0; j < n; ++j)
      if (exitance[j] != Rgb(0.0f))
        flux += static_cast<double>(g[j]) * glm::dvec3(exitance[j]);
    for (int c = 0; c < 3; ++c)
      light.irradiance[3 * i + c] = static_cast<float>(flux[c] / set.elements[i].area_m2);
  });
  return light;
}

void add_exitance(std::span<const Rgb> exitance, Radiosity& radiosity) {
  const std::size_t per_channel = radiosity.columns / 3;
  for (std::size_t i = 0; i < radiosity.elements; ++i)
    for (std::size_t k = 0; k < radiosity.columns; ++k)
      radiosity.b[i * radiosity.columns + k] += exitance[i][static_cast<int>(k / per_channel)];
}

} // namespace daylit::radiosity
