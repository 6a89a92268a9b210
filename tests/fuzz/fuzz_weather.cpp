#include <cmath>
#include <cstdlib>

#include "scene/sky/sky_description.h"

// A tape that is accepted must give a finite sky for every row, or say why not.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  for (const auto& tape : {daylit::parse_epw(text, "fuzz.epw"), daylit::parse_wea(text, "fuzz.wea")}) {
    if (!tape)
      continue;
    for (const daylit::WeatherRow& row : tape->rows) {
      const auto found = daylit::weather_at(*tape, row.time);
      if (!found)
        continue;
      const auto sky = daylit::weather_sky(*tape, *found);
      if (!sky)
        continue;
      const daylit::Rgb l = daylit::AnalyticSky(sky->model).radiance({0.6, 0.0, 0.8});
      if (!std::isfinite(l.r + l.g + l.b) || l.r < 0.0f)
        std::abort();
      break; // one sky per input: the tape itself is what is attacked
    }
  }
  (void)daylit::parse_local_time(text);
  return 0;
}
