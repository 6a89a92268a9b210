#include "runtime/indirect/lit_points.h"

#include "runtime/base/once.h"
#include "runtime/indirect/room_planes.h"

namespace daylit {

const RoomPoint& LitPoints::light(LitPoint& point, std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& n) {
  once(point.made, sky_, point.renewing, [&] {
    if (point.made == 0)
      point.at = {triangle, x, n, light_.probes_at(x + kAirGap_m * n)};
    if (!point.is_kept) {
      const std::lock_guard lock(adding_);
      points_.push_back(&point);
      point.is_kept = true;
    }
    const RoomLight::KnownPoint* at = &point.at;
    light_.evaluate({&at, 1}, windows_, {&point.light, 1});
  });
  if (point.asked_for.load(std::memory_order_relaxed) != sky_)
    point.asked_for.store(sky_, std::memory_order_relaxed);
  return point.light;
}

void LitPoints::sky_changed(std::span<const ApertureCell> windows) {
  const std::uint64_t former = sky_++;
  windows_ = windows;
  std::erase_if(points_, [&](LitPoint* p) { return !(p->is_kept = p->asked_for == former); });
  std::vector<const RoomLight::KnownPoint*> at;
  for (const LitPoint* p : points_)
    at.push_back(&p->at);
  std::vector<RoomPoint> light(points_.size());
  light_.evaluate(at, windows_, light);
  for (std::size_t k = 0; k < points_.size(); ++k) {
    points_[k]->light = light[k];
    points_[k]->made = sky_;
  }
}

} // namespace daylit
