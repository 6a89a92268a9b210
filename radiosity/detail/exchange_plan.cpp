#include "radiosity/detail/exchange_plan.h"

#include <algorithm>
#include <array>

#include <tbb/parallel_invoke.h>

namespace daylit::radiosity {

namespace {

constexpr double kExpectedRank = 9;
constexpr double kWorthSplitting = 0.95; // a rectangle of more than this part of the work is kept as one dense block
constexpr std::uint32_t kParallelSize = 256; // of the larger cluster

class Planner {
public:
  Planner(const ClusterTree& tree, const BlockVisibility& visibility, const PlanOptions& options)
      : tree_(tree), visibility_(visibility), options_(options) {
    for (const Cluster& c : tree.clusters())
      black_.push_back(!options.black.empty() &&
                       std::find(options.black.begin() + c.first, options.black.begin() + c.last, false) ==
                           options.black.begin() + c.last);
  }

  /// Block cluster tree of a hierarchical matrix (Hackbusch 2015): nothing where two clusters cannot see each other,
  /// a product where the kernel between them is smooth, dense between leaves, else the children.
  ExchangePlan plan(std::int32_t a, std::int32_t b, bool clear) const {
    const Cluster &ca = tree_[a], &cb = tree_[b];
    if (cannot_see(ca, cb))
      return {};
    if (black_[static_cast<std::size_t>(a)] && black_[static_cast<std::size_t>(b)])
      return nothing(std::uint64_t{ca.size()} * (a == b ? ca.size() - 1 : 2 * cb.size()) / 2);
    if (a == b)
      return ca.childless()
                 ? dense(a, b, false)
                 : coalesce(a, b,
                            join({{{ca.child[0], ca.child[0]}, {ca.child[0], ca.child[1]}, {ca.child[1], ca.child[1]}}},
                                 ca.size(), false));
    if (!clear) {
      const Visibility seen = visibility_.between_clusters(tree_, ca, cb);
      if (seen == Visibility::hidden)
        return {};
      clear = seen == Visibility::clear;
    }
    if (clear && smooth(ca, cb))
      return low_rank(a, b);
    if (ca.childless() && cb.childless())
      return dense(a, b, clear);
    return coalesce(a, b, split(a, b, clear));
  }

private:
  using Pair = std::array<std::int32_t, 2>;

  bool cannot_see(const Cluster& a, const Cluster& b) const {
    return (a.plane >= 0 && a.plane == b.plane) || visibility_.behind(tree_, a, b) || visibility_.behind(tree_, b, a);
  }
  /// Admissible: distance >= separation * larger diameter, and neither horizon nor touching edges disturb the kernel.
  bool smooth(const Cluster& a, const Cluster& b) const {
    return std::min(a.size(), b.size()) >= options_.min_size &&
           distance(a.box, b.box) >= options_.separation * std::max(diameter(a.box), diameter(b.box)) &&
           visibility_.in_front(tree_, a, b) && visibility_.in_front(tree_, b, a);
  }

  static ExchangePlan nothing(std::uint64_t black_pairs) {
    ExchangePlan none;
    none.black_pairs = black_pairs;
    return none;
  }
  ExchangePlan dense(std::int32_t a, std::int32_t b, bool clear) const {
    return {{{a, b, false, 0, 1}}, {{a, b, clear}}, area(a, b), work(a, b), 0};
  }
  ExchangePlan low_rank(std::int32_t a, std::int32_t b) const {
    const double values = kExpectedRank * (tree_[a].size() + tree_[b].size());
    return {{{a, b, true, 0, 1}}, {{a, b, true}}, values, 2 * values, 0};
  }
  double area(std::int32_t a, std::int32_t b) const {
    return static_cast<double>(tree_[a].size()) * static_cast<double>(tree_[b].size());
  }
  double work(std::int32_t a, std::int32_t b) const { return (a == b ? 1 : 2) * area(a, b); }

  ExchangePlan split(std::int32_t a, std::int32_t b, bool clear) const {
    const Cluster &ca = tree_[a], &cb = tree_[b];
    const std::uint32_t size = std::max(ca.size(), cb.size());
    const bool cut_a = !ca.childless() && (cb.childless() || 2 * diameter(ca.box) > diameter(cb.box));
    const bool cut_b = !cb.childless() && (ca.childless() || 2 * diameter(cb.box) > diameter(ca.box));
    if (cut_a && cut_b)
      return join({{{ca.child[0], cb.child[0]},
                    {ca.child[0], cb.child[1]},
                    {ca.child[1], cb.child[0]},
                    {ca.child[1], cb.child[1]}}},
                  size, clear);
    if (cut_a)
      return join({{{ca.child[0], b}, {ca.child[1], b}}}, size, clear);
    return join({{{a, cb.child[0]}, {a, cb.child[1]}}}, size, clear);
  }

  ExchangePlan join(const std::vector<Pair>& pairs, std::uint32_t size, bool clear) const {
    std::array<ExchangePlan, 4> part;
    const auto one = [&](std::size_t k) {
      if (k < pairs.size())
        part[k] = plan(pairs[k][0], pairs[k][1], clear);
    };
    if (size >= kParallelSize)
      tbb::parallel_invoke([&] { one(0); }, [&] { one(1); }, [&] { one(2); }, [&] { one(3); });
    else
      for (std::size_t k = 0; k < pairs.size(); ++k)
        one(k);
    ExchangePlan all;
    for (ExchangePlan& p : part) {
      for (PlanBlock& b : p.blocks) {
        b.first_tile += all.tiles.size();
        all.blocks.push_back(b);
      }
      all.tiles.insert(all.tiles.end(), p.tiles.begin(), p.tiles.end());
      all.values += p.values;
      all.work += p.work;
      all.black_pairs += p.black_pairs;
    }
    return all;
  }

  /// Many small products cost more than one large one.
  ExchangePlan coalesce(std::int32_t a, std::int32_t b, ExchangePlan parts) const {
    if (parts.blocks.empty() || parts.work < kWorthSplitting * work(a, b))
      return parts;
    parts.blocks = {{a, b, false, 0, parts.tiles.size()}};
    parts.values = area(a, b);
    parts.work = work(a, b);
    return parts;
  }

  const ClusterTree& tree_;
  const BlockVisibility& visibility_;
  const PlanOptions& options_;
  std::vector<bool> black_; ///< per cluster
};

} // namespace

ExchangePlan plan_exchange(const ClusterTree& tree, const BlockVisibility& visibility, const PlanOptions& options) {
  if (tree.clusters().empty())
    return {};
  return Planner(tree, visibility, options).plan(0, 0, false);
}

} // namespace daylit::radiosity
