#include "bench/rooms_measure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bench/room_bake.h"
#include "precompute/audit.h"
#include "scene/core/seconds.h"
#include "scene/volume/indirect_light.h"
#include "scene/volume/volume_file.h"

namespace daylit::bench {

namespace {

using Json = nlohmann::json;

constexpr double kLitBySun = 0.2; ///< of the light of the brightest sun and its sky: half of it the sky's

/// Error and power of the light in one place under one sky.
struct Sums {
  double error2 = 0, power2 = 0, noise2 = 0;
  int unknown = 0; ///< points where the volume has no light
  /// nrms, the noise of the reference taken out of it.
  double nrms() const { return power2 > 0 ? std::sqrt(std::max(0.0, error2 - noise2) / power2) : 0.0; }
  double noise() const { return power2 > 0 ? std::sqrt(noise2 / power2) : 0.0; }
};

double square(const Rgb& c) { return static_cast<double>(glm::dot(c, c)); }

Sums compare(const IndirectLight& indirect, const std::vector<glm::dvec3>& points,
             std::span<const IrradianceEstimate> truth) {
  Sums sums;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const auto light = indirect.at(points[p]);
    sums.unknown += light ? 0 : 1;
    for (std::size_t k = 0; k < 6; ++k) {
      glm::vec3 normal(0.0f);
      normal[static_cast<int>(k / 2)] = k % 2 == 0 ? 1.0f : -1.0f;
      const IrradianceEstimate& e = truth[6 * p + k];
      sums.error2 += square((light ? irradiance(*light, normal) : Rgb(0.0f)) - e.value);
      sums.noise2 += square(e.standard_error);
      sums.power2 += square(e.value);
    }
  }
  return sums;
}

struct MeasuredPlace {
  const Place* place;
  std::vector<glm::dvec3> points;
};

/// All lit places of the room, in the order in which the truth has them.
Result<std::vector<MeasuredPlace>> lit_places(const RealRoom& room, const Room& geometry) {
  std::vector<MeasuredPlace> places;
  for (const Place& place : room.places) {
    if (!place.lit)
      continue;
    auto points = points_in(room, geometry, place);
    if (!points)
      return points.error();
    places.push_back({&place, std::move(*points)});
  }
  return places;
}

std::vector<std::string> bake_arguments(const RoomCase& one, const std::vector<MeasuredPlace>& places,
                                        const MeasureSettings& s) {
  std::vector<std::string> words{(s.folder / (one.room + ".obj")).string(), "-o",
                                 (s.folder / (one.name + ".volume")).string(), "--force", "--json"};
  std::istringstream options(s.bake_options.empty() ? one.options : s.bake_options);
  const glm::dvec3 inside = places[0].points[0];
  for (std::string word; options >> word;) {
    if (word == "{points}")
      word = (s.folder / (one.room + ".points")).string();
    else if (word == "{inside}")
      word = fmt::format("{},{},{}", inside.x, inside.y, inside.z);
    words.push_back(word);
  }
  return words;
}

/// The volume's light under the skies of the truth.
Result<std::vector<IndirectLight>> lights_under(const std::vector<RoomTruth>& truth, const BasisVolume& volume,
                                                const RayScene& scene) {
  std::vector<IndirectLight> lights;
  for (const RoomTruth& t : truth) {
    auto light = IndirectLight::make(volume, scene, t.sky.sky);
    if (!light)
      return light.error();
    lights.push_back(std::move(*light));
  }
  return lights;
}

/// 95th percentile, the largest of fewer than twenty.
double percentile95(std::vector<double> values) {
  if (values.empty())
    return 0.0;
  std::ranges::sort(values);
  return values[std::min(values.size() - 1, static_cast<std::size_t>(0.95 * static_cast<double>(values.size())))];
}

/// Of the suns that look in, as the bake counts them: those under which the place has at least kLitBySun of the light
/// that the brightest one gives it. Elsewhere its light is that of the sky around the sun.
double percentile95_of_suns(const std::vector<Sums>& suns) {
  double brightest2 = 0;
  for (const Sums& sun : suns)
    brightest2 = std::max(brightest2, sun.power2);
  std::vector<double> errors;
  for (const Sums& sun : suns)
    if (sun.power2 >= kLitBySun * kLitBySun * brightest2)
      errors.push_back(sun.nrms());
  return precompute::ErrorSpread::of(std::move(errors)).percentile95;
}

/// Errors place by place, sky by sky; the worst of smooth skies and of suns beside their bars.
Json errors(const RoomCase& one, const std::vector<MeasuredPlace>& places, const std::vector<RoomTruth>& truth,
            const std::vector<IndirectLight>& lights) {
  Json rows = Json::array();
  std::size_t first = 0;
  for (std::size_t i = 0; i < places.size() && (i == 0 || !one.first_place); ++i) {
    const std::size_t count = 6 * places[i].points.size();
    std::vector<double> smooth, suns;
    std::vector<Sums> of_suns;
    Json row = {{"place", places[i].place->name}, {"skies", Json::array()}, {"unknown_points", 0}, {"noise", 0.0}};
    for (std::size_t s = 0; s < truth.size(); ++s) {
      const RoomTruth& t = truth[s];
      const Sums sums = compare(lights[s], places[i].points, std::span(t.irradiance).subspan(first, count));
      (t.sky.small_sun ? suns : smooth).push_back(sums.nrms());
      if (t.sky.small_sun)
        of_suns.push_back(sums);
      row["skies"].push_back({{"sky", t.sky.name},
                              {"small_sun", t.sky.small_sun},
                              {"error", sums.nrms()},
                              {"noise", sums.noise()},
                              {"light", std::sqrt(sums.power2 / static_cast<double>(3 * count))}});
      row["unknown_points"] = sums.unknown;
      row["noise"] = std::max(row["noise"].get<double>(), sums.noise());
    }
    row["smooth"] = *std::ranges::max_element(smooth);
    row["sun"] = percentile95(suns);
    row["sun_looking_in"] = percentile95_of_suns(of_suns);
    row["smooth_bar"] = i < one.places.size() ? one.places[i] : one.smooth;
    row["sun_bar"] = one.sun;
    first += count;
    rows.push_back(std::move(row));
  }
  return rows;
}

/// What the bake says of the smallest room that a point is in (a room that is no box may hold others): the 95th
/// percentile under `skies` ("smooth" or "sun"); 0 where it names none.
double claimed_percentile95(const Json& claimed, const glm::dvec3& point, const char* skies) {
  double smallest = std::numeric_limits<double>::infinity(), percentile = 0.0;
  for (const Json& room : claimed.value("rooms", Json::array())) {
    const auto low = room["low_m"].get<std::array<double, 3>>(), high = room["high_m"].get<std::array<double, 3>>();
    double size = 1.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = point[static_cast<int>(k)];
      size *= x >= low[k] && x <= high[k] ? high[k] - low[k] : std::numeric_limits<double>::infinity();
    }
    if (size < smallest) {
      smallest = size;
      percentile = room[skies]["percentile_95"].get<double>();
    }
  }
  return percentile;
}

