#include <nlohmann/json.hpp>

#include "precompute/detail/text_format.h"
#include "precompute/room_check.h"
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

nlohmann::ordered_json triple(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

} // namespace

std::string to_text(const RoomCheck& check) {
  const glm::dvec3 size = check.bounds.size(), low = check.bounds.min;
  std::string text = check.file + "\n";
  text += format("size       %.2f x %.2f x %.2f m (x, y, z up), lowest corner (%.2f, %.2f, %.2f)\n", size.x, size.y,
                 size.z, low.x, low.y, low.z);
  text += format("faces      %zu read, %zu without area, %zu duplicate\n", check.faces.faces_read,
                 check.faces.zero_area_faces, check.faces.duplicate_faces);
  text += "materials\n" + material_lines(check.materials);
  text += opening_lines(check);
  if (!check.problem)
    text +=
        format("bake       %zu facets, %zu of %zu probes in the air, about %.1f s on two cores, %.2f GB of memory\n",
               check.estimate.facets, check.estimate.probes_in_air, check.estimate.probes, check.estimate.seconds,
               check.estimate.memory_gb);
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
  if (!check.problem)
    j["estimate"] = {{"facets", check.estimate.facets},
                     {"patches", check.estimate.patches},
                     {"probes", check.estimate.probes},
                     {"probes_in_air", check.estimate.probes_in_air},
                     {"seconds_two_cores", check.estimate.seconds},
                     {"memory_gb", check.estimate.memory_gb}};
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
