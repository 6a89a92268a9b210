#include "scene/sky/perez_sky.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSolarConstant_W_m2 = 1367.0;
constexpr double kMostClear = 12.0, kLeastBright = 0.01, kMostBright = 0.6;
constexpr double kMostIrradiance_W_m2 = 2000.0;

/// Lower ends of the clearness bins, [1990] table 1.
constexpr std::array<double, 8> kBinStart{1.000, 1.065, 1.230, 1.500, 1.950, 2.800, 4.500, 6.200};

/// x = x1 + x2 Z + Delta (x3 + x4 Z) for the parameters a, b, c, d, e: [1993] table 1 with the erratum.
using Shape = std::array<std::array<double, 4>, 5>;
constexpr std::array<Shape, 8> kShape{{{{{1.3525, -0.2576, -0.2690, -1.4366},
                                         {-0.7670, 0.0007, 1.2734, -0.1233},
                                         {2.8000, 0.6004, 1.2375, 1.0000},
                                         {1.8734, 0.6297, 0.9738, 0.2809},
                                         {0.0356, -0.1246, -0.5718, 0.9938}}},
                                       {{{-1.2219, -0.7730, 1.4148, 1.1016},
                                         {-0.2054, 0.0367, -3.9128, 0.9156},
                                         {6.9750, 0.1774, 6.4477, -0.1239},
                                         {-1.5798, -0.5081, -1.7812, 0.1080},
                                         {0.2624, 0.0672, -0.2190, -0.4285}}},
                                       {{{-1.1000, -0.2515, 0.8952, 0.0156},
                                         {0.2782, -0.1812, -4.5000, 1.1766},
                                         {24.7219, -13.0812, -37.7000, 34.8438},
                                         {-5.0000, 1.5218, 3.9229, -2.6204},
                                         {-0.0156, 0.1597, 0.4199, -0.5562}}},
                                       {{{-0.5484, -0.6654, -0.2672, 0.7117},
                                         {0.7234, -0.6219, -5.6812, 2.6297},
                                         {33.3389, -18.3000, -62.2500, 52.0781},
                                         {-3.5000, 0.0016, 1.1477, 0.1062},
                                         {0.4659, -0.3296, -0.0876, -0.0329}}},
                                       {{{-0.6000, -0.3566, -2.5000, 2.3250},
                                         {0.2937, 0.0496, -5.6812, 1.8415},
                                         {21.0000, -4.7656, -21.5906, 7.2492},
                                         {-3.5000, -0.1554, 1.4062, 0.3988},
                                         {0.0032, 0.0766, -0.0656, -0.1294}}},
                                       {{{-1.0156, -0.3670, 1.0078, 1.4051},
                                         {0.2875, -0.5328, -3.8500, 3.3750},
                                         {14.0000, -0.9999, -7.1406, 7.5469},
                                         {-3.4000, -0.1078, -1.0750, 1.5702},
                                         {-0.0672, 0.4016, 0.3017, -0.4844}}},
                                       {{{-1.0000, 0.0211, 0.5025, -0.5119},
                                         {-0.3000, 0.1922, 0.7023, -1.6317},
                                         {19.0000, -5.0000, 1.2438, -1.9094},
                                         {-4.0000, 0.0250, 0.3844, 0.2656},
                                         {1.0468, -0.3788, -2.4517, 1.4656}}},
                                       {{{-1.0500, 0.0289, 0.4260, 0.3590},
                                         {-0.3250, 0.1156, 0.7781, 0.0025},
                                         {31.0625, -14.5000, -46.1148, 55.3750},
                                         {-7.2312, 0.4050, 13.3500, 0.6234},
                                         {1.5000, -0.6426, 1.8564, 0.5636}}}}};