bool within(double value, double bar) { return bar <= 0 || value <= bar; }

bool is_met(const RoomCase& one, const Json& row) {
  bool met = within(row["wall_seconds"], one.seconds) && within(row["peak_gb"], one.gigabytes) &&
             within(row["file_mb"], one.megabytes);
  for (const Json& place : row["places"])
    met = met && place["unknown_points"] == 0 && within(place["smooth"], place["smooth_bar"]) &&
          within(place["sun"], place["sun_bar"]);
  return met;
}

Json head(const RoomCase& one, const ProgramRun& run, const std::vector<std::string>& arguments) {
  return {{"case", one.name},
          {"options", std::vector<std::string>(arguments.begin() + 5, arguments.end())},
          {"exit_code", run.exit_code},
          {"wall_seconds", run.wall_s},
          {"cpu_seconds", run.cpu_s},
          {"peak_gb", run.peak_gb},
          {"bars", {{"seconds", one.seconds}, {"gigabytes", one.gigabytes}, {"megabytes", one.megabytes}}},
          {"met", false}};
}

} // namespace

const std::vector<RoomCase>& room_cases() {
  static const std::vector<RoomCase> cases = {
      {"school-points", "school", "--points {points}", true, 60, 4, 0, 0.02, 0.04},
      {"school-inside", "school", "--inside {inside}", true, 90, 4, 30, 0.02, 0.04},
      {"school-all", "school", "--max-error 4", false, 600, 8, 0, 0.04, 0.08},
      {"hall", "hall", "", false, 120, 4, 200, 0.02, 0.04},
      {"home", "home", "", false, 120, 4, 200, 0.03, 0},
      {"louvres", "louvres", "", false, 120, 4, 0, 0.03, 0.05},
      {"atrium", "atrium", "", false, 0, 0, 0, 0, 0},
      {"furnished", "furnished", "--max-error 4", false, 600, 8, 0, 0.04, 0.08},
      {"dim", "dim", "", false, 0, 0, 0, 0.15, 0, {0.02, 0.15}}};
  return cases;
}

Result<Json> measure_case(const RoomCase& one, const RealRoom& room, const MeasureSettings& settings,
                          const Progress& progress) {
  const auto file = read_room(settings.folder / (one.room + ".obj"));
  if (!file)
    return file.error();
  const auto places = lit_places(room, file->room);
  if (!places)
    return places.error();
  const std::vector<std::string> arguments = bake_arguments(one, *places, settings);
  const auto run = run_program_of_build("daylit-precompute", arguments, settings.limit_s, settings.folder / one.name);
  if (!run)
    return run.error();
  Json row = head(one, *run, arguments);
  if (run->exit_code != 0) {
    row["failed"] = run->out_of_time ? fmt::format("no end within {:.0f} s", settings.limit_s) : run->last_words;
    return row;
  }
  const std::filesystem::path path = settings.folder / (one.name + ".volume");
  row["file_mb"] = static_cast<double>(std::filesystem::file_size(path)) / 1e6;
  for (const char* key : {"plan", "predicted", "measured"})
    if (run->report.is_object() && run->report.contains(key))
      row[key == std::string_view("measured") ? "claimed" : key] = run->report[key];
  std::vector<TruthPoints> points;
  for (const MeasuredPlace& place : *places)
    points.push_back({place.points, place.place->mouth});
  const auto truth = room_truth(*file, points, settings.truth, settings.folder / (one.room + ".truth.json"), progress);
  if (!truth)
    return truth.error();
  const auto volume = read_volume(path);
  if (!volume)
    return volume.error();
  const auto scene = RayScene::build(volume->room);
  if (!scene)
    return scene.error();
  const auto lights = lights_under(*truth, *volume, *scene);
  if (!lights)
    return lights.error();
  row["places"] = errors(one, *places, *truth, *lights);
  for (std::size_t i = 0; i < row["places"].size(); ++i)
    for (const auto& [key, skies] : {std::pair{"smooth_claimed", "smooth"}, {"sun_claimed", "sun"}})
      row["places"][i][key] =
          claimed_percentile95(row.value("claimed", Json::object()), (*places)[i].points.front(), skies);
  row["met"] = is_met(one, row);
  return row;
}

} // namespace daylit::bench
