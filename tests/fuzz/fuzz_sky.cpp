#include <cmath>
#include <cstdlib>

#include "scene/sky/sky_description.h"

// A sky in words that is accepted has a radiance in every direction.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (text.find("file") != std::string_view::npos)
    return 0; // no weather tapes from this machine's disk
  const auto sky = daylit::parse_sky_description(text, "fuzz.toml");
  if (!sky)
    return 0;
  const daylit::AnalyticSky analytic(sky->model);
  for (const glm::dvec3& towards :
       {glm::dvec3(0.6, 0.0, 0.8), glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 0), glm::dvec3(0, 0, -1)}) {
    const daylit::Rgb l = analytic.radiance(towards);
    if (!std::isfinite(l.r + l.g + l.b) || l.r < 0.0f || l.g < 0.0f || l.b < 0.0f)
      std::abort();
  }
  return 0;
}
