#include "precompute/held_out.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit::precompute {

namespace {

constexpr double kPi = std::numbers::pi, kDegree = kPi / 180;
constexpr std::array<double, 3> kSunAltitudes{9.4, 23.1, 41.7}; // degrees: on no row of a usual subdivision
constexpr double kSunHeight = 0.53;                             // degrees
constexpr int kSunCells = 680, kSkyCells = 72, kSkyBands = 18;  // per turn; bands of 5 degrees above the horizon
constexpr double kFaintest = 0.1; ///< of the brightest sun: bands of fainter ones are left out
constexpr int kSide = 4;          ///< samples of a region along each side
constexpr std::size_t kMostTries = 16;

/// Regions of the three bands, first and last + 1.
struct SunBand {
  int first, last;
};

struct Layout {
  SkyPartition partition;
  std::vector<SunBand> suns;
};

/// Bands of 5 degrees, cut where a band of suns begins and ends; z of the borders by sin(altitude).
Layout make_layout() {
  std::vector<double> altitude;
  for (int k = -kSkyBands; k <= kSkyBands; ++k)
    altitude.push_back(90.0 * k / kSkyBands);
  for (const double a : kSunAltitudes) {
    altitude.push_back(a - 0.5 * kSunHeight);
    altitude.push_back(a + 0.5 * kSunHeight);
  }
  std::ranges::sort(altitude);
  std::vector<SkyBand> bands;
  std::vector<SunBand> suns;
  int next = 0;
  for (std::size_t i = 0; i + 1 < altitude.size(); ++i) {
    const bool sun =
        altitude[i + 1] - altitude[i] < 1.01 * kSunHeight &&
        std::ranges::any_of(kSunAltitudes, [&](double a) { return altitude[i] < a && a < altitude[i + 1]; });
    const int cells = sun ? kSunCells : kSkyCells;
    const double low = i == 0 ? -1.0 : bands.back().sin_high;
    const double high = i + 2 == altitude.size() ? 1.0
                        : altitude[i + 1] == 0.0 ? 0.0
                                                 : std::sin(altitude[i + 1] * kDegree);
    bands.push_back({low, high, cells, next, false});
    if (sun)
      suns.push_back({next, next + cells});
    next += cells;
  }
  return {*SkyPartition::from_bands(std::move(bands), "held out"), suns};
}

/// Made once: the same for every room.
const Layout& layout() {
  static const Layout the_layout = make_layout();
  return the_layout;
}

/// Gaussian lobe of a width in degrees about a direction, 1 in its middle.
double glow(const glm::dvec3& d, double azimuth_deg, double altitude_deg, double width_deg) {
  const double a = azimuth_deg * kDegree, h = altitude_deg * kDegree;
  const double away = std::acos(std::clamp(
      glm::dot(d, glm::dvec3(std::cos(h) * std::cos(a), std::cos(h) * std::sin(a), std::sin(h))), -1.0, 1.0));
  return std::exp(-0.5 * away * away / (width_deg * width_deg * kDegree * kDegree));
}

/// Radiance of the ground, 0.6, below the horizon.
double ground_or(const glm::dvec3& d, double sky) { return d.z > 0.0 ? sky : 0.6; }

} // namespace

const SkyPartition& held_out_partition() { return layout().partition; }

