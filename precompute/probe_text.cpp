#include "precompute/probe_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "scene/room/glass.h"
#include "scene/volume/volume_file.h"

namespace daylit::precompute {

namespace {

std::string values_text(std::span<const float> values, const char* separator) {
  std::string text;
  for (const float x : values)
    text += fmt::format("{}{:.9g}", text.empty() ? "" : separator, x);
  return text;
}

template <std::size_t N>
std::string sh_values_text(std::optional<std::array<float, N>> values, bool json) {
  if (!values && json)
    return "{\"sh\":null}\n";
  if (!values)
    values.emplace().fill(std::numeric_limits<float>::quiet_NaN());
  return json ? "{\"sh\":[" + values_text(*values, ",") + "]}\n" : values_text(*values, " ") + "\n";
}

nlohmann::ordered_json json3(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

/// Reflecting materials and panes, as the bake used them.
nlohmann::ordered_json materials_info(const Room& room) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Material& m : room.materials) {
    nlohmann::ordered_json entry{{"name", m.name}};
    entry[m.is_window ? "transmittance" : "reflectance"] =
        json3(glm::dvec3(m.is_window ? m.transmittance : m.reflectance));
    list.push_back(std::move(entry));
  }
  return list;
}

/// Counts, spacing in metres and bounds in the world.
nlohmann::ordered_json probes_info(const ProbeSet& probes) {
  nlohmann::ordered_json info{{"layout", probes.is_grid ? "grid" : "points"},
                              {"count", probes.size()},
                              {"valid", std::count(probes.valid.begin(), probes.valid.end(), 1)}};
  if (probes.is_grid) {
    info["grid"] = {probes.count.x, probes.count.y, probes.count.z};
    info["spacing_m"] = json3(probes.spacing);
    info["graded"] = probes.is_graded();
  }
  Bounds bounds;
  for (const glm::vec3& p : probes.positions)
    bounds.include(probes.origin + glm::dvec3(p));
  info["min_m"] = json3(bounds.min);
  info["max_m"] = json3(bounds.max);
  return info;
}

} // namespace

/// Three values, or six with a normal of any length but zero; anything else is refused with the number of the line.
Result<ProbePoint> parse_probe_point(const std::string& line, std::size_t line_number, bool with_normal) {
  const auto error = [&](const char* what) {
    return Error{ErrorCode::value_invalid, what, fmt::format("stdin, line {}", line_number),
                 with_normal ? "each line is: x y z nx ny nz" : "with --sh each line is: x y z"};
  };
  std::array<double, 6> number{};
  const std::size_t wanted = with_normal ? 6 : 3;
  std::size_t count = 0;
  const char *p = line.data(), *end = p + line.size();
  while (true) {
    while (p < end && (*p == ' ' || *p == '\t' || *p == '\r'))
      ++p;
    if (p == end)
      break;
    if (count == wanted)
      return error("too many numbers");
    if (*p == '+')
      ++p;
    const auto [stop, ec] = std::from_chars(p, end, number[count]);
    if (ec != std::errc{} || (stop < end && *stop != ' ' && *stop != '\t' && *stop != '\r') ||
        !std::isfinite(number[count]))
      return error("this is not a finite number");
    p = stop;
    ++count;
  }
  if (count < wanted)
    return error("too few numbers");
  ProbePoint point{{number[0], number[1], number[2]}, {0, 0, 1}};
  if (with_normal) {
    const double length = std::hypot(number[3], number[4], number[5]);
    if (!(length > 0.0 && std::isfinite(length)))
      return error("the normal has no direction");
    point.normal = glm::dvec3(number[3], number[4], number[5]) / length;
  }
  return point;
}

/// `r g b`, in the unit of the sky times steradian; NaN where there is no light field.
std::string irradiance_text(const std::optional<Rgb>& e, bool json) {
  if (!e)
    return json ? "{\"irradiance\":null}\n" : "nan nan nan\n";
  const std::span<const float> values(&e->x, 3);
  return json ? "{\"irradiance\":[" + values_text(values, ",") + "]}\n" : values_text(values, " ") + "\n";
}

