#include "precompute/surface_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <queue>

#include "scene/core/parallel.h"

namespace daylit::precompute {

namespace {

constexpr double kLeast = 1e-6;  ///< of the largest weight in a cluster's mean: where nothing comes from
constexpr float kBlack = 1e-12f; ///< reflects nothing: its square is lost in single precision

bool is_black(const Rgb& reflectance) { return std::max({reflectance.r, reflectance.g, reflectance.b}) < kBlack; }

/// Where a patch is, how it is turned and what it reflects: clusters are small in all of these.
using Features = std::array<double, 9>;

/// Middle in metres; normal and reflectance times the size of the room, so that all are lengths.
std::vector<Features> features(const radiosity::PatchSet& set, const std::vector<std::uint32_t>& lit) {
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
  for (const radiosity::Patch& e : set.patches)
    for (const glm::dvec3& c : e.corner) {
      low = glm::min(low, c);
      high = glm::max(high, c);
    }
  const double size = set.patches.empty() ? 1.0 : std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  std::vector<Features> list;
  for (const std::uint32_t i : lit) {
    const radiosity::Patch& e = set.patches[i];
    const glm::dvec3 p = (e.corner[0] + e.corner[1] + e.corner[2]) / 3.0, n = size * e.normal,
                     r = size * glm::dvec3(e.reflectance);
    list.push_back({p.x, p.y, p.z, n.x, n.y, n.z, r.x, r.y, r.z});
  }
  return list;
}

/// What the probes get of a patch's light, as far as it is known before: A rho W.
double power_of(const radiosity::Patch& p) {
  return p.area_m2 * static_cast<double>((p.reflectance.r + p.reflectance.g + p.reflectance.b) / 3.0f * p.worth());
}

struct Group {
  double distortion = 0; ///< what its mean may be off by: extent^2 sum of A rho W (Gersho 1979: equal in all is best)
  int axis = 0;
  std::size_t begin = 0, end = 0;
  bool operator<(const Group& other) const { // ties must not depend on the heap
    return distortion != other.distortion ? distortion < other.distortion : begin > other.begin;
  }
};

/// Longest side of the box around the features of some patches, and its axis.
Group measured(const std::vector<Features>& at, const std::vector<double>& power,
               const std::vector<std::uint32_t>& order, std::size_t begin, std::size_t end) {
  Group g{0, 0, begin, end};
  double extent = -1;
  for (int axis = 0; axis < 9; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    double low = at[order[begin]][a], high = low;
    for (std::size_t k = begin; k < end; ++k) {
      low = std::min(low, at[order[k]][a]);
      high = std::max(high, at[order[k]][a]);
    }
    if (high - low > extent) {
      extent = high - low;
      g.axis = axis;
    }
  }
  double sum = 0;
  for (std::size_t k = begin; k < end; ++k)
    sum += power[order[k]];
  g.distortion = extent * extent * sum;
  return g;
}

/// Splits the group of the largest distortion in half until there are enough. Cluster of each patch; -1 of those that
/// are not `lit`.
std::vector<std::int32_t> find_clusters(const radiosity::PatchSet& set, const std::vector<std::uint32_t>& lit,
                                        std::size_t most, std::size_t& count) {
  const std::vector<Features> at = features(set, lit);
  std::vector<double> power;
  for (const std::uint32_t i : lit)
    power.push_back(power_of(set.patches[i]));
  std::vector<std::uint32_t> order(lit.size());
  std::iota(order.begin(), order.end(), 0u);
  std::priority_queue<Group> groups;
  std::vector<Group> done;
  if (!order.empty())
    groups.push(measured(at, power, order, 0, order.size()));
  while (!groups.empty() && groups.size() + done.size() < most) {
    const Group g = groups.top();
    groups.pop();
    if (g.end - g.begin < 2) {
      done.push_back(g);
      continue;
    }
    const std::size_t middle = g.begin + (g.end - g.begin) / 2;
    const auto axis = static_cast<std::size_t>(g.axis);
    std::sort(order.begin() + std::ptrdiff_t(g.begin), order.begin() + std::ptrdiff_t(g.end),
              [&](std::uint32_t a, std::uint32_t b) {
                return at[a][axis] != at[b][axis] ? at[a][axis] < at[b][axis] : a < b;
              });
    groups.push(measured(at, power, order, g.begin, middle));
    groups.push(measured(at, power, order, middle, g.end));
  }
  for (; !groups.empty(); groups.pop())
    done.push_back(groups.top());
  count = done.size();
  std::vector<std::int32_t> cluster(set.patches.size(), -1);
  for (std::size_t k = 0; k < done.size(); ++k)
    for (std::size_t i = done[k].begin; i < done[k].end; ++i)
      cluster[lit[order[i]]] = static_cast<std::int32_t>(k);
  return cluster;
}

/// Patches with an element that the sky lights.
std::vector<std::uint32_t> lit_patches(const SurfaceLight& light) {
  std::vector<std::uint32_t> lit;
  for (const std::uint32_t element : light.source)
    if (lit.empty() || lit.back() != light.parent[element])
      lit.push_back(light.parent[element]);
  return lit;
}

/// What each patch's light counts in its cluster's mean for some probes: A r / sum A r with r = `further` of
/// ProbeSight. By reciprocity what these probes together receive from the cluster is then exact for any light, where an
/// area mean would take light that falls on a slat's outer edge for light on the inner one. `of_all`: the same r of all
/// probes together, for clusters that bring these nothing.
std::vector<float> parts_of_means(const radiosity::PatchSet& set, std::span<const float> further,
                                  std::span<const float> of_all, const std::vector<std::int32_t>& cluster_of,
                                  std::size_t clusters) {
  const auto unit = [](std::span<const float> r) {
    const float most = r.empty() ? 0.0f : *std::ranges::max_element(r);
    return most > 0 ? 1.0 / static_cast<double>(most) : 0.0;
  };
  const double own = unit(further), all = unit(of_all);
  std::vector<double> weight(cluster_of.size()), sum(clusters, 0.0);
  for (std::size_t p = 0; p < cluster_of.size(); ++p)
    if (cluster_of[p] >= 0) {
      weight[p] = set.patches[p].area_m2 *
                  (own * static_cast<double>(further[p]) + kLeast * (all * static_cast<double>(of_all[p]) + kLeast));
      sum[static_cast<std::size_t>(cluster_of[p])] += weight[p];
    }
  std::vector<float> part(cluster_of.size(), 0.0f);
  for (std::size_t p = 0; p < cluster_of.size(); ++p)
    if (cluster_of[p] >= 0)
      part[p] = static_cast<float>(weight[p] / sum[static_cast<std::size_t>(cluster_of[p])]);
  return part;
}

/// The sources' clusters are those of their patches, with the means that all probes together need and those that each
/// group needs.
void join_clusters(const radiosity::PatchSet& set, const std::vector<float>& further,
                   const std::vector<std::int32_t>& cluster_of, SurfaceLight& light) {
  const std::size_t groups = further.size() / light.patches;
  std::vector<float> of_all(light.patches, 0.0f);
  for (std::size_t k = 0; k < further.size(); ++k)
    of_all[k % light.patches] += further[k];
  const auto add = [&](std::span<const float> of_group, std::vector<float>& fractions) {
    const std::vector<float> part = parts_of_means(set, of_group, of_all, cluster_of, light.clusters);
    for (const std::uint32_t element : light.source)
      fractions.push_back(light.element_fraction[element] * part[light.parent[element]]);
  };
  for (const std::uint32_t element : light.source)
    light.cluster.push_back(static_cast<std::uint32_t>(cluster_of[light.parent[element]]));
  add(of_all, light.cluster_fraction);
  for (std::size_t g = 0; g < groups; ++g)
    add(std::span(further).subspan(g * light.patches, light.patches), light.fraction_for_probes);
}

/// Irradiance of each patch under a white sky: mean over its elements.
std::vector<float> white_sky(const detail::LightElements& elements, std::size_t patches,
                             const std::vector<radiosity::FirstBounceRow>& rows) {
  std::vector<float> of_patches(patches, 0.0f);
  for (std::size_t element = 0; element < rows.size(); ++element) {
    double sky = 0;
    for (const Rgb& x : rows[element].irradiance)
      sky += (double(x.r) + double(x.g) + double(x.b)) / 3.0;
    of_patches[elements.parent[element]] += elements.fraction[element] * static_cast<float>(sky);
  }
  return of_patches;
}

/// Column k: irradiance 1 on cluster k. The last column: the whole sky, for the audit of energy.
radiosity::FirstBounce cluster_columns(const SurfaceLight& light, const std::vector<float>& sky,
                                       const std::vector<std::int32_t>& cluster_of, std::vector<float> opening) {
  const std::size_t columns = light.clusters + 1;
  radiosity::FirstBounce first{.patches = light.patches,
                               .channels = 1,
                               .region = std::vector<std::int32_t>(columns),
                               .irradiance = std::vector<float>(light.patches * columns, 0.0f),
                               .opening = std::move(opening)};
  std::iota(first.region.begin(), first.region.end(), 0);
  for (std::size_t e = 0; e < light.patches; ++e) {
    if (cluster_of[e] >= 0)
      first.row(e, 0)[cluster_of[e]] = 1.0f;
    first.row(e, 0)[light.clusters] = sky[e];
  }
  return first;
}

/// The last column alone.
radiosity::EnergyBalance audit_sky(const radiosity::PatchSet& set, const radiosity::ExchangeMatrix& exchange,
                                   const radiosity::FirstBounce& first, const radiosity::Radiosity& all) {
  const std::size_t columns = first.columns();
  radiosity::FirstBounce sky{
      .patches = first.patches, .channels = 1, .region = {0}, .irradiance = {}, .opening = first.opening};
  radiosity::Radiosity b{.patches = all.patches, .columns = 3, .b = {}, .copy_of = all.copy_of};
  for (std::size_t e = 0; e < first.patches; ++e) {
    sky.irradiance.push_back(first.row(e, 0)[columns - 1]);
    for (std::size_t c = 0; c < 3; ++c)
      b.b.push_back(all.row(e)[(c + 1) * columns - 1]);
  }
  return radiosity::audit_energy(set, exchange, sky, b);
}

/// B - rho on the cluster itself: the solution for irradiance 1 on a cluster without what the cluster reflects at once.
void keep_further_bounces(const radiosity::Radiosity& solved, const radiosity::PatchSet& set,
                          const std::vector<std::int32_t>& cluster_of, SurfaceLight& light) {
  const std::size_t n = light.clusters, columns = n + 1;
  light.bounced.resize(light.patches * 3 * n);
  for (std::size_t e = 0; e < light.patches; ++e)
    for (std::size_t c = 0; c < 3; ++c) {
      float* to = light.bounced.data() + (e * 3 + c) * n;
      std::copy_n(solved.row(e) + static_cast<std::size_t>(solved.copy_of[c]) * columns, n, to);
      if (cluster_of[e] >= 0)
        to[cluster_of[e]] -= set.patches[e].reflectance[static_cast<int>(c)];
    }
}

/// Adds a fraction of a row to light by region.
void add_row(const radiosity::FirstBounceRow& row, float fraction, std::map<std::int32_t, Rgb>& sum) {
  for (std::size_t k = 0; k < row.region.size(); ++k)
    sum[row.region[k]] += fraction * row.irradiance[k];
}

/// The first of some sources counts as much as all of them. `fractions`: [..][source].
void add_up(const std::vector<std::size_t>& sources, std::size_t count, std::vector<float>& fractions) {
  for (std::size_t row = 0; row < fractions.size(); row += count) {
    float sum = 0;
    for (const std::size_t s : sources)
      sum += fractions[row + s];
    fractions[row + sources.front()] = sum;
  }
}

/// What a cluster's mean takes of some sources, E = sum f_s E_s / sum f_s, on the first of them.
void join_sources(const std::vector<std::size_t>& sources, SurfaceLight& light) {
  std::map<std::int32_t, Rgb> sum;
  float fraction = 0;
  for (const std::size_t s : sources) {
    add_row(light.light[s], light.cluster_fraction[s], sum);
    fraction += light.cluster_fraction[s];
    if (s != sources.front())
      light.light[s] = {};
  }
  radiosity::FirstBounceRow& joined = light.light[sources.front()];
  joined.region.clear();
  joined.irradiance.clear();
  for (const auto& [region, irradiance] : sum) {
    joined.region.push_back(region);
    joined.irradiance.push_back(irradiance / fraction);
  }
  add_up(sources, light.source.size(), light.cluster_fraction);
  add_up(sources, light.source.size(), light.fraction_for_probes);
  light.element_fraction[light.source[sources.front()]] = 1.0f; // the one source of its patch
}

/// Keeps those of each row's values whose source has light. `values`: [..][source].
template <class T>
void keep_lit(const std::vector<std::uint8_t>& lit, std::vector<T>& values) {
  std::vector<T> kept;
  for (std::size_t k = 0; k < values.size(); ++k)
    if (lit[k % lit.size()] != 0)
      kept.push_back(std::move(values[k]));
  values = std::move(kept);
}

/// Leaves out the sources without light.
void drop_dark(SurfaceLight& light) {
  std::vector<std::uint8_t> lit;
  for (const radiosity::FirstBounceRow& row : light.light)
    lit.push_back(row.region.empty() ? 0 : 1);
  keep_lit(lit, light.source);
  keep_lit(lit, light.cluster);
  keep_lit(lit, light.cluster_fraction);
  keep_lit(lit, light.fraction_for_probes);
  keep_lit(lit, light.reflectance);
  keep_lit(lit, light.light);
}

} // namespace

/// E = sum f_s E_s / sum f_s over the unseen sources of a cluster, f_s their fractions of it.
SurfaceLight join_unseen(SurfaceLight light, std::span<const std::uint8_t> seen) {
  std::vector<std::vector<std::size_t>> unseen(light.clusters);
  for (std::size_t s = 0; s < light.source.size(); ++s)
    if (!seen[light.parent[light.source[s]]])
      unseen[light.cluster[s]].push_back(s);
  parallel_for(std::size_t{0}, unseen.size(), [&](std::size_t c) {
    if (unseen[c].size() > 1)
      join_sources(unseen[c], light);
  });
  drop_dark(light);
  return light;
}

/// Sources are the elements that any node lights and that reflect; B = rho H on them at once, what comes back later by
/// clusters.
Result<SurfaceLight> surface_light(const radiosity::PatchSet& set, const detail::LightElements& elements,
                                   const radiosity::ExchangeMatrix& exchange,
                                   std::vector<radiosity::FirstBounceRow> rows, const ProbeSight& probes,
                                   std::size_t clusters, const radiosity::SolveOptions& options,
                                   const Progress& progress, SurfaceLightReport& report) {
  SurfaceLight light;
  light.patches = set.patches.size();
  light.elements = rows.size();
  light.parent = elements.parent;
  light.element_fraction = elements.fraction;
  light.further = elements.further;
  std::vector<float> opening = elements.opening_of_parents(rows);
  const std::vector<float> sky = white_sky(elements, light.patches, rows);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Rgb& reflectance = elements.patches.patches[i].reflectance;
    if (rows[i].region.empty() || is_black(reflectance))
      continue;
    light.source.push_back(static_cast<std::uint32_t>(i));
    light.reflectance.push_back(reflectance);
    light.light.push_back(std::move(rows[i]));
  }
  const std::vector<std::int32_t> cluster_of = find_clusters(set, lit_patches(light), clusters, light.clusters);
  join_clusters(set, probes.further, cluster_of, light);
  const radiosity::FirstBounce first = cluster_columns(light, sky, cluster_of, std::move(opening));
  const auto solved = radiosity::solve_radiosity(set, exchange, first, options, progress, &report.solve);
  if (!solved)
    return solved.error();
  report.energy = audit_sky(set, exchange, first, *solved);
  keep_further_bounces(*solved, set, cluster_of, light);
  return join_unseen(std::move(light), probes.seen);
}

} // namespace daylit::precompute