/// [1990] table 4: diffuse a + b W + c cos Z + d ln Delta; direct a + b W + c exp(5.73 Z - 5) + d Delta.
using Efficacy = std::array<double, 4>;
constexpr std::array<Efficacy, 8> kDiffuseEfficacy{{{97.24, -0.46, 12.00, -8.91},
                                                    {107.22, 1.15, 0.59, -3.95},
                                                    {104.97, 2.96, -5.53, -8.77},
                                                    {102.39, 5.59, -13.95, -13.90},
                                                    {100.71, 5.94, -22.75, -23.74},
                                                    {106.42, 3.83, -36.15, -28.83},
                                                    {141.88, 1.90, -53.24, -14.03},
                                                    {152.23, 0.35, -45.27, -7.98}}};
constexpr std::array<Efficacy, 8> kDirectEfficacy{{{57.20, -4.55, -2.98, 117.12},
                                                   {98.99, -3.46, -1.21, 12.38},
                                                   {109.83, -4.90, -1.71, -8.81},
                                                   {110.34, -5.84, -1.99, -4.56},
                                                   {106.36, -3.97, -1.75, -6.16},
                                                   {107.19, -1.25, -1.51, -26.73},
                                                   {105.75, 0.77, -1.26, -34.44},
                                                   {101.18, 1.58, -1.10, -8.29}}};

/// Radians, 0..pi/2: a sun below the horizon counts as on it.
double zenith_angle(const PerezWeather& w) { return 0.5 * kPi - std::clamp(w.sun_altitude, 0.0, 0.5 * kPi); }

/// Kasten 1966.
/// m = 1 / (cos Z + 0.15 (93.885 - Z)^-1.253), Z in degrees.
double relative_air_mass(double zenith) {
  return 1.0 / (std::cos(zenith) + 0.15 * std::pow(93.885 - zenith * 180.0 / kPi, -1.253));
}

/// Index of the clearness bin, 0 (overcast) to 7 (clear).
std::size_t bin_of(double clearness) {
  return static_cast<std::size_t>(std::upper_bound(kBinStart.begin() + 1, kBinStart.end(), clearness) -
                                  kBinStart.begin() - 1);
}

/// Parameters of gradation and indicatrix from bin, zenith angle (rad) and brightness Delta ([1993] eq. 6 to 8).
SkyDistribution shape_of(std::size_t bin, double zenith, double brightness) {
  const double delta = bin >= 1 && bin <= 4 ? std::max(brightness, 0.2) : brightness;
  const auto fit = [&](std::size_t k) {
    const std::array<double, 4>& x = kShape[bin][k];
    return x[0] + x[1] * zenith + delta * (x[2] + x[3] * zenith);
  };
  SkyDistribution sky{fit(0), fit(1), fit(2), fit(3), fit(4), 1.0};
  if (bin == 0) { // [1993] eq. 7 and 8
    const auto& [c, d] = std::pair(kShape[0][2], kShape[0][3]);
    sky.c = std::exp(std::pow(delta * (c[0] + c[1] * zenith), c[2])) - c[3];
    sky.d = -std::exp(delta * (d[0] + d[1] * zenith)) + d[2] + delta * d[3];
  }
  return sky;
}

/// The value, held within the range of the fits; what was held is noted.
double limited(double value, double low, double high, const char* name, std::vector<std::string>& notes) {
  const double inside = std::clamp(value, low, high);
  if (inside < value - 1e-9 || inside > value + 1e-9)
    notes.push_back(fmt::format("sky {} {:.4g} is outside the Perez model; {:.4g} is used", name, value, inside));
  return inside;
}

Error weather_error(std::string what) {
  return {ErrorCode::value_invalid, std::move(what), "weather",
          "give the direct normal and the diffuse horizontal irradiance of a daytime hour"};
}

} // namespace

