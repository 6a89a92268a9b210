#include "bench/maps_probe.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>

#include <glm/geometric.hpp>

#include "scene/image/image_formats.h"

namespace daylit::bench {
namespace {

using RadianceOf = std::function<Rgb(const glm::dvec3&)>;

AngularMap pixels_of(const RadianceMap& map) {
  AngularMap out;
  for (std::size_t i = 0; i < map.radiance.size(); ++i) {
    const glm::dvec3 w = map.direction(i);
    out.x.push_back(w.x);
    out.y.push_back(w.y);
    out.z.push_back(w.z);
    out.solid_angle.push_back(map.solid_angle_sr());
    for (int c = 0; c < 3; ++c)
      out.values.push_back(double(map.radiance[i][c]));
    out.column.push_back(int(i) % map.side);
    out.row.push_back(int(i) / map.side);
  }
  return out;
}

Probe probe_of(const std::string& name, const RadianceOf& radiance) {
  Probe p{name, sampled_map(kProbeSide, 4, radiance), angular_map(radiance, kProbeSide), {}, 0.0};
  p.texels = pixels_of(p.map);
  double sum = 0.0, most = 0.0;
  for (const Rgb& c : p.map.radiance) {
    sum += double(luminance(c));
    most = std::max(most, double(luminance(c)));
  }
  p.largest_over_mean = most * double(p.map.radiance.size()) / sum;
  return p;
}

/// Nearest pixel of an angular map, forward = +z.
Rgb sample_angular(const RgbImage& image, const glm::dvec3& w) {
  const double aside = std::hypot(w.x, w.y), radius = std::atan2(aside, w.z) / std::numbers::pi;
  const double u = aside > 0.0 ? w.x / aside * radius : 0.0, v = aside > 0.0 ? w.y / aside * radius : 0.0;
  return image.at(std::clamp(int(0.5 * (1.0 + u) * image.width), 0, image.width - 1),
                  std::clamp(int(0.5 * (1.0 - v) * image.height), 0, image.height - 1));
}

/// Where a ray from the middle of a box of half size h leaves it.
glm::dvec3 on_wall(const glm::dvec3& w, const glm::dvec3& h) {
  const glm::dvec3 t(h.x / std::abs(w.x), h.y / std::abs(w.y), h.z / std::abs(w.z));
  return w * std::min({t.x, t.y, t.z});
}

Rgb room_radiance(const glm::dvec3& w) {
  const glm::dvec3 half(2.5, 1.4, 2.0), sun = glm::normalize(glm::dvec3(-0.45, 0.42, 0.79)), p = on_wall(w, half);
  const bool front = p.z > half.z - 1e-9, floor = p.y<-half.y + 1e-9, ceiling = p.y> half.y - 1e-9;
  if (front && p.y > -0.5 && p.y < 1.1 && std::abs(std::abs(p.x) - 1.2) < 0.8) { // two windows
    if (glm::dot(w, sun) > std::cos(0.53 / 2.0 * std::numbers::pi / 180.0))
      return Rgb(6e4f, 5.4e4f, 4.5e4f);
    return p.y > 0.1 ? Rgb(30.0f, 38.0f, 52.0f) * float(1.0 + 0.6 * p.y) : Rgb(12.0f, 13.0f, 9.0f);
  }
  if (floor && std::abs(p.x - 0.6) < 0.5 && std::abs(p.z + 0.2) < 0.8) // the patch of the sun
    return Rgb(90.0f, 70.0f, 45.0f);
  if (ceiling && std::abs(p.x) < 0.3 && std::abs(p.z + 1.0) < 0.5)
    return Rgb(14.0f, 13.0f, 11.0f);
  const double near = 1.0 + 1.5 * std::exp(-0.5 * glm::dot(p - glm::dvec3(0, -1, 2), p - glm::dvec3(0, -1, 2)));
  const double board = floor && (int(std::floor(3.0 * p.x)) + int(std::floor(3.0 * p.z))) % 2 == 0 ? 0.5 : 1.0;
  const Rgb wall = p.x > half.x - 1e-9 ? Rgb(1.1f, 0.5f, 0.4f) : ceiling ? Rgb(1.2f) : Rgb(0.9f, 0.85f, 0.75f);
  return wall * float(near * board);
}

} // namespace

Probe generated_probe() { return probe_of("generated room", room_radiance); }

Result<Probe> read_probe(const std::string& path) {
  const auto file = read_hdr_image(std::filesystem::path(path));
  if (!file)
    return file.error();
  const RgbImage& image = file->radiance;
  const std::string name = std::filesystem::path(path).stem().string();
  if (image.width == image.height && image.width >= 16)
    return probe_of(name, [&](const glm::dvec3& w) { return sample_angular(image, w); });
  if (image.width % 3 == 0 && image.width / 3 * 4 == image.height && image.width >= 48)
    return probe_of(name, [&](const glm::dvec3& w) { return sample_cross(image, w); });
  return Error{ErrorCode::value_invalid, "neither a square angular map nor a vertical cross of 3 x 4 faces", path,
               "resample it"};
}

} // namespace daylit::bench
