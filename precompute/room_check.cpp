#include "precompute/room_check.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "precompute/adaptive_sky.h"
#include "precompute/cheaper_bake.h"
#include "precompute/detail/text_format.h"
#include "precompute/memory_need.h"
#include "precompute/planned_bake.h"
#include "precompute/room_frame.h"
#include "precompute/transport_model.h"
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
  std::string text = format("openings   %d windows (%.2f m2), %d holes (%.2f m2)\n",
                            check.survey.apertures.report.window_polygons, check.survey.apertures.report.window_area_m2,
                            check.survey.apertures.report.hole_polygons, check.survey.apertures.report.hole_area_m2);
  for (const CheckedOpening& o : check.openings)
    text += format("  %.2f m2 around (%.2f, %.2f, %.2f), light enters in direction (%.2f, %.2f, %.2f)\n", o.area_m2,
                   o.centre_m.x, o.centre_m.y, o.centre_m.z, o.inward.x + 0.0, o.inward.y + 0.0, o.inward.z + 0.0);
  if (check.survey.apertures.report.unexplained_escape > 0)
    text += format("  %.2f %% of the test rays leave through gaps without an outline\n",
                   100 * check.survey.apertures.report.unexplained_escape);
  return text;
}

constexpr std::size_t kGapsShown = 10;

/// The largest ones, one to a line.
std::string gap_lines(const Gaps& gaps) {
  std::string text;
  if (!gaps.list.empty())
    text = format("gaps       %zu, %.2f m long (%.4f m2)\n", gaps.list.size(), gaps.length_m, gaps.area_m2);
  for (std::size_t i = 0; i < std::min(gaps.list.size(), kGapsShown); ++i) {
    const Gap& g = gaps.list[i];
    text += format("  %.1f mm wide from (%.2f, %.2f, %.2f) to (%.2f, %.2f, %.2f)\n", 1e3 * g.widest_m, g.corners[0].x,
                   g.corners[0].y, g.corners[0].z, g.corners[1].x, g.corners[1].y, g.corners[1].z);
  }
  return text;
}

/// What the bake's own lines will say.
std::string estimate_line(const BakeEstimate& e) {
  const Prediction& p = e.plan.predicted;
  return format(
      "bake       %zu facets, %zu of %zu probes with light of their own, %s: about %.1f s, %.2g GB of memory, a "
      "file of %.1f MB, error %.2g %%\n",
      e.counts.facets, e.counts.probes_valid, e.counts.probes, e.plan.regions.c_str(), p.seconds,
      e.counts.memory_bytes / 1e9, p.bytes / 1e6, 100 * p.total);
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

Result<BakeEstimate> estimate_bake(const RoomFile& room, const Progress& progress) {
  const auto memory = allowed_memory(0);
  if (!memory)
    return memory.error();
  auto planned = plan_bake(room, {}, progress);
  if (!planned)
    return planned.error();
  const auto sky = sky_for(room, planned->plan.regions, progress);
  if (!sky)
    return sky.error();
  auto counts = count_room_bake(room, *sky, planned->plan.options);
  if (!counts)
    return counts.error();
  if (const Result<void> fits = check_memory(counts->memory_bytes, *memory); !fits)
    return fits.error();
  const auto cheaper = cheaper_text(room, *planned, progress);
  if (!cheaper)
    return cheaper.error();
  return BakeEstimate{std::move(planned->plan), std::move(*counts), *cheaper};
}

/// Goes through the steps of a bake; the first that fails is the problem.
std::optional<Error> find_problem(RoomFile& file, double close_gaps_m, RoomCheck& check, const Progress& progress) {
  const Result<void> surveyed = survey_room(file, close_gaps_m, check.survey);
  for (const Aperture& a : check.survey.apertures.list)
    check.openings.push_back(describe(a));
  if (!surveyed)
    return surveyed.error();
  const auto model = transport_model(file);
  if (!model)
    return model.error();
  auto estimate = estimate_bake(*model, progress);
  if (!estimate)
    return estimate.error();
  check.estimate = std::move(*estimate);
  return std::nullopt;
}

} // namespace

Result<RoomCheck> check_room(const std::filesystem::path& path, UpAxis up, double close_gaps_m,
                             const Progress& progress) {
  auto file = read_room(path, up);
  if (!file)
    return file.error();
  RoomCheck check;
  check.file = path.string();
  check.bounds = file->room.bounds();
  check.materials = list_materials(file->room);
  check.problem = find_problem(*file, close_gaps_m, check, progress);
  check.faces = file->report;
  check.room = std::move(file->room);
  if (check.problem && check.problem->code == ErrorCode::interrupted)
    return *check.problem;
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
  text += gap_lines(check.survey.gaps);
  if (check.estimate)
    text += estimate_line(*check.estimate) + check.estimate->cheaper;
  for (const std::string& note : check.faces.notes)
    text += "note       " + note + "\n";
  for (const std::string& note : check.survey.apertures.report.notes)
    text += "note       " + note + "\n";
  for (const std::string& question : check.survey.questions)
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
  j["openings"] = {{"windows", check.survey.apertures.report.window_polygons},
                   {"window_area_m2", check.survey.apertures.report.window_area_m2},
                   {"holes", check.survey.apertures.report.hole_polygons},
                   {"hole_area_m2", check.survey.apertures.report.hole_area_m2},
                   {"unexplained_escape", check.survey.apertures.report.unexplained_escape}};
  j["openings"]["list"] = nlohmann::ordered_json::array();
  for (const CheckedOpening& o : check.openings)
    j["openings"]["list"].push_back({{"area_m2", o.area_m2},
                                     {"centre_m", triple(o.centre_m)},
                                     {"inward", triple(o.inward)},
                                     {"transmittance", triple(glm::dvec3(o.transmittance))}});
  j["gaps"] = {{"count", check.survey.gaps.list.size()}, {"length_m", check.survey.gaps.length_m},
               {"widest_m", check.survey.gaps.widest_m}, {"area_m2", check.survey.gaps.area_m2},
               {"light", check.survey.gap_light},        {"list", nlohmann::ordered_json::array()}};
  for (const Gap& gap : check.survey.gaps.list)
    j["gaps"]["list"].push_back(
        {{"from_m", triple(gap.corners[0])}, {"to_m", triple(gap.corners[1])}, {"widest_m", gap.widest_m}});
  if (const auto& e = check.estimate)
    j["estimate"] = {{"facets", e->counts.facets},
                     {"patches", e->counts.patches},
                     {"elements", e->counts.elements},
                     {"probes", e->counts.probes},
                     {"probes_in_air", e->counts.probes_valid + e->counts.probes_interpolated},
                     {"regions", e->plan.regions},
                     {"seconds", e->plan.predicted.seconds},
                     {"file_bytes", e->plan.predicted.bytes},
                     {"form_factor_bytes", e->counts.exchange.bytes},
                     {"memory_bytes", e->counts.memory_bytes},
                     {"error", e->plan.predicted.total}};
  std::vector<std::string> notes = check.faces.notes;
  notes.insert(notes.end(), check.survey.apertures.report.notes.begin(), check.survey.apertures.report.notes.end());
  j["notes"] = notes;
  j["questions"] = check.survey.questions;
  j["can_be_baked"] = !check.problem;
  if (check.problem)
    j["problem"] = check.problem->message();
  return j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

} // namespace daylit::precompute
