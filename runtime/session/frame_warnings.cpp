#include "runtime/session/frame_warnings.h"

namespace daylit {

std::vector<std::string> frame_warnings(const FrameState& s) {
  std::vector<std::string> warnings;
  if (s.vertices > 0 && s.vertices_outside == s.vertices)
    warnings.emplace_back(
        "the objects lie outside the room or inside furniture: they get no indirect light; move them, "
        "or check [[object]] position");
  else if (s.vertices_outside > 0)
    warnings.push_back(std::to_string(s.vertices_outside) + " of " + std::to_string(s.vertices) +
                       " object vertices lie outside the room or inside furniture: they take the indirect light of "
                       "their neighbours; move the object if that part can be seen");
  if (s.camera_among_objects)
    warnings.emplace_back(
        "the camera stands among the objects: what is nearer than 1 cm is not drawn; move one of them");
  if (s.object_pixels == 0)
    warnings.emplace_back("no pixel shows an object: check its position, the camera's pose and what stands before it");
  if (s.sky_black)
    warnings.emplace_back("the sky is black: no light to draw with; check [sky] image");
  else if (s.lights == 0)
    warnings.emplace_back(
        "no window lets light through to the objects: they get indirect light only; check [room] model");
  return warnings;
}

std::vector<std::string> skipped_exactly(const BasisVolume& volume, std::size_t room_occluders) {
  std::vector<std::string> skipped;
  if (room_occluders == 0)
    skipped.emplace_back("shadows of the room: nothing in it stands between the object and the windows (exact)");
  const int regions = volume.partition.size(), stored = static_cast<int>(volume.stored_region.size());
  if (!volume.compact && stored < regions)
    skipped.push_back(std::to_string(regions - stored) + " of " + std::to_string(regions) +
                      " sky regions: no window sees them (exact)");
  return skipped;
}

} // namespace daylit
