#include "calibration/panorama.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "capture/hdr/bracket.h"
#include "scene/core/parallel_stage.h"

namespace daylit::calibration {

namespace {

constexpr int kSide = 4;              ///< directions per texel, along each axis
constexpr float kFeather = 0.25f;     ///< of half a picture: where its weight falls to zero
constexpr float kFadesFrom = 0.8f;    ///< of full scale: from here to kFull the weight falls to zero
constexpr float kCalibration = 0.02f; ///< relative deviation of a picture that is not noise: exposure, response, lens
constexpr double kSmallestGap_sr = 1e-3;

/// Smooth from 0 at 0 to 1 at 1.
float smooth(float t) {
  const float x = std::clamp(t, 0.0f, 1.0f);
  return x * x * (3.0f - 2.0f * x);
}

/// Between the four nearest texels; nothing outside. `usable`: none of them is saturated.
std::optional<Rgb> bilinear(const HandHeldPicture& p, const glm::dvec2& at, bool& usable) {
  const int x = static_cast<int>(std::floor(at.x)), y = static_cast<int>(std::floor(at.y));
  if (x < 0 || y < 0 || x + 1 >= p.light.width || y + 1 >= p.light.height)
    return std::nullopt;
  const auto u = static_cast<float>(at.x - x), v = static_cast<float>(at.y - y);
  const std::size_t k = static_cast<std::size_t>(y) * p.light.width + x, below = k + p.light.width;
  usable = usable && p.usable[k] && p.usable[k + 1] && p.usable[below] && p.usable[below + 1];
  return (1 - v) * ((1 - u) * p.light.texels[k] + u * p.light.texels[k + 1]) +
         v * ((1 - u) * p.light.texels[below] + u * p.light.texels[below + 1]);
}

/// What one picture shows of a texel.
struct View {
  Rgb light{0.0f};
  bool usable = true;
  float feather = 0.0f; ///< 0 at the picture's edge
};

/// The mean over the texel's directions; nothing where one of them lies outside of the picture.
std::optional<View> view_of_texel(const HandHeldPicture& p, std::span<const glm::dvec3> directions) {
  const glm::dmat3 camera_from_world = glm::transpose(p.world_from_camera);
  View view;
  glm::dvec2 middle(0.0);
  for (const glm::dvec3& w : directions) {
    const glm::dvec3 d = camera_from_world * w;
    const auto at = d.z > 0 ? p.lens.project(d) : std::nullopt;
    const auto light = at ? bilinear(p, *at, view.usable) : std::nullopt;
    if (!light)
      return std::nullopt;
    view.light += *light / static_cast<float>(directions.size());
    middle += *at / static_cast<double>(directions.size());
  }
  const auto edge = [](double at, int size) {
    return static_cast<float>(std::min(at + 0.5, size - 0.5 - at) / (0.5 * size));
  };
  view.feather = smooth(edge(middle.x, p.light.width) / kFeather) * smooth(edge(middle.y, p.light.height) / kFeather);
  return view;
}

struct Texel {
  Rgb weighted{0.0f};
  float weight = 0.0f;
  Rgb bound{0.0f}; ///< of pictures that are saturated there: radiance at least
  std::uint8_t seen = 0;
};

/// Weight t^2 / (floor^2 + photon v + (kCalibration v)^2), the inverse variance of v / t. The last part keeps a longer
/// exposure from outweighing all others where none is noisy: its edge would be seen.
void add_view(Texel& texel, const HandHeldPicture& p, const View& view, const CodeNoise& noise) {
  texel.seen = static_cast<std::uint8_t>(std::min(texel.seen + 1, 255));
  const auto t = static_cast<float>(p.exposure);
  if (!view.usable) {
    texel.bound = glm::max(texel.bound, view.light / t);
    return;
  }
  const float brightest = std::max({view.light.r, view.light.g, view.light.b});
  const float y = luminance(view.light), other = kCalibration * y;
  const float variance = static_cast<float>(noise.variance(static_cast<double>(y))) + other * other;
  const float weight =
      std::max(view.feather * smooth((kFull - brightest) / (kFull - kFadesFrom)), 1e-6f) * t * t / variance;
  texel.weighted += weight * view.light / t;
  texel.weight += weight;
}

std::vector<glm::dvec3> directions_of(const SkyGeometry& geometry, int x, int y) {
  std::vector<glm::dvec3> directions;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i)
      if (const auto d = geometry.direction({x + (i + 0.5) / kSide - 0.5, y + (j + 0.5) / kSide - 0.5}))
        directions.push_back(*d);
  return directions;
}

/// Cosine of the angle from the axis at which a picture ends.
double cosine_of_corner(const HandHeldPicture& p) {
  double least = 1.0;
  for (const glm::dvec2& at : {glm::dvec2(0, 0),
                               {p.light.width - 1.0, 0},
                               {0, p.light.height - 1.0},
                               {p.light.width - 1.0, p.light.height - 1.0}})
    least = std::min(least, p.lens.unproject(at).value_or(glm::dvec3(0, 0, 0)).z);
  return least;
}

/// Means of what is known, coarser and coarser; where nothing is known, the coarser level.
void fill(RgbImage& image, std::vector<float>& known) {
  if (image.width <= 1 && image.height <= 1)
    return;
  RgbImage coarse((image.width + 1) / 2, (image.height + 1) / 2);
  std::vector<float> coarse_known(coarse.texels.size(), 0.0f);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const std::size_t k = static_cast<std::size_t>(y) * image.width + x,
                        c = static_cast<std::size_t>(y / 2) * coarse.width + x / 2;
      coarse.texels[c] += known[k] * image.texels[k];
      coarse_known[c] += known[k];
    }
  for (std::size_t c = 0; c < coarse.texels.size(); ++c)
    if (coarse_known[c] > 0.0f) {
      coarse.texels[c] /= coarse_known[c];
      coarse_known[c] = 1.0f;
    }
  fill(coarse, coarse_known);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (const std::size_t k = static_cast<std::size_t>(y) * image.width + x; known[k] == 0.0f)
        image.texels[k] = coarse.at(x / 2, y / 2);
}

