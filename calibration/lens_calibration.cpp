#include "calibration/lens_calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kOdd = 3.5; ///< times the median of the views' errors: a view that does not belong
constexpr double kOddLeast_px = 0.3;
constexpr double kSpoilt = 1.5;     ///< usual error with a view that does not belong / without it
constexpr std::size_t kEnough = 6;  ///< views
constexpr double kHeldOut = 1.5;    ///< held-out error / error: beyond, the lens follows single pictures
constexpr double kSure = 0.01;      ///< standard deviation of the focal length / focal length
constexpr double kAlike_deg = 10.0; ///< largest tilt between two boards
constexpr double kReach = 0.7;      ///< of the circle's radius
constexpr double kCovered = 0.4;    ///< of the parts of the picture
constexpr int kParts = 8;
constexpr double kAsGood = 1.01;      ///< held-out error of an ideal curve / of the polynomial
constexpr double kManyDropped = 0.25; ///< of the pictures: left out for one reason
constexpr double kManyBright = 0.75;  ///< of the pictures that count: over-exposed

Error interrupted() { return interrupted_error("calibration"); }

std::vector<double> sorted(std::vector<double> values) {
  std::ranges::sort(values);
  return values;
}

/// A view that does not belong: what it is off by, what the others usually are, and their lens.
struct OddView {
  std::size_t view = 0;
  double rms_px = 0, usual_px = 0;
  std::optional<LensFit> others;
};

double usual_of(const LensFit& fit) { return sorted(fit.view_rms_px)[(fit.view_rms_px.size() - 1) / 2]; }

bool is_odd(double rms_px, double usual_px) { return rms_px >= kOdd * usual_px && rms_px >= usual_px + kOddLeast_px; }

std::vector<BoardView> without(std::vector<BoardView> views, std::size_t v) {
  views.erase(views.begin() + static_cast<std::ptrdiff_t>(v));
  return views;
}

/// The worst view where it is far worse than the usual one; else a view that spoils the fit of all others, which then
/// is no worse than they are: without it they agree far better, and their lens does not explain it.
std::optional<OddView> odd_view(const LensFit& fit, const std::vector<BoardView>& views) {
  const auto worst = static_cast<std::size_t>(std::ranges::max_element(fit.view_rms_px) - fit.view_rms_px.begin());
  const double usual = usual_of(fit);
  if (is_odd(fit.view_rms_px[worst], usual))
    return OddView{worst, fit.view_rms_px[worst], usual, refit_lens(fit.lens, without(views, worst))};
  std::optional<OddView> odd;
  for (std::size_t v = 0; usual > kOddLeast_px && v < views.size(); ++v) {
    auto others = refit_lens(fit.lens, without(views, v));
    const auto rms = others ? held_out_rms(others->lens, views[v]) : std::nullopt;
    if (!rms || usual < kSpoilt * usual_of(*others) || !is_odd(*rms, usual_of(*others)))
      continue;
    if (!odd || usual_of(*others) < odd->usual_px)
      odd = OddView{v, *rms, usual_of(*others), std::move(others)};
  }
  return odd;
}

/// Leaves out odd views one by one, and fits again.
Result<LensFit> fit_without_odd_views(LensKind kind, int width_px, int height_px, const ImageCircle& circle,
                                      std::vector<BoardView>& views, std::vector<DroppedPicture>& dropped) {
  Result<LensFit> fit = fit_lens(kind, width_px, height_px, circle, views);
  while (fit && views.size() > kFewestViews) {
    auto odd = odd_view(*fit, views);
    if (!odd)
      break;
    dropped.push_back({views[odd->view].name,
                       fmt::format("its corners are {:.2g} px off where the others are {:.2g}: another board, another "
                                   "camera, or a board that is bent or was moved",
                                   odd->rms_px, odd->usual_px)});
    views = without(std::move(views), odd->view);
    fit = odd->others ? Result<LensFit>(std::move(*odd->others)) : fit_lens(kind, width_px, height_px, circle, views);
  }
  return fit;
}

/// Rms over the views of what each is off by when the lens is fitted to the others; NaN where none can be told.
Result<double> held_out_error(const LensFit& fit, const std::vector<BoardView>& views, bool curve_free,
                              const Progress& progress) {
  double sum = 0;
  std::size_t counted = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!progress("held-out pictures", static_cast<double>(v) / static_cast<double>(views.size())))
      return interrupted();
    const auto lens = refit_lens(fit.lens, without(views, v), curve_free);
    const auto rms = lens ? held_out_rms(lens->lens, views[v]) : std::nullopt;
    if (rms) {
      sum += *rms * *rms;
      ++counted;
    }
  }
  return counted > 0 ? std::sqrt(sum / static_cast<double>(counted)) : std::numeric_limits<double>::quiet_NaN();
}