/// Weather -> clearness and brightness -> shape by bin, and luminous efficacies lm/W of diffuse and direct light by
/// bin: illuminance (lx) = efficacy times irradiance (W/m^2).
Result<PerezSky> perez_sky(const PerezWeather& w) {
  const double direct = w.direct_normal_W_m2, diffuse = w.diffuse_horizontal_W_m2;
  if (!(direct >= 0.0 && direct <= kMostIrradiance_W_m2 && diffuse >= 0.0 && diffuse <= kMostIrradiance_W_m2))
    return weather_error(fmt::format("irradiances {} and {} W/m2 are no daylight", direct, diffuse));
  if (!(diffuse > 0.0))
    return weather_error("there is no diffuse irradiance");
  if (!(std::abs(w.dew_point_C) <= 100.0))
    return weather_error(fmt::format("a dew point of {} C is none", w.dew_point_C));
  PerezSky sky;
  // Clearness ((E_d + E_n)/E_d + 1.041 Z^3) / (1 + 1.041 Z^3), Z in radians ([1990] eq. 1); brightness E_d m / E_0 with
  // the extraterrestrial E_0 = 1367 W/m^2 over the squared distance of the sun in au ([1990] eq. 2).
  const double zenith = zenith_angle(w), cubed = 1.041 * zenith * zenith * zenith;
  sky.clearness =
      limited(((diffuse + direct) / diffuse + cubed) / (1.0 + cubed), 1.0, kMostClear, "clearness", sky.notes);
  sky.brightness =
      limited(diffuse * relative_air_mass(zenith) * w.sun_distance_au * w.sun_distance_au / kSolarConstant_W_m2,
              kLeastBright, kMostBright, "brightness", sky.notes);
  const std::size_t bin = bin_of(sky.clearness);
  sky.distribution = shape_of(bin, zenith, sky.brightness);
  if (!(sky.distribution.horizontal_integral(std::cos(zenith)) > 0.0)) {
    sky.notes.emplace_back("the Perez model gives no positive luminance here; a uniform sky is used");
    sky.distribution = SkyDistribution{};
  }
  const double water_cm = std::exp(0.07 * w.dew_point_C - 0.075); // [1990] eq. 3
  const Efficacy &f = kDiffuseEfficacy[bin], &b = kDirectEfficacy[bin];
  sky.diffuse_efficacy_lm_W =
      std::max(0.0, f[0] + f[1] * water_cm + f[2] * std::cos(zenith) + f[3] * std::log(sky.brightness));
  sky.direct_efficacy_lm_W =
      std::max(0.0, b[0] + b[1] * water_cm + b[2] * std::exp(5.73 * zenith - 5.0) + b[3] * sky.brightness);
  sky.diffuse_horizontal_lx = diffuse * sky.diffuse_efficacy_lm_W;
  sky.direct_normal_lx = direct * sky.direct_efficacy_lm_W;
  return sky;
}

/// Solves illuminance = efficacy(weather) * irradiance for both irradiances, lx -> W/m^2: damped fixed-point iteration
/// to 1e-9, from 100 and 120 lm/W.
Result<PerezWeather> weather_from_illuminance(double direct_lx, double diffuse_lx, PerezWeather w) {
  w.direct_normal_W_m2 = direct_lx / 100.0;
  w.diffuse_horizontal_W_m2 = diffuse_lx / 120.0;
  for (int step = 0; step < 200; ++step) {
    const Result<PerezSky> sky = perez_sky(w);
    if (!sky)
      return sky.error();
    if (std::abs(sky->direct_normal_lx - direct_lx) <= 1e-9 * direct_lx &&
        std::abs(sky->diffuse_horizontal_lx - diffuse_lx) <= 1e-9 * diffuse_lx)
      return w;
    // Half steps: between two bins the plain iteration may swing.
    const double direct = sky->direct_efficacy_lm_W > 0.0 ? direct_lx / sky->direct_efficacy_lm_W : 0.0;
    const double diffuse = sky->diffuse_efficacy_lm_W > 0.0 ? diffuse_lx / sky->diffuse_efficacy_lm_W : 0.0;
    w.direct_normal_W_m2 = 0.5 * (w.direct_normal_W_m2 + direct);
    w.diffuse_horizontal_W_m2 = 0.5 * (w.diffuse_horizontal_W_m2 + diffuse);
  }
  return weather_error(fmt::format("no irradiances have the illuminances {} and {} lx", direct_lx, diffuse_lx));
}

} // namespace daylit
