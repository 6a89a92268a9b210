#include "scene/room/radiance_material.h"

#include <algorithm>

#include <fmt/format.h>

#include "scene/room/glass.h"

namespace daylit::detail {

namespace {

bool in_range(std::span<const double> values) {
  return std::ranges::all_of(values, [](double v) { return v >= 0.0 && v <= 1.0; });
}

/// Transmittance at normal incidence over that of the clear slab, for a transmissivity t of one passage:
/// T = t (1 - R)^2 / (1 - t^2 R^2), R = ((n - 1) / (n + 1))^2 (Born & Wolf, 1.5.2 and 7.6); 1 for t = 1.
double tint(double t, double index) {
  const double r = (index - 1.0) * (index - 1.0) / ((index + 1.0) * (index + 1.0));
  return t * (1.0 - r * r) / (1.0 - t * t * r * r);
}

Result<Material> pane(Material m, std::span<const double> a) {
  const double index = a.size() > 3 ? a[3] : kClearGlassIndex;
  if (!in_range(a.first(3)) || !(index >= 1.0 && index <= kLargestGlassIndex))
    return Error{ErrorCode::value_invalid, "transmissivity outside 0..1 or refractive index outside 1..4", m.name, ""};
  m.is_window = true;
  m.reflectance = Rgb(0.0f);
  m.transmittance = Rgb(glm::dvec3(tint(a[0], index), tint(a[1], index), tint(a[2], index)));
  m.refractive_index = static_cast<float>(index);
  return m;
}

} // namespace

Result<Material> radiance_material(const std::string& name, const std::string& type, std::span<const double> a) {
  Material m{.name = name, .is_window = false};
  if (type == "light" || type == "glow") {
    m.reflectance = Rgb(0.0f);
    return m;
  }
  const std::size_t needed = type == "glass" ? 3 : type == "plastic" || type == "metal" ? 5 : type == "trans" ? 7 : 0;
  if (needed == 0)
    return Error{ErrorCode::value_invalid, fmt::format("material \"{}\" is of type {}, which is not read", name, type),
                 "", "plastic, metal, trans, glass, light and glow are: replace it by the nearest of them"};
  if (a.size() < needed)
    return Error{ErrorCode::file_malformed, fmt::format("{} \"{}\" needs {} numbers", type, name, needed), "", ""};
  if (type == "glass")
    return pane(std::move(m), a);
  const glm::dvec3 colour(a[0], a[1], a[2]);
  const double glossy = a[3], passing = type == "trans" ? a[5] : 0.0;
  if (!in_range(a.first(4)) || !(passing >= 0.0 && passing <= 1.0))
    return Error{ErrorCode::value_invalid, fmt::format("{} \"{}\" has values outside 0..1", type, name), "", ""};
  m.reflectance = Rgb(type == "metal" ? colour : colour * (1.0 - glossy) * (1.0 - passing) + glossy);
  return m;
}

std::string left_out(const std::string& type, std::span<const double> a) {
  if (type == "light" || type == "glow")
    return "the light that it emits";
  if (type == "trans" && a.size() >= 7 && a[5] > 0.0)
    return fmt::format("the {:.0f} % of the light that pass it", 100.0 * a[5]);
  return {};
}

} // namespace daylit::detail