/// r = 2 f sin(t / 2) as a series in t; it differs from the sine by less than 1e-9 f up to 110 degrees.
constexpr std::array<double, 8> kEquisolid{-1.0 / 24, 1.0 / 1920, -1.0 / 322560, 1.0 / 92897280};

/// The curves of ideal fish-eyes beside the polynomial; one that tells left-out views as well is taken, because it also
/// holds where no corner was.
Result<void> try_ideal_curves(LensCalibration& c, const Progress& progress) {
  c.curves.push_back({"polynomial", c.held_out_rms_px});
  for (const auto& [name, distortion] :
       {std::pair{"equidistant", std::array<double, 8>{}}, {"equisolid", kEquisolid}}) {
    LensModel start = c.fit.lens;
    start.distortion = distortion;
    start.max_theta = 0.98 * std::numbers::pi;
    auto fit = refit_lens(start, c.views, false);
    if (!fit)
      continue;
    const auto held_out = held_out_error(*fit, c.views, false, progress);
    if (!held_out)
      return held_out.error();
    c.curves.push_back({name, *held_out});
    if (*held_out > kAsGood * c.curves.front().held_out_rms_px)
      continue;
    std::swap(c.curves.front(), c.curves.back());
    c.fit = std::move(*fit);
    c.held_out_rms_px = *held_out;
  }
  return {};
}

/// Largest angle between the normals of two boards.
double tilt_spread(const LensFit& fit) {
  std::vector<glm::dvec3> normal;
  for (const BoardPose& p : fit.pose)
    normal.push_back(p.apply({0, 0, 1}) - p.apply({0, 0, 0}));
  double widest = 0;
  for (const glm::dvec3& a : normal)
    for (const glm::dvec3& b : normal)
      widest = std::max(widest, std::acos(std::clamp(std::abs(glm::dot(a, b)), 0.0, 1.0)));
  return widest / kDegree;
}

/// Fraction of kParts x kParts parts that hold a corner: of the picture, or of those whose middle lies in the circle.
double coverage_of(const LensCalibration& c) {
  const glm::dvec2 size(c.fit.lens.width_px, c.fit.lens.height_px);
  const bool round = c.circle.radius > 0;
  const glm::dvec2 low = round ? c.circle.centre - c.circle.radius : glm::dvec2(0.0),
                   side = round ? glm::dvec2(2.0 * c.circle.radius) : size;
  std::set<std::pair<int, int>> hit;
  for (const BoardView& view : c.views)
    for (const glm::dvec2& p : view.corner_px) {
      const glm::dvec2 at = static_cast<double>(kParts) * (p - low) / side;
      hit.insert({static_cast<int>(std::floor(at.x)), static_cast<int>(std::floor(at.y))});
    }
  int all = 0, covered = 0;
  for (int y = 0; y < kParts; ++y)
    for (int x = 0; x < kParts; ++x) {
      const glm::dvec2 middle = glm::dvec2(x + 0.5, y + 0.5) / static_cast<double>(kParts);
      if (round && glm::length(middle - 0.5) > 0.5)
        continue;
      ++all;
      covered += hit.contains({x, y}) ? 1 : 0;
    }
  return static_cast<double>(covered) / all;
}

/// The angle up to which the lens may be used: the edge of the circle where there is one, else the outermost corner.
double field_of(const LensCalibration& c) {
  const LensModel& lens = c.fit.lens;
  double field = c.reach_deg * kDegree;
  if (c.circle.radius > 0) {
    double sum = 0;
    int found = 0;
    for (int k = 0; k < 16; ++k) {
      const double a = 2.0 * std::numbers::pi * k / 16;
      const auto d = lens.unproject(c.circle.centre + c.circle.radius * glm::dvec2(std::cos(a), std::sin(a)));
      if (d) {
        sum += std::acos(std::clamp(d->z, -1.0, 1.0));
        ++found;
      }
    }
    field = found > 0 ? std::max(sum / found, field) : field;
  }
  return std::min(field, lens.max_theta);
}