namespace {

/// Overcast: L = L_z (1 + 2 sin altitude) / 3 (Moon & Spencer 1942; CIE S 011), ground 0.6. Means over 4 x 4 samples of
/// each region.
std::vector<HeldOutSky> make_smooth_skies() {
  using Radiance = std::function<double(const glm::dvec3&)>;
  const std::array<std::pair<const char*, Radiance>, 5> models = {
      {{"uniform", [](const glm::dvec3&) { return 1.0; }},
       {"overcast", [](const glm::dvec3& d) { return ground_or(d, 10.0 * (1.0 + 2.0 * d.z) / 3.0); }},
       {"slope east", [](const glm::dvec3& d) { return 1.0 + 0.9 * d.x; }},
       {"slope north", [](const glm::dvec3& d) { return 1.0 + 0.9 * d.y; }},
       {"glow", [](const glm::dvec3& d) {
          // One wide glow in each quarter, so that some of it is seen from any window.
          return ground_or(d, 0.5 + 4.0 * (glow(d, 27, 15, 20) + glow(d, 117, 15, 20) + glow(d, 207, 15, 20) +
                                           glow(d, 297, 15, 20)));
        }}}};
  const SkyPartition& partition = held_out_partition();
  std::vector<HeldOutSky> skies;
  for (const auto& [name, radiance] : models) {
    HeldOutSky sky{name, false, std::vector<float>(static_cast<std::size_t>(partition.size()))};
    for (int r = 0; r < partition.size(); ++r) {
      double sum = 0;
      for (int k = 0; k < kSide * kSide; ++k)
        sum += radiance(partition.sample(r, (k % kSide + 0.5) / kSide, (k / kSide + 0.5) / kSide));
      sky.radiance[static_cast<std::size_t>(r)] = static_cast<float>(sum / (kSide * kSide));
    }
    skies.push_back(std::move(sky));
  }
  return skies;
}

} // namespace

const std::vector<HeldOutSky>& smooth_skies() {
  static const std::vector<HeldOutSky> the_skies = make_smooth_skies();
  return the_skies;
}

namespace {

/// The region of a band before which `fraction` of the band's flux has come in.
int region_at(const SunBand& band, std::span<const double> flux, double fraction) {
  const double all = std::accumulate(flux.begin() + band.first, flux.begin() + band.last, 0.0);
  double sum = 0;
  int region = band.first;
  while (region + 1 < band.last && (sum += flux[static_cast<std::size_t>(region)]) < fraction * all)
    ++region;
  return region;
}

HeldOutSky sun_in(int region) {
  HeldOutSky sky{"sun", true, std::vector<float>(static_cast<std::size_t>(held_out_partition().size()), 0.0f)};
  const glm::dvec3 d = held_out_partition().centre(region);
  sky.name += " " + std::to_string(std::lround(std::atan2(d.y, d.x) / kDegree)) + "," +
              std::to_string(std::lround(std::asin(d.z) / kDegree));
  sky.radiance[static_cast<std::size_t>(region)] = 1.0f;
  return sky;
}

} // namespace

/// flux[r] = sum_i w_i H_i of region r, green; sun k of n stands where (k + 1) / (n + 1) of its band's flux is reached.
std::vector<HeldOutSky> suns(std::span<const radiosity::FirstBounceRow> light, std::span<const double> weight,
                             int of_band) {
  std::vector<double> flux(static_cast<std::size_t>(held_out_partition().size()), 0.0);
  for (std::size_t e = 0; e < light.size(); ++e)
    for (std::size_t k = 0; k < light[e].region.size(); ++k)
      flux[static_cast<std::size_t>(light[e].region[k])] += weight[e] * static_cast<double>(light[e].irradiance[k].g);
  double brightest = 0;
  for (const SunBand& band : layout().suns)
    brightest = std::max(brightest, *std::max_element(flux.begin() + band.first, flux.begin() + band.last));
  std::vector<HeldOutSky> skies;
  for (const SunBand& band : layout().suns) {
    int last = -1;
    for (int k = 1; k <= of_band; ++k) {
      const int region = region_at(band, flux, static_cast<double>(k) / (of_band + 1));
      if (region != last && flux[static_cast<std::size_t>(region)] > kFaintest * brightest)
        skies.push_back(sun_in(region));
      last = region;
    }
  }
  return skies;
}

/// H_i of a sky = sum_r L_r H_i,r over the regions that a patch sees. One channel where all panes are colourless.
radiosity::FirstBounce direct_light(std::span<const radiosity::FirstBounceRow> light,
                                    std::span<const HeldOutSky> skies) {
  const bool colourless = std::ranges::all_of(light, [](const radiosity::FirstBounceRow& row) {
    return std::ranges::all_of(row.irradiance, [](const Rgb& c) { return c == Rgb(c.r); });
  });
  radiosity::FirstBounce out{
      .patches = light.size(), .channels = colourless ? 1 : 3, .region = {}, .irradiance = {}, .opening = {}};
  for (std::size_t s = 0; s < skies.size(); ++s)
    out.region.push_back(static_cast<std::int32_t>(s));
  for (const radiosity::FirstBounceRow& row : light)
    out.opening.push_back(row.opening);
  out.irradiance.resize(out.patches * static_cast<std::size_t>(out.channels) * skies.size());
  parallel_for(std::size_t{0}, light.size(), [&](std::size_t e) {
    for (int c = 0; c < out.channels; ++c)
      for (std::size_t s = 0; s < skies.size(); ++s) {
        double sum = 0;
        for (std::size_t k = 0; k < light[e].region.size(); ++k)
          sum += static_cast<double>(light[e].irradiance[k][c]) *
                 static_cast<double>(skies[s].radiance[static_cast<std::size_t>(light[e].region[k])]);
        out.row(e, c)[s] = static_cast<float>(sum);
      }
  });
  return out;
}

