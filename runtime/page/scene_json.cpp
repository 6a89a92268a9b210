#include "runtime/page/scene_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

namespace daylit {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostProbes = 400; ///< that a tablet draws well
constexpr int kEdgeSteps = 16;

Json triple(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

/// Numbers as short as they may be: four digits are a tenth of a per mille.
class NumberList {
public:
  template <class T>
  void add(const T& v) {
    for (int k = 0; k < v.length(); ++k)
      fmt::format_to(std::back_inserter(text_), "{}{:.5g}", text_.empty() ? "" : ",", v[k]);
  }
  std::string json() const { return "[" + text_ + "]"; }

private:
  std::string text_;
};

/// A tenth of the probes of a fine grid look like all of them: every n-th along each axis, or of free points.
std::vector<std::size_t> shown_probes(const ProbeSet& probes) {
  std::vector<std::size_t> shown;
  for (int step = 1;; ++step) {
    shown.clear();
    for (std::size_t i = 0; i < probes.size(); ++i) {
      const auto nx = static_cast<std::size_t>(probes.count.x), ny = static_cast<std::size_t>(probes.count.y),
                 s = static_cast<std::size_t>(step);
      const bool on_step =
          probes.is_grid ? i % nx % s == s / 2 && i / nx % ny % s == s / 2 && i / (nx * ny) % s == s / 2 : i % s == 0;
      if (on_step && probes.valid[i])
        shown.push_back(i);
    }
    if (shown.size() <= kMostProbes)
      return shown;
  }
}

/// The outline of a window as the object sees it, in pixels of the sky picture; in pieces where the lens ends.
Json outline_in_sky(const Aperture& window, const glm::dvec3& from, const SkyGeometry& sky) {
  Json pieces = Json::array(), piece = Json::array();
  const auto end_piece = [&] {
    if (piece.size() > 1)
      pieces.push_back(piece);
    piece = Json::array();
  };
  const std::size_t n = window.corners.size();
  for (std::size_t k = 0; k < n; ++k)
    for (int step = 0; step <= kEdgeSteps; ++step) {
      const double t = static_cast<double>(step) / kEdgeSteps;
      const glm::dvec3 at = glm::mix(window.corners[k], window.corners[(k + 1) % n], t);
      if (const auto pixel = sky.pixel(glm::normalize(at - from)))
        piece.push_back({pixel->x, pixel->y});
      else
        end_piece();
    }
  end_piece();
  return pieces;
}

Json lights_json(const std::vector<DirectionalLight>& lights, const SkyGeometry& sky) {
  Json list = Json::array();
  for (const DirectionalLight& light : lights)
    if (const auto pixel = sky.pixel(light.direction))
      list.push_back({pixel->x, pixel->y});
  return list;
}

/// The outline of a region in the sky picture as an SVG path; in pieces where the lens ends.
void add_outline(std::string& path, const SkyPartition& partition, int region, const SkyGeometry& sky) {
  constexpr std::array<glm::dvec2, 5> kCorners{{{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}}};
  const bool all_around = glm::distance(partition.sample(region, 0, 0.5), partition.sample(region, 1, 0.5)) < 1e-6;
  const int steps =
      std::clamp(static_cast<int>(40.0 * std::sqrt(partition.solid_angle_sr(region))), all_around ? 8 : 1, 48);
  bool on_line = false;
  for (int k = 0; k <= 4 * steps; ++k) {
    const int edge = std::min(k / steps, 3);
    if (all_around && edge % 2 == 1 && k != steps && k != 3 * steps) { // where its first and last azimuth meet
      on_line = false;
      continue;
    }
    const glm::dvec2 at =
        glm::mix(kCorners[static_cast<std::size_t>(edge)], kCorners[static_cast<std::size_t>(edge) + 1],
                 static_cast<double>(k - edge * steps) / steps);
    const auto pixel = sky.pixel(partition.sample(region, at.x, at.y));
    if (pixel)
      fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", on_line ? 'L' : 'M', pixel->x, pixel->y);
    on_line = pixel.has_value();
  }
}

/// Where the window cone and the samples are seen from: the middle of the first object, else of the room.
glm::dvec3 view_point(const Session& session) {
  const BoundingSphere sphere = session.object_bounds(0);
  return sphere.radius > 0 ? sphere.centre : session.volume().room.bounds().centre();
}

} // namespace

std::string objects_json(const Session& session, const ShownParts& shown,
                         const std::vector<std::filesystem::path>& models) {
  Json objects = Json::array(), names = Json::array();
  for (std::size_t k = 0; k < session.placements().size(); ++k) {
    const ObjectConfig& o = session.placements()[k];
    const BoundingSphere sphere = session.object_bounds(k);
    objects.push_back({{"name", o.model.filename().string()},
                       {"position", triple(o.position)},
                       {"rotation", triple(o.rotation_deg)},
                       {"scale", o.scale},
                       {"stands", o.on.has_value()},
                       {"centre", triple(sphere.centre)},
                       {"radius", sphere.radius}});
  }
  for (const auto& model : models)
    names.push_back(model.filename().string());
  const RenderCamera& camera = session.camera();
  const glm::dmat4& pose = camera.world_from_camera;
  return Json{{"objects", objects},
              {"models", names},
              {"shown", {{"direct", shown.direct}, {"indirect", shown.indirect}, {"differential", shown.differential}}},
              {"photo", {camera.photo_width_px, camera.photo_height_px}},
              {"camera",
               {{"eye", triple(glm::dvec3(pose[3]))},
                {"right", triple(glm::dvec3(pose[0]))},
                {"down", triple(glm::dvec3(pose[1]))},
                {"forward", triple(glm::dvec3(pose[2]))},
                {"height_rad", 2 * std::atan(0.5 * camera.height_px / camera.fy)}}}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string room_json(const Session& session) {
  const Room& room = session.volume().room;
  const ProbeSet& probes = session.volume().probes;
  NumberList corners, colours, probe_places;
  for (const RoomTriangle& t : room.triangles) {
    if (room.is_window(t))
      continue;
    for (int k = 0; k < 3; ++k)
      corners.add(room.corner(t, k));
    colours.add(room.material(t).reflectance);
  }
  Json windows = Json::array();
  for (const Aperture& window : session.volume().apertures) {
    windows.push_back(Json::array());
    for (const glm::dvec3& corner : window.corners)
      windows.back().push_back(triple(corner));
  }
  for (const std::size_t k : shown_probes(probes))
    probe_places.add(probes.origin + glm::dvec3(probes.positions[k]));
  const Bounds bounds = room.bounds();
  return fmt::format(R"({{"corners":{},"colours":{},"windows":{},"probes":{},"low":{},"high":{}}})", corners.json(),
                     colours.json(), windows.dump(), probe_places.json(), triple(bounds.min).dump(),
                     triple(bounds.max).dump());
}

std::string regions_json(const Session& session, const SkyImage& sky) {
  const SkyPartition& partition = session.volume().partition;
  const std::vector<std::uint8_t> counts = regions_that_count(session.volume());
  std::string path;
  for (int region = 0; region < partition.size(); ++region)
    if (counts[static_cast<std::size_t>(region)] != 0)
      add_outline(path, partition, region, *sky.geometry());
  return fmt::format(R"({{"count":{},"of":{},"path":"{}"}})", std::count(counts.begin(), counts.end(), 1),
                     partition.size(), path);
}

std::string light_json(const Session& session, const SkyImage& sky) {
  const SkyGeometry& geometry = *sky.geometry();
  NumberList probes;
  for (const std::size_t k : shown_probes(session.volume().probes))
    for (const Rgb& coefficient : session.light_field().probe[k])
      probes.add(coefficient);
  Json windows = Json::array();
  for (const Aperture& window : session.volume().apertures)
    for (Json& piece : outline_in_sky(window, view_point(session), geometry))
      windows.push_back(std::move(piece));
  const LightSet& lights = session.lights();
  const Json sun = lights.sun.empty() ? Json() : triple(lights.sun.front().direction);
  return fmt::format(R"({{"probes":{},"size":[{},{}],"windows":{},"sky_samples":{},"sun_samples":{},"sun":{}}})",
                     probes.json(), geometry.width(), geometry.height(), windows.dump(),
                     lights_json(lights.sky, geometry).dump(), lights_json(lights.sun, geometry).dump(), sun.dump());
}

} // namespace daylit
