#include "bench/flicker.h"

#include <algorithm>
#include <cmath>

namespace daylit::bench {

namespace {

constexpr std::uint64_t kFirstNumber = 1000; // no picture of these numbers was seen before

struct Sums {
  double variance = 0.0, mean = 0.0;
  std::size_t count = 0;
  double relative() const {
    const double n = static_cast<double>(std::max<std::size_t>(count, 1));
    return mean > 0.0 ? std::sqrt(variance / n) / (mean / n) : 0.0;
  }
};

} // namespace

Result<Flicker> measure_flicker(const FrameScene& scene, Session& session, int frames) {
  std::vector<double> sums, squares; // per pixel, about the first frame: differences of large numbers lose digits
  RgbImage first;
  std::vector<std::uint8_t> touched;
  for (std::size_t k = 0; k < static_cast<std::size_t>(frames); ++k) {
    const auto frame = session.render({scene.skies[k], scene.photos[0], kFirstNumber + k, 1});
    if (!frame)
      return frame.error();
    const RgbImage& picture = (*frame)->composite.picture;
    if (k == 0)
      first = picture;
    sums.resize(picture.texels.size());
    squares.resize(picture.texels.size());
    for (std::size_t i = 0; i < picture.texels.size(); ++i) {
      const double d = static_cast<double>(picture.texels[i].g) - static_cast<double>(first.texels[i].g);
      sums[i] += d;
      squares[i] += d * d;
    }
    touched = (*frame)->composite.touched;
  }
  Sums region[2]; // shadow, object
  const double n = frames;
  for (std::size_t i = 0; i < touched.size(); ++i) {
    if (touched[i] == 0)
      continue;
    Sums& r = region[touched[i] - 1];
    r.variance += std::max(0.0, squares[i] - sums[i] * sums[i] / n) / (n - 1.0);
    r.mean += static_cast<double>(first.texels[i].g) + sums[i] / n;
    ++r.count;
  }
  return Flicker{region[1].relative(), region[0].relative()};
}

} // namespace daylit::bench
