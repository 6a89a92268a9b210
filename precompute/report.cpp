#include <nlohmann/json.hpp>

#include "precompute/bake.h"
#include "precompute/detail/text_format.h"
#include "scene/core/memory.h"

namespace daylit::precompute {

namespace {

using detail::format;
using Json = nlohmann::ordered_json;

/// Room, mesh, openings, regions and probes.
void add_geometry(const BakeReport& r, Json& j) {
  j["facets"] = {
      {"count", r.facets},    {"longest_edge_m", r.facet_edge_m}, {"doubled_area_m2", r.doubled_m2},
      {"patches", r.patches}, {"sides_skipped", r.sides_skipped}, {"sides_without_path", r.sides_without_path}};
  j["openings"] = {{"windows", r.apertures.window_polygons},
                   {"holes", r.apertures.hole_polygons},
                   {"window_area_m2", r.apertures.window_area_m2},
                   {"hole_area_m2", r.apertures.hole_area_m2},
                   {"unexplained_escape", r.apertures.unexplained_escape}};
  j["regions"] = {{"count", r.regions}, {"stored", r.regions_stored}, {"skipped", r.regions - r.regions_stored}};
  j["probes"] = {{"count", r.probes},
                 {"valid", r.probes_valid},
                 {"interpolated", r.probes_interpolated},
                 {"repeated", r.probes_repeated}};
  j["room"] = {{"faces", r.room.faces_read},
               {"zero_area_faces", r.room.zero_area_faces},
               {"duplicate_faces", r.room.duplicate_faces},
               {"notes", r.room.notes}};
}

/// Exchange areas, solver and energy balance.
void add_transport(const BakeReport& r, Json& j) {
  j["form_factors"] = {{"facing_pairs", r.exchange.facing_pairs},
                       {"near_pairs", r.exchange.near_pairs},
                       {"clear_pairs", r.exchange.clear_pairs},
                       {"hidden_pairs", r.exchange.hidden_pairs},
                       {"sampled_pairs", r.exchange.sampled_pairs},
                       {"black_pairs", r.exchange.black_pairs},
                       {"low_rank_pairs", r.exchange.low_rank_pairs},
                       {"dense_blocks", r.exchange.dense_blocks},
                       {"low_rank_blocks", r.exchange.low_rank_blocks},
                       {"mean_rank", r.exchange.mean_rank},
                       {"bytes", r.exchange.bytes},
                       {"rays", r.exchange.rays}};
  j["solve"] = {{"iterations", r.solve.iterations},   {"worst_residual", r.solve.worst_residual},
                {"columns", r.solve.residual.size()}, {"channels", r.solve.channels},
                {"factorised", r.solve.factorised},   {"adjoint", r.adjoint}};
  j["energy"] = {{"entering", r.energy.entering},
                 {"absorbed", r.energy.absorbed},
                 {"leaving", r.energy.leaving},
                 {"relative_imbalance", r.energy.imbalance},
                 {"relative_imbalance_unclosed", r.energy.unclosed},
                 {"worst_closure", r.closure.worst},
                 {"mean_closure", r.closure.mean},
                 {"rows_left_open", r.closure.left}};
}

/// What was left out, and what that can cost in irradiance.
void add_skipped(const BakeReport& r, Json& j) {
  j["skipped"] = {{{"what", "regions that no opening shows"}, {"count", r.regions - r.regions_stored}, {"bound", 0}},
                  {{"what", "sides that no light reaches"}, {"count", r.sides_skipped}, {"bound", 0}},
                  {{"what", "sides without a way to any given point"}, {"count", r.sides_without_path}, {"bound", 0}},
                  {{"what", "pairs of black surfaces"}, {"count", r.exchange.black_pairs}, {"bound", 0}},
                  {{"what", "channels equal to another"}, {"count", 3 - r.solve.channels}, {"bound", 0}},
                  {{"what", "points at the position of another"}, {"count", r.probes_repeated}, {"bound", 0}}};
}

/// Factors of the fine sky, and of l = 4 where they were kept.
void add_fine_sky(const CompactReport& compact, Json& j) {
  if (compact.nodes > 0)
    j["fine_sky"] = {{"nodes", compact.nodes},
                     {"sources", compact.sources},
                     {"clusters", compact.clusters},
                     {"probe_clusters", compact.probe_clusters},
                     {"mean_rank", compact.mean_rank},
                     {"strong_fraction", compact.strong_fraction},
                     {"bytes", compact.bytes},
                     {"rms_error", compact.rms_error},
                     {"largest_error", compact.largest_error}};
  if (compact.band4_probe_clusters > 0)
    j["fine_sky"]["band4"] = {{"probe_clusters", compact.band4_probe_clusters},
                              {"components", compact.band4_components},
                              {"bytes", compact.band4_bytes}};
}

/// The same as lines for a person: counts, areas in m^2, what was left out with its bound.
std::string geometry_lines(const BakeReport& r) {
  std::string text;
  text += format("openings   %d windows (%.2f m2), %d holes (%.2f m2)\n", r.apertures.window_polygons,
                 r.apertures.window_area_m2, r.apertures.hole_polygons, r.apertures.hole_area_m2);
  if (r.apertures.unexplained_escape > 0)
    text += format("           %.2f %% of the test rays leave through gaps without an outline\n",
                   100 * r.apertures.unexplained_escape);
  text += format("facets    %zu (edge up to %.3f m), %zu sides in the air, %zu sides skipped: no light reaches them\n",
                 r.facets, r.facet_edge_m, r.patches, r.sides_skipped);
  if (r.doubled_m2 > 0)
    text +=
        format("           %.3g m2 of faces lie on other faces and count once, with the material of the earlier one\n",
               r.doubled_m2);
  if (r.sides_without_path > 0)
    text += format("           %zu lit sides left out: no way from them to any given point (bound 0)\n",
                   r.sides_without_path);
  text += format("regions    %d of %d stored, %d skipped: the room reflects none of their light (bound 0)\n",
                 r.regions_stored, r.regions, r.regions - r.regions_stored);
  text +=
      format("probes     %zu of %zu with light of their own, %zu at the position of another (gathered once, bound 0)\n",
             r.probes_valid, r.probes, r.probes_repeated);
  if (r.probes_interpolated > 0)
    text += format("           %zu more in the air, away from the surfaces that their planes are for: interpolated\n",
                   r.probes_interpolated);
  return text;
}

/// Pairs in millions; energy as fractions of what enters.
std::string transport_lines(const BakeReport& r) {
  std::string text;
  const auto millions = [](std::uint64_t pairs) { return static_cast<double>(pairs) / 1e6; };
  text +=
      format("pairs      %.2f M facing: %.2f M clear and %.2f M hidden by one face, without a ray (bound 0), %.2f M by "
             "rays, %.2f M near\n",
             millions(r.exchange.facing_pairs), millions(r.exchange.clear_pairs), millions(r.exchange.hidden_pairs),
             millions(r.exchange.sampled_pairs), millions(r.exchange.near_pairs));
  if (r.exchange.black_pairs > 0)
    text += format("           %.2f M between black surfaces left out (bound 0)\n", millions(r.exchange.black_pairs));
  text += format("matrix     %.1f MB, %zu dense and %zu low-rank blocks (%.2f M pairs, mean rank %.1f)\n",
                 static_cast<double>(r.exchange.bytes) / 1e6, r.exchange.dense_blocks, r.exchange.low_rank_blocks,
                 millions(r.exchange.low_rank_pairs), r.exchange.mean_rank);
  text += format(
      "solve      %zu columns %s, %d of 3 channels (the others are equal, bound 0), %d iterations, residual %.1e\n",
      r.solve.residual.size(), r.adjoint ? "from the probes to the light" : "from the light to the probes",
      r.solve.channels, r.solve.iterations, r.solve.worst_residual);
  text += format(
      "energy     in 1, absorbed %.5f, out again %.5f, imbalance %.1e; rows of the form factors were off by %.1e at "
      "worst, %.1e in the mean, %zu by more than noise\n",
      r.energy.absorbed / std::max(r.energy.entering, 1e-300), r.energy.leaving / std::max(r.energy.entering, 1e-300),
      r.energy.imbalance, r.closure.worst, r.closure.mean, r.closure.left);
  return text;
}

/// Errors in per cent, relative to the light under a small sun.
std::string fine_sky_lines(const CompactReport& compact) {
  std::string text;
  if (compact.nodes > 0)
    text += format(
        "fine sky   %zu directions on %zu elements, %zu probe clusters of rank %.0f, %.1f MB; error %.2f %% rms, "
        "%.2f %% at worst\n",
        compact.nodes, compact.sources, compact.probe_clusters, compact.mean_rank,
        static_cast<double>(compact.bytes) / 1e6, 100 * compact.rms_error, 100 * compact.largest_error);
  if (compact.band4_probe_clusters > 0)
    text +=
        format("           l = 4 in %zu probe clusters, %zu components, %.1f MB of it\n", compact.band4_probe_clusters,
               compact.band4_components, static_cast<double>(compact.band4_bytes) / 1e6);
  return text;
}

} // namespace

std::string to_json(const BakeReport& r, bool times) {
  Json j;
  add_geometry(r, j);
  add_transport(r, j);
  add_skipped(r, j);
  add_fine_sky(r.compact, j);
  for (const SkyError& s : r.audit.sky) {
    j["audit"].push_back({{"sky", s.sky}});
    if (!s.of_room)
      j["audit"].back().update({{"error", s.total},
                                {"limited", s.limited},
                                {"sky_part", s.sky_part},
                                {"probe_part", s.grid_part},
                                {"irradiance", s.irradiance},
                                {"nine_coefficients", s.band4}});
    for (const RoomError& room : s.rooms)
      j["audit"].back()["rooms"].push_back({{"error", room.error}, {"light", room.light}});
  }
  for (const StageTime& s : r.stages)
    if (times)
      j["seconds"][s.name] = s.seconds;
  if (times) {
    j["seconds"]["total"] = r.total_seconds;
    j["memory_bytes"] = r.memory_bytes; // threads count
    j["peak_memory_bytes"] = peak_memory_bytes();
  }
  return j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string to_text(const BakeReport& r) {
  std::string text = geometry_lines(r) + transport_lines(r) + fine_sky_lines(r.compact);
  text += "seconds    ";
  for (const StageTime& s : r.stages)
    text += format("%s %.2f, ", s.name.c_str(), s.seconds);
  return text + format("total %.2f\n", r.total_seconds);
}

} // namespace daylit::precompute
