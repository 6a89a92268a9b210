#include "precompute/room_check.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "precompute/cost_model.h"
#include "precompute/detail/text_format.h"
#include "precompute/planned_bake.h"
#include "precompute/room_frame.h"
#include "scene/room/glass.h"

namespace daylit::precompute {

namespace {

using detail::format;

/// Reflectance of walls, transmittance of panes, areas in m^2.
std::string material_lines(const std::vector<CheckedMaterial>& materials) {
  std::string text;
  for (const CheckedMaterial& m : materials) {
    const Rgb& c = m.is_window ? m.transmittance : m.reflectance;
    const std::string glass = m.refractive_index > 0.0f ? ", times " + pane_model_name(m.refractive_index) : "";
    text +=
        format("  %-20s %s %.2f %.2f %.2f   %8.2f m2, %zu triangles%s\n", m.name.empty() ? "(none)" : m.name.c_str(),
               m.is_window ? "window, lets through" : "reflects            ", static_cast<double>(c.r),
               static_cast<double>(c.g), static_cast<double>(c.b), m.area_m2, m.triangles, glass.c_str());
  }
  return text;
}

/// Windows and holes that were found, metres.
std::string opening_lines(const RoomCheck& check) {
  std::string text =
      format("openings   %d windows (%.2f m2), %d holes (%.2f m2)\n", check.apertures.window_polygons,
             check.apertures.window_area_m2, check.apertures.hole_polygons, check.apertures.hole_area_m2);
  for (const CheckedOpening& o : check.openings)
    text += format("  %.2f m2 around (%.2f, %.2f, %.2f), light enters in direction (%.2f, %.2f, %.2f)\n", o.area_m2,
                   o.centre_m.x, o.centre_m.y, o.centre_m.z, o.inward.x + 0.0, o.inward.y + 0.0, o.inward.z + 0.0);
  if (check.apertures.unexplained_escape > 0)
    text += format("  %.2f %% of the test rays leave through gaps without an outline\n",
                   100 * check.apertures.unexplained_escape);
  return text;
}

/// What the bake's own lines will say.
std::string estimate_line(const BakeEstimate& e) {
  const Prediction& p = e.plan.predicted;
  return format("bake       %zu facets, %zu of %zu probes in the air, %s: about %.1f s, a file of %.1f MB, %.0f MB of "
                "form factors in memory, error %.2g %%\n",
                e.counts.facets, e.counts.probes_valid, e.counts.probes, e.plan.regions.c_str(), p.seconds,
                p.bytes / 1e6, static_cast<double>(e.counts.exchange.bytes) / 1e6, 100 * p.total);
}

nlohmann::ordered_json triple(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

/// Materials in use, with the sum of the areas of their triangles, m^2.
std::vector<CheckedMaterial> list_materials(const Room& room) {
  std::vector<CheckedMaterial> out;
  for (const Material& m : room.materials)
    out.push_back({m.name, m.reflectance, m.transmittance, m.refractive_index, m.is_window, 0, 0.0});
  for (const RoomTriangle& t : room.triangles) {
    ++out[t.material].triangles;
    out[t.material].area_m2 += area_m2(room, t);
  }
  std::erase_if(out, [](const CheckedMaterial& m) { return m.triangles == 0; });
  return out;
}

/// Area |sum of cross products of the fan| / 2, m^2, and mean of the corners.
CheckedOpening describe(const Aperture& aperture) {
  CheckedOpening out{0.0, glm::dvec3(0.0), aperture.inward, aperture.transmittance};
  glm::dvec3 twice_area(0.0);
  for (std::size_t i = 1; i + 1 < aperture.corners.size(); ++i)
    twice_area += glm::cross(aperture.corners[i] - aperture.corners[0], aperture.corners[i + 1] - aperture.corners[0]);
  for (const glm::dvec3& corner : aperture.corners)
    out.centre_m += corner / static_cast<double>(aperture.corners.size());
  out.area_m2 = 0.5 * glm::length(twice_area);
  return out;
}

constexpr double kLongest_m = 1000.0;

std::string metres(double value) { return detail::format("%.2f m", value); }

void check_size(const Bounds& bounds, std::vector<std::string>& questions) {
  const glm::dvec3 size = bounds.size();
  const double longest = std::max({size.x, size.y, size.z});
  if (longest > 100)
    questions.push_back("the room is " + metres(longest) +
                        " long: is the model in metres? Models in centimetres or millimetres must be scaled");
  else if (longest < 1)
    questions.push_back("the room is only " + metres(longest) + " long: is the model in metres?");
  if (size.z > 2 * std::max(size.x, size.y) || (size.y < 0.7 * size.z && size.y > 1.8 && size.z > 4.5))
    questions.push_back("the height (z) is " + metres(size.z) + " for " + metres(size.x) + " x " + metres(size.y) +
                        ": is z up? Otherwise use --up y");
}

void check_materials(const std::vector<CheckedMaterial>& materials, std::vector<std::string>& questions) {
  for (const CheckedMaterial& m : materials) {
    const float brightest = std::max({m.reflectance.r, m.reflectance.g, m.reflectance.b});
    if (!m.is_window && brightest > 0.95f)
      questions.push_back("material \"" + m.name + "\" reflects more than 95 %: fresh white paint has about 85 %");
    if (!m.is_window && brightest == 0.0f)
      questions.push_back("material \"" + m.name + "\" is perfectly black: is its Kd missing?");
    if (m.is_window && std::max({m.transmittance.r, m.transmittance.g, m.transmittance.b}) <= 0.0f)
      questions.push_back("window \"" + m.name + "\" lets no light through: check its Tf");
  }
}

Result<BakeEstimate> estimate_bake(const RoomFile& room, const Progress& progress) {
  auto planned = plan_bake(room, {}, progress);
  if (!planned)
    return planned.error();
  const bool fine = SkyKind::of(planned->plan.regions).nodes;
  auto counts = count_room_bake(room, fine, planned->plan.options);
  if (!counts)
    return counts.error();
  return BakeEstimate{std::move(planned->plan), std::move(*counts)};
}

/// Goes through the steps of a bake; the first that fails is the problem.
std::optional<Error> find_problem(const RoomFile& file, RoomCheck& check, const Progress& progress) {
  const Room& room = file.room;
  if (const auto fits = check_extent(room); !fits)
    return fits.error();
  const auto scene = RayScene::build(room);
  if (!scene)
    return scene.error();
  const auto apertures = find_apertures(room, *scene);
  if (!apertures)
    return apertures.error();
  check.apertures = apertures->report;
  for (const Aperture& a : apertures->list)
    check.openings.push_back(describe(a));
  if (apertures->report.unexplained_escape > 0.001)
    check.questions.emplace_back("rays leave through gaps without an outline: are walls missing or not joined?");
  auto estimate = estimate_bake(file, progress);
  if (!estimate)
    return estimate.error();
  check.estimate = std::move(*estimate);
  return std::nullopt;
}

} // namespace

/// A kilometre is more than any room: what is longer was drawn in other units.
Result<void> check_extent(const Room& room) {
  const Bounds bounds = room.bounds();
  const glm::dvec3 size = bounds.empty() ? glm::dvec3(0.0) : bounds.size();
  const double longest = std::max({size.x, size.y, size.z});
  if (longest > kLongest_m)
    return Error{ErrorCode::value_invalid, "the room is " + metres(longest) + " long", "room",
                 "the model must be in metres: scale it from millimetres or centimetres"};
  return {};
}

Result<RoomCheck> check_room(const std::filesystem::path& path, UpAxis up, const Progress& progress) {
  const auto file = read_room(path, up);
  if (!file)
    return file.error();
  RoomCheck check;
  check.file = path.string();
  check.faces = file->report;
  check.bounds = file->room.bounds();
  check.materials = list_materials(file->room);
  check_size(check.bounds, check.questions);
  check_materials(check.materials, check.questions);
  check.problem = find_problem(*file, check, progress);
  if (check.problem && check.problem->code == ErrorCode::interrupted)
    return *check.problem;
  if (const auto clean = refuse_dropped_faces(file->report, path); !check.problem && !clean)
    check.problem = clean.error();
  if (check.problem && (check.problem->where.empty() || check.problem->where == "room"))
    check.problem->where = check.file;
  return check;
}

std::string to_text(const RoomCheck& check) {
  const glm::dvec3 size = check.bounds.size(), low = check.bounds.min;
  std::string text = check.file + "\n";
  text += format("size       %.2f x %.2f x %.2f m (x, y, z up), lowest corner (%.2f, %.2f, %.2f)\n", size.x, size.y,
                 size.z, low.x, low.y, low.z);
  text += format("faces      %zu read, %zu without area, %zu duplicate\n", check.faces.faces_read,
                 check.faces.zero_area_faces, check.faces.duplicate_faces);
  text += "materials\n" + material_lines(check.materials);
  text += opening_lines(check);
  if (check.estimate)
    text += estimate_line(*check.estimate);
  for (const std::string& note : check.faces.notes)
    text += "note       " + note + "\n";
  for (const std::string& note : check.apertures.notes)
    text += "note       " + note + "\n";
  for (const std::string& question : check.questions)
    text += "question   " + question + "\n";
  text += check.problem ? "verdict    cannot be baked\n" : "verdict    can be baked\n";
  return text;
}

std::string to_json(const RoomCheck& check) {
  nlohmann::ordered_json j;
  j["room"] = check.file;
  j["bounds_m"] = {{"min", triple(check.bounds.min)}, {"max", triple(check.bounds.max)}};
  j["faces"] = {{"read", check.faces.faces_read},
                {"zero_area", check.faces.zero_area_faces},
                {"duplicate", check.faces.duplicate_faces}};
  j["materials"] = nlohmann::ordered_json::array();
  for (const CheckedMaterial& m : check.materials)
    j["materials"].push_back({{"name", m.name},
                              {"window", m.is_window},
                              {"reflectance", triple(glm::dvec3(m.reflectance))},
                              {"transmittance", triple(glm::dvec3(m.transmittance))},
                              {"pane_model", m.is_window ? pane_model_name(m.refractive_index) : "none"},
                              {"triangles", m.triangles},
                              {"area_m2", m.area_m2}});
  j["openings"] = {{"windows", check.apertures.window_polygons},
                   {"window_area_m2", check.apertures.window_area_m2},
                   {"holes", check.apertures.hole_polygons},
                   {"hole_area_m2", check.apertures.hole_area_m2},
                   {"unexplained_escape", check.apertures.unexplained_escape}};
  j["openings"]["list"] = nlohmann::ordered_json::array();
  for (const CheckedOpening& o : check.openings)
    j["openings"]["list"].push_back({{"area_m2", o.area_m2},
                                     {"centre_m", triple(o.centre_m)},
                                     {"inward", triple(o.inward)},
                                     {"transmittance", triple(glm::dvec3(o.transmittance))}});
  if (const auto& e = check.estimate)
    j["estimate"] = {{"facets", e->counts.facets},
                     {"patches", e->counts.patches},
                     {"elements", e->counts.elements},
                     {"probes", e->counts.probes},
                     {"probes_in_air", e->counts.probes_valid},
                     {"regions", e->plan.regions},
                     {"seconds", e->plan.predicted.seconds},
                     {"file_bytes", e->plan.predicted.bytes},
                     {"form_factor_bytes", e->counts.exchange.bytes},
                     {"error", e->plan.predicted.total}};
  std::vector<std::string> notes = check.faces.notes;
  notes.insert(notes.end(), check.apertures.notes.begin(), check.apertures.notes.end());
  j["notes"] = notes;
  j["questions"] = check.questions;
  j["can_be_baked"] = !check.problem;
  if (check.problem)
    j["problem"] = check.problem->message();
  return j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

} // namespace daylit::precompute
