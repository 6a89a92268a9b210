#include "precompute/cheaper_bake.h"

#include <algorithm>
#include <optional>

#include <glm/vector_relational.hpp>

#include "precompute/adaptive_sky.h"
#include "precompute/detail/text_format.h"
#include "precompute/room_around.h"
#include "precompute/room_frame.h"

namespace daylit::precompute {

namespace {

using detail::format;

constexpr double kOfferStep = 1.5, kLargestOffer = 0.2; ///< errors that are offered
constexpr double kLong_s = 600, kLarge = 8e9;
constexpr double kNeverLarge_s = 120; ///< a shorter bake holds less than kLarge: it is not counted
constexpr double kSmallRoom = 0.5;    ///< of the model's volume: one room of several
constexpr std::size_t kOffers = 3, kPoints = 100;
const char* const kRegions = "uniform:256";

struct Need {
  double seconds = 0, bytes = 0;
  bool is_short() const { return seconds <= kLong_s && bytes <= kLarge; }
  std::string text() const { return format("about %.3g minutes, %.2g GB of memory", seconds / 60, bytes / 1e9); }
};

bool contains(const Bounds& b, const glm::dvec3& p) {
  return glm::all(glm::greaterThanEqual(p, b.min)) && glm::all(glm::lessThanEqual(p, b.max));
}

/// The ways to ask for less, cheaper than the plan itself.
class Offers {
public:
  Offers(const RoomFile& room, const BakePlan& planned, const Need& need, const Progress& progress)
      : room_(room), planned_(planned), need_(need), progress_(progress) {}

  std::string text() {
    larger_error();
    if (planned_.request.points.empty() && planned_.request.box.empty())
      one_room();
    if (planned_.request.points.empty())
      some_points();
    if (planned_.request.regions.empty())
      constant_regions();
    return text_;
  }

private:
  std::optional<Need> need_of(const CalibrationBake& calibration, const PlanRequest& request) const {
    const auto plan = make_plan(calibration, request);
    const auto bytes = plan ? memory_of(room_, *plan, progress_) : Result<double>(plan.error());
    return bytes ? std::optional(Need{plan->predicted.seconds, *bytes}) : std::nullopt;
  }

  bool add(const std::string& options, const std::optional<Need>& need, const char* note = "") {
    if (!need || need->seconds > need_.seconds || need->bytes > need_.bytes || count_ == kOffers)
      return false;
    text_ += format("           %s: %s%s\n", options.c_str(), need->text().c_str(), note);
    ++count_;
    return true;
  }

  /// The smallest, in steps of a half, that is neither long nor large; else the largest.
  void larger_error() {
    PlanRequest request = planned_.request;
    std::optional<Need> need;
    while (request.max_error * kOfferStep < kLargestOffer && !(need && need->is_short())) {
      request.max_error *= kOfferStep;
      need = need_of(planned_.calibration, request);
    }
    add(format("--max-error %.2g", 100 * request.max_error), need);
  }

  /// The room around the first point where light is wanted, if the model has more of them.
  void one_room() {
    CalibrationBake calibration = planned_.calibration;
    if (calibration.receivers.empty())
      return;
    const glm::dvec3 p = calibration.receivers.front();
    const Result<Bounds> box = room_around(room_.room, p);
    if (!box || volume(*box) > kSmallRoom * volume(calibration.bounds))
      return;
    calibration.bounds = calibration.box = *box;
    calibration.air_fraction = 1;
    std::erase_if(calibration.receivers, [&](const glm::dvec3& r) { return !contains(*box, r); });
    for (int axis = 0; axis < 3; ++axis)
      std::erase_if(calibration.near_surfaces[static_cast<std::size_t>(axis)],
                    [&](const ProbePlane& plane) { return plane.at < box->min[axis] || plane.at > box->max[axis]; });
    PlanRequest request = planned_.request;
    request.box = *box;
    add(format("--inside %.3g,%.3g,%.3g (one room)", p.x, p.y, p.z), need_of(calibration, request));
  }

  void some_points() {
    PlanRequest request = planned_.request;
    const std::vector<glm::dvec3>& receivers = planned_.calibration.receivers;
    request.points.assign(receivers.begin(), receivers.begin() + std::ptrdiff_t(std::min(kPoints, receivers.size())));
    if (!request.points.empty())
      add(format("--points FILE with %zu points", request.points.size()), need_of(planned_.calibration, request));
  }

  void constant_regions() {
    PlanRequest request = planned_.request;
    request.regions = kRegions;
    request.must_reach = false;
    add(format("--regions %s", kRegions), need_of(planned_.calibration, request),
        "; a small sun is off by up to a half");
  }

  const RoomFile& room_;
  const BakePlan& planned_;
  const Need& need_;
  const Progress& progress_;
  std::string text_;
  std::size_t count_ = 0;
};

} // namespace

Result<double> memory_of(const RoomFile& room, const Plan& plan, const Progress& progress) {
  const auto partition = sky_for(room, plan.regions, progress);
  if (!partition)
    return partition.error();
  const auto counts = count_room_bake(room, *partition, plan.options);
  return counts ? counts->memory_bytes : Result<double>(counts.error());
}

Error with_offer(Error refusal, const RoomFile& room, const CalibrationBake& calibration, PlanRequest request,
                 const Progress& progress) {
  for (request.max_error *= kOfferStep; request.max_error < kLargestOffer; request.max_error *= kOfferStep) {
    const auto plan = make_plan(calibration, request);
    const auto needed = plan ? memory_of(room, *plan, progress) : Result<double>(plan.error());
    if (needed && *needed <= request.memory_bytes) {
      refusal.hint = format("--max-error %.2g needs %.2g GB; ", 100 * request.max_error, *needed / 1e9) + refusal.hint;
      return refusal;
    }
  }
  if (calibration.rooms.size() > 1 && !calibration.rooms[0].points.empty()) {
    const RoomPoints& largest = calibration.rooms[0];
    const glm::dvec3 p = *std::ranges::min_element(
        largest.points, {}, [&](const glm::dvec3& q) { return glm::distance(q, largest.box.centre()); });
    refusal.hint =
        format("--inside %.3g,%.3g,%.3g bakes one of its %zu rooms; ", p.x, p.y, p.z, calibration.rooms.size()) +
        refusal.hint;
  }
  return refusal;
}

Result<std::string> cheaper_text(const RoomFile& room, const BakePlan& planned, const Progress& progress) {
  Need need{planned.plan.predicted.seconds, 0};
  if (need.seconds <= kNeverLarge_s)
    return std::string();
  const Result<double> bytes = memory_of(room, planned.plan, progress);
  if (!bytes)
    return bytes.error();
  need.bytes = *bytes;
  if (need.is_short())
    return std::string();
  return format("note       this bake takes %s; for less:\n", need.text().c_str()) +
         Offers(room, planned, need, progress).text();
}

} // namespace daylit::precompute