double reach_of(const LensCalibration& c) {
  double reach = 0;
  for (const BoardView& view : c.views)
    for (const glm::dvec2& p : view.corner_px)
      if (const auto d = c.fit.lens.unproject(p))
        reach = std::max(reach, std::acos(std::clamp(d->z, -1.0, 1.0)));
  return reach / kDegree;
}

/// Outermost corner / radius of the circle.
double reach_in_circle(const LensCalibration& c) {
  double reach = 0;
  for (const BoardView& view : c.views)
    for (const glm::dvec2& p : view.corner_px)
      reach = std::max(reach, glm::distance(p, c.circle.centre));
  return reach / c.circle.radius;
}

/// Why pictures were left out, and how many for this reason; the most frequent one first.
std::vector<std::pair<std::string, std::size_t>> reasons_of(const std::vector<DroppedPicture>& dropped) {
  std::map<std::string, std::size_t> count;
  for (const DroppedPicture& d : dropped)
    ++count[d.why];
  std::vector<std::pair<std::string, std::size_t>> reasons(count.begin(), count.end());
  std::ranges::stable_sort(reasons, std::greater{}, [](const auto& reason) { return reason.second; });
  return reasons;
}

/// What holds for a good part of the pictures is said of the sitting, not only of each picture.
void add_common_reasons(const LensCalibration& c, std::vector<std::string>& faults) {
  const double all = static_cast<double>(c.views.size() + c.dropped.size());
  for (const auto& [why, count] : reasons_of(c.dropped))
    if (count >= 2 && static_cast<double>(count) >= kManyDropped * all)
      faults.push_back(fmt::format("{}{} of {} pictures: {}",
                                   why.find(kOtherBoard) != std::string::npos ? "two boards are mixed, keep one; " : "",
                                   count, all, why));
}

/// Names of the pictures that count although the white of their board is at the top of the range.
std::vector<std::string> over_exposed(const LensCalibration& c) {
  std::vector<std::string> names;
  for (const BoardView& view : c.views)
    if (view.over_exposed)
      names.push_back(view.name);
  return names;
}

bool many(const std::vector<std::string>& bright, const LensCalibration& c) {
  return !bright.empty() && static_cast<double>(bright.size()) >= kManyBright * static_cast<double>(c.views.size());
}

/// Reasons against the result, each with what to do.
std::vector<std::string> faults_of(const LensCalibration& c) {
  std::vector<std::string> faults;
  add_common_reasons(c, faults);
  if (const auto bright = over_exposed(c); many(bright, c))
    faults.push_back(
        fmt::format("over-exposed: the white of the board is at the top of the range in {} of {} pictures, "
                    "so that its edges are less certain; expose less",
                    bright.size(), c.views.size()));
  const LensModel& lens = c.fit.lens;
  for (std::string& fault : shape_faults(c.fit, c.agreement, c.tilt_spread_deg < kAlike_deg))
    faults.push_back(std::move(fault));
  if (c.views.size() < kEnough)
    faults.push_back(fmt::format("only {} pictures count; take at least {}", c.views.size(), kEnough));
  if (c.tilt_spread_deg < kAlike_deg)
    faults.push_back("all pictures are alike: the boards differ by less than 10 degrees; tilt the board by 20 to 40 "
                     "degrees to all sides");
  if (const double sure = c.fit.sigma[0] / lens.fx; sure > kSure)
    faults.push_back(
        fmt::format("the focal length is only known to {:.1f} %; tilt the board more, and come closer", 100 * sure));
  if (c.held_out_rms_px > kHeldOut * c.fit.rms_px + 0.05)
    faults.push_back(fmt::format("a picture that was left out is {:.2f} px off, those that count {:.2f}: too few "
                                 "pictures, or too much alike",
                                 c.held_out_rms_px, c.fit.rms_px));
  if (c.circle.radius > 0 && reach_in_circle(c) < kReach)
    faults.push_back(fmt::format("corners reach {:.0f} % of the circle's radius; bring the board to its edge",
                                 100 * reach_in_circle(c)));
  if (c.coverage < kCovered)
    faults.push_back(fmt::format("corners cover {:.0f} % of the picture; bring the board to all sides and corners",
                                 100 * c.coverage));
  return faults;
}

void add_praise(LensCalibration& c) {
  c.why.push_back(fmt::format("{} pictures agree within {:.2f} px, pictures that were left out within {:.2f}",
                              c.views.size(), c.fit.rms_px, c.held_out_rms_px));
  if (const double field = c.fit.lens.max_theta / kDegree; c.kind == LensKind::equidistant && field > c.reach_deg + 1.0)
    c.why.push_back(fmt::format("corners reach {:.0f} degrees from the axis; from there to {:.0f}, the edge of the "
                                "circle, the lens is continued",
                                c.reach_deg, field));
}

