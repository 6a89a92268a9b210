#include <cmath>
#include <cstdlib>

#include "scene/lens/lens.h"

// A file that is accepted must give a usable lens: finite rays wherever it claims to have any.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto lens = daylit::parse_lens(std::string(data, data + size), "fuzz");
  if (!lens)
    return 0;
  for (const double x : {-0.5, 0.0, 100.25, 319.5, 5000.0})
    if (const auto d = lens->unproject({x, lens->cy}))
      if (!std::isfinite(d->x + d->y + d->z))
        std::abort();
  return 0;
}
