#pragma once

// A cluster of neighbouring probes on its way to a product of two factors.

#include <cstdint>
#include <vector>

#include "precompute/compact_sky.h"
#include "precompute/detail/factors.h"
#include "precompute/detail/seen_parts.h"
#include "precompute/detail/sun_metric.h"
#include "precompute/detail/surface_transport.h"

namespace daylit::precompute::detail {

/// The coefficients of l = 4 in a cluster of probes, as a second, small pair of factors beside that of the nine: the
/// same parts, suns and steps, with rows weighted by what an error in them does to irradiance.
struct Band4 {
  Basis basis;                    ///< [coefficient][rank]
  std::vector<float> coordinates; ///< [rank][part]
  Factors factors;

  /// `rows`: gather rows [coefficient][part]; `radiosity`: of the parts under random suns, [part][columns]; `left`:
  /// what the nine may lose of what they see under all these suns, squared.
  void reduce(const std::vector<float>& rows, std::size_t coefficients, const std::vector<float>& radiosity,
              std::size_t columns, double left);
  void factorise(const SurfaceTransport& surfaces, const SeenParts& seen, const SunMetric& metric, std::size_t width);
  /// Keeps what is worth more than `per_byte` of squared error; takes the weight off.
  void choose_storage(double per_byte, const std::vector<float>& suns, std::size_t columns);
};

constexpr std::size_t kProjections = 16; ///< random signs that measure norms

/// The metric of suns with what is drawn from it.
struct Measure {
  const SunColumns& columns;
  const std::vector<float>& weight; ///< of a sun at each column
  const SunMetric& metric;

  /// Irradiance of the sources under random suns, in units of each source's own, [source][count].
  std::vector<float> suns(std::size_t count) const;
};

/// Ids of points, and what the stages leave behind. Gather rows [coefficient][part] are basis times coordinates:
/// neighbouring probes see the same room.
struct ProbeCluster {
  std::uint64_t id = 0; ///< its number
  std::vector<std::uint32_t> point;
  SeenParts seen;
  Basis basis;                    ///< [coefficient][rank]
  std::vector<float> coordinates; ///< [rank][part]
  std::vector<float> projected;   ///< [projection][lit part]: random signs times the transport
  SunMetric own;                  ///< units of the lit parts, of which the factors know
  Factors factors;
  double unseen = 0; ///< squared error of what the sketches missed
  double power = 0;  ///< mean square of the coefficients under the random suns of reduce()
  float gain = 1;    ///< what an error counts here beside one where there is more light
  Band4 band4;

  std::size_t coefficients() const { return point.size() * 9; } ///< of one channel

  /// Norms under random signs, and the few combinations of the gather rows that differ under suns. `radiosity`: of the
  /// room under random suns of random colour, [element][columns]. `error`: relative, asked of the basis.
  void reduce(const SurfaceLight& light, const SurfaceTransport& surfaces, const GatherRows& gather,
              const std::vector<float>& radiosity, double error);
  /// Errors count `gain` times as much from here on, until take_gain_off().
  void set_gain(float gain);
  void take_gain_off();
  /// Row factors are in the basis until expand(): much shorter. `width`: of the first sketch; `limit`: of the squared
  /// error that a sketch may miss.
  void factorise(const SurfaceTransport& surfaces, const SunMetric& of_sources, std::size_t width, double limit);
  void expand();
  /// What the factors, as they are stored, leave of the projected transport, [projection][source].
  std::vector<float> missed() const;

private:
  std::vector<float> signs() const;
  std::vector<float> signs_in_basis() const;
  void project(const SurfaceTransport& surfaces, const std::vector<float>& rows);
};

} // namespace daylit::precompute::detail