void judge(LensCalibration& c) {
  c.tilt_spread_deg = tilt_spread(c.fit);
  c.reach_deg = reach_of(c);
  c.coverage = coverage_of(c);
  c.agreement = lens_agreement(c.fit, c.views);
  c.why = faults_of(c);
  c.pass = c.why.empty();
  if (c.kind == LensKind::equidistant)
    c.fit.lens.max_theta = field_of(c);
  if (c.pass)
    add_praise(c);
  if (const auto bright = over_exposed(c); !bright.empty() && !many(bright, c))
    c.why.push_back(fmt::format("over-exposed, though in use: {}", fmt::join(bright, ", ")));
}

/// No lens: which pictures do not show the board, and why.
LensCalibration too_few(LensKind kind, BoardSize board, std::size_t all, std::vector<DroppedPicture> dropped) {
  LensCalibration c;
  c.kind = kind;
  for (const auto& [why, count] : reasons_of(dropped))
    c.why.push_back(fmt::format("{}{} of {} pictures: {}",
                                why.find(kOtherBoard) != std::string::npos ? "the board size is wrong: " : "", count,
                                all, why));
  std::ranges::stable_sort(c.why, [](const std::string& a, const std::string& b) {
    return a.starts_with("the board size") > b.starts_with("the board size");
  });
  c.why.push_back(
      fmt::format("fewer than three pictures show the board of {} x {} inner corners", board.columns, board.rows));
  c.dropped = std::move(dropped);
  return c;
}

} // namespace

Result<LensCalibration> calibrate_views(LensKind kind, BoardSize board, int width_px, int height_px,
                                        const ImageCircle& circle, std::vector<BoardView> views,
                                        std::vector<DroppedPicture> dropped, const Progress& progress) {
  if (const std::size_t all = views.size() + dropped.size(); views.size() < kFewestViews)
    return too_few(kind, board, all, std::move(dropped));
  LensCalibration c;
  c.kind = kind;
  c.circle = kind == LensKind::equidistant ? circle : ImageCircle{};
  if (!progress("lens", 0.0))
    return interrupted();
  auto fit = fit_without_odd_views(kind, width_px, height_px, c.circle, views, dropped);
  if (!fit)
    return fit.error();
  const auto held_out = held_out_error(*fit, views, true, progress);
  if (!held_out)
    return held_out.error();
  c.fit = std::move(*fit);
  c.held_out_rms_px = *held_out;
  c.views = std::move(views);
  c.dropped = std::move(dropped);
  if (kind == LensKind::equidistant)
    if (const Result<void> tried = try_ideal_curves(c, progress); !tried)
      return tried.error();
  judge(c);
  return c;
}

Result<LensCalibration> calibrate_lens(LensKind kind, const Target& target, std::size_t count,
                                       const std::function<Result<BoardPicture>(std::size_t)>& read,
                                       const Progress& progress) {
  std::vector<BoardView> views;
  std::vector<DroppedPicture> dropped;
  CircleFinder circle;
  int width_px = 0, height_px = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (!progress("pictures", static_cast<double>(i) / static_cast<double>(count)))
      return interrupted();
    const Result<BoardPicture> taken = read(i);
    if (!taken && taken.error().code == ErrorCode::file_malformed) {
      dropped.push_back({std::filesystem::path(taken.error().where).filename().string(), taken.error().what});
      continue;
    }
    if (!taken)
      return taken.error();
    const Rgb8Image& picture = taken->picture;
    if (width_px == 0) {
      width_px = picture.width;
      height_px = picture.height;
    }
    if (picture.width != width_px || picture.height != height_px) {
      dropped.push_back({taken->file, fmt::format("is {} x {} pixels, the first one {} x {}", picture.width,
                                                  picture.height, width_px, height_px)});
      continue;
    }
    circle.add(picture);
    auto found = find_board(picture, target);
    if (!found)
      return found.error();
    if (found->corner_px.empty())
      dropped.push_back({taken->file, found->why});
    else
      views.push_back({taken->file, std::move(found->corner_px), std::move(found->board_m), found->white_is_lost});
  }
  return calibrate_views(kind, target.size, width_px, height_px, circle.find(), std::move(views), std::move(dropped),
                         progress);
}

} // namespace daylit::calibration
