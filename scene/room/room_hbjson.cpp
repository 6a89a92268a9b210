#include "scene/room/room_hbjson.h"

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/room/detail/hbjson_modifiers.h"
#include "scene/room/face_collector.h"
#include "scene/room/polygon.h"
#include "scene/room/polygon_holes.h"

namespace daylit {

namespace {

using Json = nlohmann::json;
using Loop = std::vector<glm::dvec3>;
using detail::member;
using detail::text_in;

constexpr std::size_t kMostCorners = 1024, kMostFaces = 1'000'000;
constexpr double kLargest_m = 1e9;
constexpr double kWhole = 0.999; // an aperture of this part of its face leaves no wall

double unit_m(const std::string& units) {
  static const std::map<std::string, double> known = {
      {"Meters", 1.0}, {"Millimeters", 1e-3}, {"Centimeters", 1e-2}, {"Feet", 0.3048}, {"Inches", 0.0254}};
  const auto found = known.find(units.empty() ? "Meters" : units);
  return found == known.end() ? 0.0 : found->second;
}

bool is_between_rooms(const Json& part) { return text_in(member(part, "boundary_condition"), "type") == "Surface"; }

/// The part of the other room that is the same wall; "" where there is none.
std::string partner_of(const Json& part) {
  const Json& ids = member(member(part, "boundary_condition"), "boundary_condition_objects");
  return is_between_rooms(part) && ids.is_array() && !ids.empty() && ids[0].is_string() ? ids[0].get<std::string>()
                                                                                        : "";
}

class HbjsonRoom {
public:
  HbjsonRoom(const Json& model, const std::string& name)
      : model_(model), name_(name), modifiers_(member(member(model, "properties"), "radiance")) {}

  Result<RoomFile> run() {
    if (text_in(model_, "type") != "Model")
      return wrong("this is not the JSON of a Honeybee model", "");
    unit_m_ = unit_m(text_in(model_, "units"));
    if (!(unit_m_ > 0.0))
      return wrong("unknown units \"" + text_in(model_, "units").substr(0, 40) + "\"", "");
    if (const Result<void> done = add_all(); !done)
      return done.error();
    file_.report.counted_in_faces = true;
    file_.report.notes = modifiers_.notes;
    if (open_ > 0)
      file_.report.notes.push_back(fmt::format("{} air boundaries are open", open_));
    file_.room.vertices = std::move(faces_.vertices);
    file_.room.materials = std::move(modifiers_.materials);
    if (const Result<void> done = detail::collect_faces(faces_, name_, file_.room, file_.report); !done)
      return done.error();
    file_.content_hash = content_hash(file_.room);
    return std::move(file_);
  }

private:
  Error wrong(const std::string& what, const std::string& where) const {
    return {ErrorCode::file_malformed, what, where.empty() ? name_ : name_ + ", \"" + where.substr(0, 80) + "\"",
            "export the model again"};
  }

  Result<void> each(const Json& list, const std::function<Result<void>(const Json&)>& add) {
    if (list.is_null())
      return {};
    if (!list.is_array())
      return wrong("a list that is none", "");
    for (const Json& part : list)
      if (const Result<void> done = add(part); !done)
        return done;
    return {};
  }

  Result<void> add_all() {
    if (!member(model_, "shade_meshes").is_null() && !member(model_, "shade_meshes").empty())
      file_.report.notes.emplace_back("shade meshes are not read");
    const auto rooms = each(member(model_, "rooms"), [this](const Json& room) {
      const std::string set = text_in(member(member(room, "properties"), "radiance"), "modifier_set");
      const auto faces = each(member(room, "faces"), [&](const Json& face) { return add_face(face, set); });
      return faces ? add_shades(room, set) : faces;
    });
    if (!rooms)
      return rooms;
    const std::array<std::pair<const char*, Result<void> (HbjsonRoom::*)(const Json&, const std::string&)>, 4> orphans =
        {{{"orphaned_faces", &HbjsonRoom::add_face},
          {"orphaned_apertures", &HbjsonRoom::add_aperture},
          {"orphaned_doors", &HbjsonRoom::add_door},
          {"orphaned_shades", &HbjsonRoom::add_outdoor_shade}}};
    for (const auto& orphan : orphans)
      if (const auto done =
              each(member(model_, orphan.first), [&](const Json& part) { return (this->*orphan.second)(part, ""); });
          !done)
        return done;
    return {};
  }

  Result<void> add_shades(const Json& owner, const std::string& set) {
    const auto indoors = each(member(owner, "indoor_shades"), [&](const Json& s) {
      return add(s, set, {"shade_set", "interior_modifier"}, {});
    });
    return indoors ? each(member(owner, "outdoor_shades"), [&](const Json& s) { return add_outdoor_shade(s, set); })
                   : indoors;
  }
  Result<void> add_outdoor_shade(const Json& shade, const std::string& set) {
    return add(shade, set, {"shade_set", "exterior_modifier"}, {});
  }

  Result<void> add_face(const Json& face, const std::string& set) {
    std::vector<Loop> cut;
    for (const char* key : {"apertures", "doors"}) {
      const bool doors = key[0] == 'd';
      const auto done = each(member(face, key), [&](const Json& part) -> Result<void> {
        auto outline = outline_of(member(member(part, "geometry"), "boundary"), part);
        if (!outline)
          return outline.error();
        cut.push_back(std::move(*outline));
        return doors ? add_door(part, set) : add_aperture(part, set);
      });
      if (!done)
        return done;
    }
    if (const auto done = add_shades(face, set); !done)
      return done;
    const std::string type = text_in(face, "face_type");
    if (type == "AirBoundary") {
      ++open_;
      return {};
    }
    const char* const kind = type == "Floor" ? "floor_set" : type == "RoofCeiling" ? "roof_ceiling_set" : "wall_set";
    return add(face, set, {kind, is_between_rooms(face) ? "interior_modifier" : "exterior_modifier"}, std::move(cut));
  }

