#include "scene/sky/direct_sky.h"

#include <algorithm>
#include <optional>

#include <glm/geometric.hpp>

#include "scene/room/cone.h"
#include "scene/room/window_view.h"

namespace daylit {

namespace {

constexpr double kCell_sr = 2e-4;          // 1.4 hundredths of a radian across
constexpr float kBrightOverMean = 20.0f;   // the cap; skies without a sun stay below it
constexpr std::size_t kMostBright = 16384; // brightest first; a picture with more is no sun
constexpr int kSunSides = 64;

/// The texel as a cone: its corners, or a small disc of its solid angle where the field of the lens cuts it.
detail::Cone texel_cone(const SkyImage& image, std::size_t index) {
  const auto width = static_cast<std::size_t>(image.image().width);
  const glm::dvec2 middle(static_cast<double>(index % width), static_cast<double>(index / width));
  detail::Cone cone;
  for (const glm::dvec2& corner : {glm::dvec2(-0.5, -0.5), {-0.5, 0.5}, {0.5, 0.5}, {0.5, -0.5}})
    if (const std::optional<glm::dvec3> d = image.direction(middle + corner))
      cone.push_back(*d);
  if (cone.size() == 4)
    cone = detail::cone_of(cone, glm::dvec3(0.0));
  if (cone.size() >= 3)
    return cone;
  const std::optional<glm::dvec3> d = image.direction(middle);
  const double radius = std::sqrt(static_cast<double>(image.solid_angle_sr()[index]) / 3.14159265358979);
  return d && radius > 0.0 ? detail::cone_of_disc(*d, std::min(radius, 0.5), 8) : detail::Cone{};
}

} // namespace

DirectSky::DirectSky(const Room& room, const std::vector<Aperture>& apertures, const RayScene& scene, const Sky& sky)
    : room_(room), apertures_(apertures), scene_(scene), sky_(sky) {
  if (sky.image())
    find_bright_texels(*sky.image());
  // The sun: E_n = L times the projected area of the cone that stands for its disc.
  if (const std::optional<SunDisc>& sun = sky.sun()) {
    BrightSpot spot{detail::cone_of_disc(sun->direction, sun->angular_radius, kSunSides), {}};
    const double facing = glm::dot(detail::vector_area(spot.cone), sun->direction);
    spot.radiance = glm::dvec3(sun->normal_irradiance) / facing;
    bright_.push_back(std::move(spot));
  }
}

/// Texels above the cap of 20 times the mean luminance become cones of their own: L (1 - cap/luminance), so that the
/// capped picture and the cones together have the energy of the picture; scaled by solid angle of texel over cone.
void DirectSky::find_bright_texels(const SkyImage& image) {
  double sum = 0.0, area = 0.0;
  const std::vector<Rgb>& texels = image.image().texels;
  const std::vector<float>& weight = image.solid_angle_sr();
  for (std::size_t i = 0; i < texels.size(); ++i) {
    sum += static_cast<double>(weight[i]) * static_cast<double>(luminance(texels[i]));
    area += static_cast<double>(weight[i]);
  }
  const float cap = area > 0.0 ? kBrightOverMean * static_cast<float>(sum / area) : 0.0f;
  std::vector<std::size_t> bright;
  for (std::size_t i = 0; i < texels.size(); ++i)
    if (weight[i] > 0.0f && luminance(texels[i]) > cap)
      bright.push_back(i);
  if (bright.empty())
    return;
  cap_ = cap;
  std::stable_sort(bright.begin(), bright.end(),
                   [&](std::size_t a, std::size_t b) { return luminance(texels[a]) > luminance(texels[b]); });
  if (bright.size() > kMostBright) {
    cap_ = luminance(texels[bright[kMostBright]]);
    bright.resize(kMostBright);
  }
  for (const std::size_t i : bright) {
    BrightSpot spot{texel_cone(image, i),
                    glm::dvec3(texels[i]) * static_cast<double>(1.0f - cap_ / luminance(texels[i]))};
    if (spot.cone.empty())
      continue;
    spot.radiance *= static_cast<double>(weight[i]) / detail::solid_angle_sr(spot.cone);
    bright_.push_back(std::move(spot));
  }
}

/// E = integral of L cos over what is visible = sum over cells of L at the cell's middle times its vector area dotted
/// with the normal (Lambert 1760), plus the visible parts of the bright spots.
Rgb DirectSky::irradiance(const glm::dvec3& point, const glm::dvec3& unit_normal) const {
  const WindowView view(room_, apertures_, scene_, point, unit_normal);
  glm::dvec3 sum(0.0);
  for (const SkyCell& cell : view.cells(kCell_sr)) {
    Rgb radiance = sky_.radiance(cell.direction);
    if (const float l = luminance(radiance); cap_ > 0.0f && l > cap_)
      radiance *= cap_ / l;
    sum += cell.weight * glm::dvec3(radiance);
  }
  for (const BrightSpot& spot : bright_)
    for (const SkyCell& cell : view.cells_within(spot.cone))
      sum += cell.weight * spot.radiance;
  return Rgb(sum);
}

} // namespace daylit
