#include "runtime/indirect/room_patches.h"

#include <cmath>

#include <glm/geometric.hpp>

namespace daylit {

namespace {
constexpr double kPatch_m = RoomPatches::kSide_m;
constexpr double kWideCells = 2.0 * kCellFraction;
constexpr int kPatchPoints = 5; ///< per side: where a patch is looked for
constexpr int kAreaPoints = 10; ///< per side: by which its area is known
} // namespace

/// Of the patch's material.
bool RoomPatches::is_surface(const RoomPatch& patch, const glm::dvec3& point) const {
  RayHit below;
  return rays_.closest(rays_.to_local(point + kAirGap_m * patch.normal), glm::vec3(-patch.normal), 0.0f,
                       static_cast<float>(2.0 * kAirGap_m), below) &&
         room_.triangles[below.triangle].material == patch.material;
}

double RoomPatches::area_m2(const RoomPatch& patch) const {
  const RoomFacing& f = planes_[patch.cell.facing];
  int found = 0;
  for (int k = 0; k < kAreaPoints * kAreaPoints; ++k) {
    const double s = (k % kAreaPoints + 0.5) / kAreaPoints, t = (k / kAreaPoints + 0.5) / kAreaPoints;
    found += is_surface(patch, f.corner(patch.cell.i, patch.cell.j, kPatch_m) + kPatch_m * (s * f.u + t * f.v));
  }
  return kPatch_m * kPatch_m * std::max(found, 1) / (kAreaPoints * kAreaPoints);
}

std::vector<ApertureCell> RoomPatches::window_cells(double fraction) const {
  const glm::dvec3 middle = room_.bounds().empty() ? glm::dvec3(0.0) : room_.bounds().centre();
  return aperture_cells(visibility_.apertures(), {middle, 0.0}, pyramid_, fraction);
}

/// What is behind objects or seen in mirrors is not looked at closely.
void RoomPatches::set_frame(std::span<const SkyMap> pyramid) {
  pyramid_ = pyramid;
  windows_ = window_cells(kWideCells);
  ++frame_;
}

/// The middle of the patch, or else the first of some points around it, that lies on the room's surface and in its air.
RoomPatch* RoomPatches::at(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const std::uint32_t facing = planes_.facing_of(triangle, direction);
  const RoomFacing& f = planes_[facing];
  const LatticeKey cell{static_cast<std::int64_t>(std::floor(glm::dot(f.u, x) / kPatch_m)),
                        static_cast<std::int64_t>(std::floor(glm::dot(f.v, x) / kPatch_m)), facing};
  const std::uint32_t material = room_.triangles[triangle].material;
  const LatticeKey key{cell.i, cell.j, facing * static_cast<std::uint32_t>(room_.materials.size()) + material};
  if (const auto found = patches_.find(key); found != patches_.end())
    return found->second.get();
  auto made = std::make_unique<RoomPatch>();
  made->cell = cell;
  made->material = material;
  made->normal = f.normal;
  made->reflectance = room_.materials[material].reflectance;
  for (int k = 0; k < kPatchPoints * kPatchPoints && !made->lit; ++k) {
    const int step = (k + kPatchPoints * kPatchPoints / 2) % (kPatchPoints * kPatchPoints); // the middle first
    const double s = (step % kPatchPoints + 0.5) / kPatchPoints, t = (step / kPatchPoints + 0.5) / kPatchPoints;
    made->point = f.corner(cell.i, cell.j, kPatch_m) + kPatch_m * (s * f.u + t * f.v);
    const glm::dvec3 air = made->point + kAirGap_m * f.normal;
    if (!is_surface(*made, made->point))
      continue;
    made->probes = light_.probes_at(air);
    made->lit = made->probes.count > 0;
    made->visible = visibility_.visible_fraction(air, f.normal);
  }
  return patches_.emplace(key, std::move(made)).first->second.get();
}

/// E = E_indirect + V_window E_sky at the patch's point.
Rgb RoomPatches::irradiance(RoomPatch& patch) const {
  if (patch.lit && patch.frame.load(std::memory_order_acquire) != frame_) {
    const std::lock_guard lock(patch.renewing);
    if (patch.frame.load(std::memory_order_relaxed) != frame_) {
      const glm::vec3 n(patch.normal);
      patch.irradiance = light_.indirect_irradiance(patch.normal, patch.probes) +
                         patch.visible * open_sky_irradiance(pyramid_, windows_, {&patch.point, 1}, {&n, 1}).front();
      patch.frame.store(frame_, std::memory_order_release);
    }
  }
  return patch.irradiance;
}

} // namespace daylit