  Result<void> add_aperture(const Json& part, const std::string& set) {
    const bool operable = member(part, "is_operable").is_boolean() && member(part, "is_operable").get<bool>();
    const auto done = add(part, set,
                          {"aperture_set", is_between_rooms(part) ? "interior_modifier"
                                           : operable             ? "operable_modifier"
                                                                  : "window_modifier"},
                          {});
    return done ? add_shades(part, set) : done;
  }

  Result<void> add_door(const Json& part, const std::string& set) {
    const bool glass = member(part, "is_glass").is_boolean() && member(part, "is_glass").get<bool>();
    const bool inside = is_between_rooms(part);
    const auto done = add(part, set,
                          {"door_set", glass ? (inside ? "interior_glass_modifier" : "exterior_glass_modifier")
                                             : (inside ? "interior_modifier" : "exterior_modifier")},
                          {});
    return done ? add_shades(part, set) : done;
  }

  /// A part with a Face3D; `cut`: what is cut out of it beside its own holes.
  Result<void> add(const Json& part, const std::string& set, const detail::ModifierUse& use, std::vector<Loop> cut) {
    const std::string id = text_in(part, "identifier");
    const auto material = modifiers_.of(part, set, use);
    if (!material) {
      Error error = material.error();
      error.where = name_ + ", \"" + id.substr(0, 80) + "\"";
      return error;
    }
    if (!*material)
      return {};
    if (const auto other = between_.find(partner_of(part)); !partner_of(part).empty() && other != between_.end()) {
      detail::ObjFace& first = faces_.faces[other->second];
      first.material = modifiers_.mean_of(first.material, **material);
      return {};
    }
    auto outline = outline_with_holes(part, std::move(cut));
    if (!outline)
      return outline.error();
    if (outline->empty())
      return {};
    if (is_between_rooms(part))
      between_[id] = faces_.faces.size();
    return append(*outline, **material, id);
  }

  Result<Loop> outline_with_holes(const Json& part, std::vector<Loop> cut) {
    const Json& geometry = member(part, "geometry");
    auto outline = outline_of(member(geometry, "boundary"), part);
    if (!outline)
      return outline;
    if (const auto done = each(member(geometry, "holes"),
                               [&](const Json& hole) -> Result<void> {
                                 auto loop = outline_of(hole, part);
                                 if (!loop)
                                   return loop.error();
                                 cut.push_back(std::move(*loop));
                                 return {};
                               });
        !done)
      return done.error();
    if (cut.empty())
      return outline;
    double away = 0.0;
    for (const Loop& loop : cut)
      away += glm::length(detail::newell_normal(loop));
    if (away >= kWhole * glm::length(detail::newell_normal(*outline)))
      return Loop{};
    auto joined = detail::bridged_outline(*outline, std::move(cut));
    if (!joined || joined->size() > kMostCorners)
      return Error{ErrorCode::geometry_invalid, "an aperture or door touches the edge of its face, or another one",
                   name_ + ", \"" + text_in(part, "identifier").substr(0, 80) + "\"", "leave a centimetre of wall"};
    return std::move(*joined);
  }

  Result<Loop> outline_of(const Json& points, const Json& part) const {
    const std::string id = text_in(part, "identifier");
    if (!points.is_array() || points.size() < 3 || points.size() > kMostCorners)
      return wrong("a geometry without 3 to 1024 corners", id);
    Loop loop;
    for (const Json& p : points) {
      if (!p.is_array() || p.size() != 3)
        return wrong("a corner without three numbers", id);
      glm::dvec3 v(0.0);
      for (int k = 0; k < 3; ++k) {
        const Json& x = p[static_cast<std::size_t>(k)];
        v[k] = x.is_number() ? unit_m_ * x.get<double>() : kLargest_m;
        if (!(std::abs(v[k]) < kLargest_m))
          return wrong("a corner that is no finite number below 1e9", id);
      }
      loop.push_back(v);
    }
    return loop;
  }

  Result<void> append(const Loop& outline, std::uint32_t material, const std::string& id) {
    if (faces_.faces.size() >= kMostFaces)
      return Error{ErrorCode::limit_exceeded, "more than a million faces", name_ + ", \"" + id.substr(0, 80) + "\"",
                   ""};
    faces_.faces.push_back({static_cast<std::uint32_t>(faces_.corners.size()),
                            static_cast<std::uint32_t>(outline.size()), material,
                            static_cast<int>(faces_.faces.size()) + 1});
    std::map<std::array<double, 3>, std::uint32_t> same;
    for (const glm::dvec3& v : outline) {
      const auto [entry, is_new] =
          same.try_emplace({v.x, v.y, v.z}, static_cast<std::uint32_t>(faces_.vertices.size()));
      if (is_new)
        faces_.vertices.push_back(v);
      faces_.corners.push_back({.vertex = entry->second});
    }
    return {};
  }

  const Json& model_;
  const std::string& name_;
  double unit_m_ = 1.0;
  RoomFile file_;
  detail::ObjText faces_;
  detail::HbjsonModifiers modifiers_;
  std::map<std::string, std::size_t> between_; ///< faces between rooms, by identifier
  std::size_t open_ = 0;
};

} // namespace

Result<RoomFile> parse_hbjson_room(std::string_view text, const std::string& name) {
  Json model;
  try {
    model = Json::parse(text);
  } catch (const Json::exception& e) {
    return Error{ErrorCode::file_malformed, std::string("this is no JSON: ") + e.what(), name,
                 "export the model again"};
  }
  return HbjsonRoom(model, name).run();
}

} // namespace daylit
