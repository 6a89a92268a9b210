#include "bench/room_truth.h"

#include <cmath>
#include <fstream>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bench/chance.h"
#include "bench/hole_truth.h"
#include "scene/core/atomic_file.h"
#include "scene/core/checksum.h"

namespace daylit::bench {

namespace {

using Json = nlohmann::json;

/// The sun where `chance` puts it: any azimuth, 5 to 65 degrees high.
BenchSky sunny(int number, Chance& chance) {
  const double azimuth = chance.between(-std::numbers::pi, std::numbers::pi);
  const double elevation = chance.between(5.0, 65.0) * std::numbers::pi / 180.0;
  SkyModel model;
  model.kind = SkyModel::Kind::clear;
  model.diffuse_horizontal = Rgb(80.0f, 100.0f, 130.0f);
  SunDisc sun;
  sun.direction = {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                   std::sin(elevation)};
  sun.normal_irradiance = Rgb(700.0f, 660.0f, 600.0f);
  model.sun = sun;
  return {fmt::format("sun {}", number), true, Sky(model), SkyLight(model)};
}

Result<std::vector<BenchSky>> skies_of(const std::vector<Aperture>& apertures, int suns) {
  auto skies = bench_skies(apertures, {});
  Chance chance(11);
  if (skies)
    for (int i = 0; i < suns; ++i)
      skies->push_back(sunny(i + 1, chance));
  return skies;
}

std::string identity(const RoomFile& room, const std::vector<TruthPoints>& places, const TruthSettings& s) {
  Checksum points_hash;
  std::string holes;
  for (const TruthPoints& place : places) {
    points_hash.add(place.points);
    holes += place.mouth ? "h" : "-";
  }
  return fmt::format("{} {} {} {} {}", room.content_hash, points_hash.hex(), holes, s.samples, s.suns);
}

/// Each point with the axes +x -x +y -y +z -z.
std::vector<Receiver> faces_at(const std::vector<glm::dvec3>& points) {
  std::vector<Receiver> faces;
  for (const glm::dvec3& p : points)
    for (int k = 0; k < 6; ++k) {
      glm::dvec3 normal(0.0);
      normal[k / 2] = k % 2 == 0 ? 1.0 : -1.0;
      faces.push_back({p, normal});
    }
  return faces;
}

Result<std::vector<IrradianceEstimate>> trace_places(const RoomFile& room, const std::vector<Aperture>& apertures,
                                                     const SkyLight& light, const std::vector<TruthPoints>& places,
                                                     int samples, const Progress& progress) {
  const auto scene = TraceScene::make(room.room, apertures, light);
  if (!scene)
    return scene.error();
  std::vector<IrradianceEstimate> all;
  for (const TruthPoints& place : places) {
    const std::vector<Receiver> faces = faces_at(place.points);
    auto traced = place.mouth
                      ? trace_through_hole(room.room, *scene, *place.mouth, faces, {.samples = samples}, progress)
                      : trace_irradiance(*scene, faces, {.samples = samples}, progress);
    if (!traced)
      return traced.error();
    all.insert(all.end(), traced->begin(), traced->end());
  }
  return all;
}

Json to_json(const Rgb& c) { return {c.r, c.g, c.b}; }
Rgb to_rgb(const Json& j) { return {j.at(0).get<float>(), j.at(1).get<float>(), j.at(2).get<float>()}; }

/// Empty where the file holds something else.
std::vector<RoomTruth> kept(const std::filesystem::path& file, const std::string& id, std::vector<BenchSky>& skies) {
  std::vector<RoomTruth> truth;
  std::ifstream stream(file);
  const Json document = stream ? Json::parse(stream, nullptr, false) : Json();
  if (!document.is_object() || document.value("of", "") != id)
    return truth;
  for (std::size_t s = 0; s < skies.size(); ++s) {
    RoomTruth one{std::move(skies[s]), {}};
    for (const Json& e : document["skies"][s])
      one.irradiance.push_back({to_rgb(e[0]), to_rgb(e[1])});
    truth.push_back(std::move(one));
  }
  return truth;
}

Result<void> keep(const std::filesystem::path& file, const std::string& id, const std::vector<RoomTruth>& truth) {
  Json document = {{"of", id}, {"skies", Json::array()}};
  for (const RoomTruth& one : truth) {
    Json list = Json::array();
    for (const IrradianceEstimate& e : one.irradiance)
      list.push_back({to_json(e.value), to_json(e.standard_error)});
    document["skies"].push_back(std::move(list));
  }
  return write_file_atomically(file, document.dump() + "\n");
}

} // namespace

Result<std::vector<RoomTruth>> room_truth(const RoomFile& room, const std::vector<TruthPoints>& places,
                                          const TruthSettings& settings, const std::filesystem::path& file,
                                          const Progress& progress) {
  const auto rays = RayScene::build(room.room);
  if (!rays)
    return rays.error();
  const auto apertures = find_apertures(room.room, *rays);
  if (!apertures)
    return apertures.error();
  auto skies = skies_of(apertures->list, settings.suns);
  if (!skies)
    return skies.error();
  const std::string id = identity(room, places, settings);
  if (auto truth = kept(file, id, *skies); !truth.empty())
    return truth;
  std::vector<RoomTruth> truth;
  for (BenchSky& sky : *skies) {
    auto light = trace_places(room, apertures->list, sky.light, places, settings.samples, progress);
    if (!light)
      return light.error();
    truth.push_back({std::move(sky), std::move(*light)});
  }
  if (!file.empty())
    if (const auto written = keep(file, id, truth); !written)
      return written.error();
  return truth;
}

} // namespace daylit::bench
