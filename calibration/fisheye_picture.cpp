#include "calibration/fisheye_picture.h"

#include <numeric>

#include "scene/core/parallel.h"

namespace daylit::calibration {

double illuminance_at(const RgbImage& radiance, const LensModel& lens) {
  std::vector<double> row(static_cast<std::size_t>(radiance.height));
  parallel_for(0, radiance.height, [&](int y) {
    for (int x = 0; x < radiance.width; ++x)
      if (const auto d = lens.unproject({x, y}); d && d->z > 0)
        row[static_cast<std::size_t>(y)] +=
            static_cast<double>(luminance(radiance.at(x, y))) * d->z * lens.solid_angle_density({x, y});
  });
  return std::accumulate(row.begin(), row.end(), 0.0);
}

} // namespace daylit::calibration