/// E_v = K (0.2126 R + 0.7152 G + 0.0722 B), lx: luminance weights of Rec. 709, K the luminous efficacy in lm/W.
double illuminance(const Rgb& e, double efficacy) {
  return efficacy *
         (0.2126 * static_cast<double>(e.r) + 0.7152 * static_cast<double>(e.g) + 0.0722 * static_cast<double>(e.b));
}

/// One value in lx.
std::string illuminance_text(const std::optional<Rgb>& e, double efficacy, bool json) {
  if (!e)
    return json ? "{\"illuminance\":null}\n" : "nan\n";
  const std::string number = fmt::format("{:.9g}", illuminance(*e, efficacy));
  return json ? "{\"illuminance\":" + number + "}\n" : number + "\n";
}

/// 27 values, coefficient by coefficient, each with its three channels.
std::string coefficients_text(const std::optional<Sh9Rgb>& sh, bool json) {
  std::array<float, 27> values{};
  for (std::size_t i = 0; sh && i < 27; ++i)
    values[i] = (*sh)[i / 3][static_cast<int>(i % 3)];
  return sh_values_text(sh ? std::optional(values) : std::nullopt, json);
}

/// The same and then the nine of l = 4; zeros where the volume has none.
std::string order4_text(const std::optional<ShRadiance>& sh, bool json) {
  std::array<float, 54> values{};
  for (std::size_t i = 0; sh && i < 54; ++i)
    values[i] = (i < 27 ? sh->nine : sh->band4)[i % 27 / 3][static_cast<int>(i % 3)];
  return sh_values_text(sh ? std::optional(values) : std::nullopt, json);
}

/// Nine coefficients per channel in the order, axes and scale of an engine (docs/interchange.md).
std::string layout_text(const std::optional<Sh9Rgb>& sh, ShLayout layout, bool json) {
  return sh_values_text(sh ? std::optional(to_engine(*sh, layout)) : std::nullopt, json);
}

/// The answer holds no light: outside the room or inside furniture.
bool is_outside(const std::string& answer, bool json) {
  return json ? answer.find("null") != std::string::npos : answer.starts_with("nan");
}

/// What the volume holds, and the report of its bake, as one JSON object.
std::string volume_info(const BasisVolume& volume) {
  nlohmann::ordered_json info;
  info["format_version"] = kVolumeFormatVersion;
  info["frame"] = "right-handed, z up, metres";
  info["sky"] = {
      {"partition", volume.partition.name()},
      {"regions", volume.partition.size()},
      {"stored", volume.compact ? static_cast<std::size_t>(volume.partition.size()) : volume.stored_region.size()}};
  if (volume.compact)
    info["sky"]["sources"] = volume.compact->sources();
  info["probes"] = probes_info(volume.probes);
  info["sh_order"] = volume.has_band4() ? 4 : 2;
  info["basis_bytes"] =
      volume.compact ? volume.compact->bytes() : (volume.basis.size() + volume.band4.size()) * sizeof(float);
  const Bounds bounds = volume.room.bounds();
  info["room"] = {{"triangles", volume.room.triangles.size()},
                  {"min_m", json3(bounds.min)},
                  {"max_m", json3(bounds.max)},
                  {"materials", materials_info(volume.room)}};
  info["apertures"] = nlohmann::ordered_json::array();
  for (const Aperture& a : volume.apertures) {
    nlohmann::ordered_json corners = nlohmann::ordered_json::array();
    for (const glm::dvec3& c : a.corners)
      corners.push_back(json3(c));
    info["apertures"].push_back({{"corners_m", corners},
                                 {"inward", json3(a.inward)},
                                 {"transmittance", json3(glm::dvec3(a.transmittance))},
                                 {"pane_model", pane_model_name(a.refractive_index)}});
  }
  const VolumeProvenance& p = volume.provenance;
  info["provenance"] = {{"program_version", p.program_version},
                        {"command_line", p.command_line},
                        {"room", p.room_name},
                        {"room_hash", p.room_hash}};
  const nlohmann::json report = nlohmann::json::parse(p.report_json, nullptr, false);
  info["report"] = report.is_discarded() ? nlohmann::ordered_json(p.report_json) : nlohmann::ordered_json(report);
  return info.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

} // namespace daylit::precompute
