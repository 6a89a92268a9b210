#include "scene/sky/sun.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

#include "scene/core/orthonormal.h"
#include "scene/core/parallel.h"
#include "scene/sky/sky.h"

namespace daylit {

namespace {

constexpr double kRingWidth = 0.06; // radians: wide enough for a mean, narrow enough to be the sky beside the sun

struct Cluster {
  glm::dvec3 excess{0.0}, centroid{0.0};
  Rgb surround{0.0f};
  double energy = 0.0, square = 0.0; ///< sums over the pixels of their luminance and its square
};

constexpr std::size_t kChunk = 16384;

struct Peak {
  float luminance = 0.0f;
  std::size_t pixel = std::numeric_limits<std::size_t>::max();
};

/// The brightest pixel of the field, the first of several.
Peak find_peak(const std::vector<Rgb>& texels, const std::vector<glm::vec3>& directions) {
  std::vector<Peak> peaks((texels.size() + kChunk - 1) / kChunk);
  parallel_for(std::size_t{0}, peaks.size(), [&](std::size_t part) {
    for (std::size_t i = part * kChunk; i < std::min((part + 1) * kChunk, texels.size()); ++i)
      if (const float l = luminance(texels[i]); l > peaks[part].luminance && directions[i] != glm::vec3(0.0f))
        peaks[part] = {l, i};
  });
  const auto brightest = std::ranges::max_element(peaks, {}, &Peak::luminance); // the first of equals
  return brightest == peaks.end() ? Peak{} : *brightest;
}

/// Pixels within `angle` of the axis, ascending.
std::vector<std::size_t> pixels_around(const std::vector<glm::vec3>& directions, const glm::dvec3& axis, double angle) {
  const float least = static_cast<float>(std::cos(angle));
  const glm::vec3 towards(axis);
  std::vector<std::vector<std::size_t>> parts((directions.size() + kChunk - 1) / kChunk);
  parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
    for (std::size_t i = part * kChunk; i < std::min((part + 1) * kChunk, directions.size()); ++i)
      if (glm::dot(directions[i], towards) >= least)
        parts[part].push_back(i);
  });
  std::vector<std::size_t> pixels;
  for (const auto& part : parts)
    pixels.insert(pixels.end(), part.begin(), part.end());
  return pixels;
}

/// Ring mean, then excess over it inside `radius` of `axis`. `nearby` holds all pixels of both.
Cluster measure_cluster(const SkyImage& sky, const std::vector<glm::vec3>& directions,
                        const std::vector<std::size_t>& nearby, const glm::dvec3& axis, double radius) {
  const float inner = static_cast<float>(std::cos(radius)), outer = static_cast<float>(std::cos(radius + kRingWidth));
  const glm::vec3 towards(axis);
  std::vector<std::size_t> inside;
  glm::dvec3 ring(0.0);
  double ring_sr = 0.0;
  for (const std::size_t i : nearby) {
    const float c = glm::dot(directions[i], towards);
    if (c < outer)
      continue;
    if (c >= inner)
      inside.push_back(i);
    else {
      ring += static_cast<double>(sky.solid_angle_sr()[i]) * glm::dvec3(sky.image().texels[i]);
      ring_sr += static_cast<double>(sky.solid_angle_sr()[i]);
    }
  }
  Cluster cluster;
  cluster.surround = ring_sr > 0.0 ? Rgb(ring / ring_sr) : Rgb(0.0f);
  for (const std::size_t i : inside) {
    const double sr = static_cast<double>(sky.solid_angle_sr()[i]);
    const glm::dvec3 excess = sr * glm::dvec3(sky.image().texels[i] - cluster.surround);
    cluster.excess += excess;
    const double energy = std::max(static_cast<double>(luminance(Rgb(excess))), 0.0);
    cluster.energy += energy;
    cluster.square += energy * energy;
    cluster.centroid += static_cast<double>(std::max(luminance(Rgb(excess)), 0.0f)) * glm::dvec3(directions[i]);
  }
  return cluster;
}

} // namespace