/// Texels that hang together, by flood; across the map's left and right edge where it is equirectangular.
std::vector<Gap> gaps_of(const Panorama& panorama, const SkyGeometry& geometry) {
  const int width = geometry.width(), height = geometry.height();
  std::vector<std::uint8_t> left(panorama.seen.size());
  for (std::size_t k = 0; k < left.size(); ++k)
    left[k] = panorama.seen[k] == 0 && geometry.solid_angle_sr()[k] > 0.0f ? 1 : 0;
  std::vector<Gap> gaps;
  for (std::size_t start = 0; start < left.size(); ++start) {
    Gap gap{glm::dvec3(0.0), 0.0};
    std::vector<std::size_t> open;
    const auto visit = [&](int x, int y) {
      const int column = geometry.is_equirect() ? (x + width) % width : x;
      if (column < 0 || column >= width || y < 0 || y >= height)
        return;
      const std::size_t k = static_cast<std::size_t>(y) * width + column;
      if (left[k]) {
        left[k] = 0;
        open.push_back(k);
      }
    };
    visit(static_cast<int>(start % width), static_cast<int>(start / width));
    while (!open.empty()) {
      const std::size_t k = open.back();
      open.pop_back();
      const int x = static_cast<int>(k % width), y = static_cast<int>(k / width);
      const double part = static_cast<double>(geometry.solid_angle_sr()[k]);
      gap.solid_angle_sr += part;
      gap.middle += part * geometry.direction({x, y}).value_or(glm::dvec3(0.0));
      visit(x + 1, y);
      visit(x - 1, y);
      visit(x, y + 1);
      visit(x, y - 1);
    }
    if (gap.solid_angle_sr > kSmallestGap_sr)
      gaps.push_back(
          {glm::length(gap.middle) > 0 ? glm::normalize(gap.middle) : glm::dvec3(0, 0, 1), gap.solid_angle_sr});
  }
  std::ranges::sort(gaps, std::greater{}, &Gap::solid_angle_sr);
  return gaps;
}

void finish(Panorama& panorama, const SkyGeometry& geometry, std::span<const Texel> texels) {
  std::vector<float> known(texels.size(), 0.0f);
  double covered = 0, all = 0, over = 0, light = 0;
  for (std::size_t k = 0; k < texels.size(); ++k) {
    const Texel& t = texels[k];
    const auto part = static_cast<double>(geometry.solid_angle_sr()[k]);
    panorama.seen[k] = t.seen;
    panorama.radiance.texels[k] = t.weight > 0.0f ? glm::max(t.weighted / t.weight, 0.0f) : t.bound;
    known[k] = t.seen > 0 ? 1.0f : 0.0f;
    all += part;
    covered += t.seen > 0 ? part : 0.0;
    const double y = part * static_cast<double>(luminance(panorama.radiance.texels[k]));
    light += y;
    over += t.seen > 0 && t.weight == 0.0f ? y : 0.0;
  }
  panorama.coverage = covered / all;
  panorama.over_range = light > 0 ? over / light : 0.0;
  panorama.gaps = gaps_of(panorama, geometry);
  fill(panorama.radiance, known);
  for (std::size_t k = 0; k < texels.size(); ++k)
    if (!(geometry.solid_angle_sr()[k] > 0.0f))
      panorama.radiance.texels[k] = Rgb(0.0f);
}

} // namespace

Result<Panorama> merge_panorama(std::span<const HandHeldPicture> pictures, const SkyGeometry& geometry,
                                const Progress& progress) {
  const int width = geometry.width(), height = geometry.height();
  std::vector<Texel> texels(static_cast<std::size_t>(width) * height);
  const CodeNoise noise = usual_noise(8);
  std::vector<double> corner;
  for (const HandHeldPicture& p : pictures)
    corner.push_back(cosine_of_corner(p));
  const auto done = parallel_stage("map", static_cast<std::size_t>(height), 4, progress, [&](std::size_t y) {
    for (int x = 0; x < width; ++x) {
      const std::vector<glm::dvec3> directions = directions_of(geometry, x, static_cast<int>(y));
      if (directions.empty())
        continue;
      for (std::size_t i = 0; i < pictures.size(); ++i) {
        if (glm::dot(pictures[i].world_from_camera[2], directions.front()) < corner[i] - 0.02)
          continue;
        if (const auto view = view_of_texel(pictures[i], directions))
          add_view(texels[y * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)], pictures[i], *view,
                   noise);
      }
    }
  });
  if (!done)
    return done.error();
  Panorama panorama;
  panorama.radiance = RgbImage(width, height);
  panorama.seen.resize(texels.size());
  finish(panorama, geometry, texels);
  return panorama;
}

} // namespace daylit::calibration
