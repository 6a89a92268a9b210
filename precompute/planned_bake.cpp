#include "precompute/planned_bake.h"

#include "precompute/adaptive_sky.h"
#include "precompute/room_frame.h"

namespace daylit::precompute {

namespace {

/// The records of a repeated bake, in the same file beside those of the first.
class RepeatedStore final : public radiosity::WorkStore {
public:
  explicit RepeatedStore(radiosity::WorkStore& base) : base_(base) {}
  std::optional<std::vector<std::byte>> find(const Name& name) override { return base_.find(moved(name)); }
  void keep(const Name& name, std::span<const std::byte> bytes) override { base_.keep(moved(name), bytes); }

private:
  static constexpr std::uint32_t kRepeated = 1u << 16; ///< parts are channels: far below
  static Name moved(Name name) {
    name.part += kRepeated;
    return name;
  }
  radiosity::WorkStore& base_;
};

/// One bake at the settings of out.plan, measured.
Result<void> bake_plan(const RoomFile& room, radiosity::WorkStore* store, const Progress& progress, PlannedBake& out) {
  const auto partition = sky_for(room, out.plan.regions, progress);
  if (!partition)
    return partition.error();
  out.plan.options.store = store;
  out.report = BakeReport{};
  auto volume = bake_room(room, *partition, out.plan.options, progress, out.report);
  if (!volume)
    return volume.error();
  out.volume = std::move(*volume);
  out.measured = measured_error(out.calibration, out.report);
  return {};
}

} // namespace

/// Calibrate, plan, bake, measure; at most once more, from what the first bake showed.
Result<PlannedBake> bake_to_error(const RoomFile& room, const PlanRequest& request, radiosity::WorkStore* store,
                                  const Progress& progress, const std::function<void(const std::string&)>& announce) {
  PlannedBake out{};
  auto calibration = run_calibration_bake(room, request.points, progress);
  if (!calibration)
    return calibration.error();
  out.calibration = std::move(*calibration);
  const auto plan = make_plan(out.calibration, request);
  if (!plan)
    return plan.error();
  out.plan = *plan;
  announce(to_text(out.plan));
  if (const Result<void> baked = bake_plan(room, store, progress, out); !baked)
    return baked.error();
  if (out.measured.total <= request.max_error)
    return out;
  // Once more, with the cost model tied to what was measured. A target that is now out of reach leaves the first
  // result.
  const auto better = make_plan(corrected(out.calibration, out.plan, out.report), request);
  if (!better || better->predicted.total > request.max_error)
    return out;
  announce(to_text(out.plan, out.measured) + "once more\n");
  std::optional<RepeatedStore> again;
  if (store)
    again.emplace(*store);
  out.plan = *better;
  out.repeated = true;
  if (const Result<void> baked = bake_plan(room, again ? &*again : nullptr, progress, out); !baked)
    return baked.error();
  return out;
}

} // namespace daylit::precompute