/// Regions: sum L dw / sum dw over the samples in the region. Nodes: integral of L and the hat function over the solid
/// angle of the node. A sun keeps its power, L dw.
std::vector<float> radiance_on(const SkyPartition& partition, const HeldOutSky& sky) {
  const SkyPartition& fine = held_out_partition();
  const auto n = static_cast<std::size_t>(partition.size());
  std::vector<double> light(n, 0.0), covered(n, 0.0);
  for (int r = 0; r < fine.size(); ++r) {
    const double sample_sr = fine.solid_angle_sr(r) / (kSide * kSide);
    const double radiance = static_cast<double>(sky.radiance[static_cast<std::size_t>(r)]);
    if (sky.is_sun && radiance == 0.0)
      continue;
    for (int k = 0; k < kSide * kSide; ++k) {
      const glm::dvec3 d = fine.sample(r, (k % kSide + 0.5) / kSide, (k / kSide + 0.5) / kSide);
      const auto add = [&](int region, double weight) {
        light[static_cast<std::size_t>(region)] += weight * sample_sr * radiance;
        covered[static_cast<std::size_t>(region)] += weight * sample_sr;
      };
      if (partition.interpolated())
        for (const RegionWeight& w : partition.interpolation(d))
          add(w.region, w.weight);
      else
        add(partition.region_of(d), 1.0);
    }
  }
  std::vector<float> out(n);
  for (std::size_t i = 0; i < n; ++i) {
    const int region = static_cast<int>(i);
    const double own_sr = partition.solid_angle_sr(region);
    // Of a smooth sky the samples' own solid angle divides, so that how many there are does not matter.
    const double whole_sr = partition.interpolated() ? partition.hat_sr(region) : own_sr;
    const double scale = sky.is_sun ? 1.0 / own_sr : covered[i] > 0.0 ? whole_sr / (covered[i] * own_sr) : 0.0;
    out[i] = static_cast<float>(light[i] * scale);
  }
  return out;
}

/// Point k: frac(1/2 + k / g^(1..3)), g the root of x^4 = x + 1 (Roberts 2018); those near a surface are left out.
std::vector<glm::dvec3> spread_points(const Room& room, const Bounds& bounds, std::size_t count, double clearance) {
  constexpr std::array<double, 3> kStep{0.8191725133961645, 0.6710436067037893,
                                        0.5497004779019703}; // 1/g, 1/g^2, 1/g^3
  const glm::dvec3 low = bounds.min + clearance, size = bounds.size() - 2.0 * clearance;
  const auto near = static_cast<float>(clearance);
  std::vector<glm::dvec3> points;
  if (!(std::min({size.x, size.y, size.z}) > 0.0))
    return points;
  std::vector<std::array<std::uint32_t, 3>> triangles; // panes too
  for (const RoomTriangle& t : room.triangles)
    triangles.push_back(t.vertex);
  const Result<RayScene> surfaces = RayScene::build(room.vertices, triangles);
  if (!surfaces)
    return points;
  for (std::size_t k = 1; k <= count * kMostTries && points.size() < count; ++k) {
    glm::dvec3 p;
    for (int axis = 0; axis < 3; ++axis) {
      const double x = 0.5 + static_cast<double>(k) * kStep[static_cast<std::size_t>(axis)];
      p[axis] = low[axis] + size[axis] * (x - std::floor(x));
    }
    if (surfaces->distance(surfaces->to_local(p), near) >= near)
      points.push_back(p);
  }
  return points;
}

} // namespace daylit::precompute