/// Two passes: around the brightest pixel, then around the centroid of what is found there. E = sum of (L - surround)
/// Omega; energy fluctuates by sqrt(sum e_i^2) / sum e_i of a pixel's relative noise.
std::optional<DetectedSun> find_sun(const SkyImage& sky, const std::vector<glm::vec3>& directions) {
  const std::vector<Rgb>& texels = sky.image().texels;
  const Peak peak = find_peak(texels, directions);
  if (peak.pixel >= texels.size())
    return std::nullopt;

  // The disc may straddle pixels: its energy lies within its radius plus one pixel diagonal of the centroid.
  const double pixel_diagonal = std::sqrt(2.0 * static_cast<double>(sky.solid_angle_sr()[peak.pixel]));
  const double radius = kSunAngularRadius + 1.25 * pixel_diagonal;
  const glm::dvec3 first_axis = glm::normalize(glm::dvec3(directions[peak.pixel]));
  // The centroid lies within the radius of the peak.
  const std::vector<std::size_t> nearby = pixels_around(directions, first_axis, 2.0 * radius + kRingWidth + 1e-4);
  Cluster cluster = measure_cluster(sky, directions, nearby, first_axis, radius);
  if (peak.luminance < kSunContrast * luminance(cluster.surround) || glm::length(cluster.centroid) <= 0.0)
    return std::nullopt;
  const glm::dvec3 first_centroid = glm::normalize(cluster.centroid);
  cluster = measure_cluster(sky, directions, nearby, first_centroid, radius);
  if (glm::length(cluster.centroid) <= 0.0 || luminance(Rgb(cluster.excess)) <= 0.0f)
    return std::nullopt;

  DetectedSun sun;
  sun.direction = first_centroid; // the pixels replaced are exactly those that the excess was summed over
  sun.cluster_radius = radius;
  sun.surround = cluster.surround;
  sun.normal_irradiance = glm::max(Rgb(cluster.excess), Rgb(0.0f));
  sun.noise_fraction = cluster.energy > 0.0 ? std::sqrt(cluster.square) / cluster.energy : 1.0;
  return sun;
}

std::vector<glm::vec3> pixel_directions(const SkyImage& sky) {
  const auto width = static_cast<std::size_t>(sky.image().width);
  std::vector<glm::vec3> directions(sky.image().texels.size(), glm::vec3(0.0f));
  parallel_for(std::size_t{0}, directions.size(), [&](std::size_t i) {
    if (sky.solid_angle_sr()[i] > 0.0f)
      if (const auto d = sky.direction({static_cast<double>(i % width), static_cast<double>(i / width)}))
        directions[i] = glm::vec3(*d);
  });
  return directions;
}

std::optional<SunDisc> small_sun(const Sky& sky) {
  if (!sky.image())
    return sky.sun();
  const std::optional<DetectedSun> found = find_sun(*sky.image(), pixel_directions(*sky.image()));
  if (!found)
    return std::nullopt;
  return SunDisc{found->direction, kSunAngularRadius, found->normal_irradiance};
}

/// Vogel 1979, "A better way to construct the sunflower head": radius sqrt((k + 1/2) / n), angle k times the golden
/// angle.
glm::dvec3 sun_disc_direction(const glm::dvec3& centre, int k, int count) {
  constexpr double kGoldenAngle = std::numbers::pi * 0.76393202250021030359; // pi (3 - sqrt 5)
  const double radius = std::tan(kSunAngularRadius) * std::sqrt((k + 0.5) / count);
  const OrthonormalBasis basis(centre);
  const double angle = kGoldenAngle * k;
  return glm::normalize(centre + radius * (std::cos(angle) * basis.u + std::sin(angle) * basis.v));
}

} // namespace daylit
