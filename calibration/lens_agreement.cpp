#include "calibration/lens_agreement.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <opencv2/core.hpp>

namespace daylit::calibration {

namespace {

constexpr int kPose = 6, kOwn = 3; ///< focal length (both axes alike), cx, cy
constexpr int kRounds = 8;
constexpr double kSquare = 0.004,
                 kOtherPixels = 0.1;     ///< fx / fy - 1: least that is told; from here on it is the camera's
constexpr double kLargeRms = 1.0 / 1000; ///< of the picture's width, and at least a pixel
constexpr double kSure = 6.0;            ///< deviations
constexpr double kTwoLenses = 20.0, kTwoExplain = 0.6;

/// Reprojection errors of a view, x and y of each corner; empty where one has no image.
cv::Mat1d errors_of(const LensModel& lens, const BoardPose& pose, const BoardView& view) {
  cv::Mat1d out(2 * static_cast<int>(view.board_m.size()), 1);
  for (std::size_t k = 0; k < view.board_m.size(); ++k) {
    const auto at = lens.project(pose.apply(view.board_m[k]));
    if (!at)
      return {};
    out(2 * static_cast<int>(k)) = at->x - view.corner_px[k].x;
    out(2 * static_cast<int>(k) + 1) = at->y - view.corner_px[k].y;
  }
  return out;
}

/// Moves pose number i, or beyond these the view's own focal length and middle.
void move(LensModel& lens, BoardPose& pose, int i, double by) {
  if (i < kPose)
    (i < 3 ? pose.rotation[i] : pose.translation[i - 3]) += by;
  else if (i == kPose)
    lens.fx += by, lens.fy += by * lens.fy / lens.fx;
  else
    (i == kPose + 1 ? lens.cx : lens.cy) += by;
}

/// Central differences; empty where a corner has no image.
cv::Mat1d slopes_of(const LensModel& lens, const BoardPose& pose, const BoardView& view) {
  cv::Mat1d slopes(2 * static_cast<int>(view.board_m.size()), kPose + kOwn);
  for (int i = 0; i < kPose + kOwn; ++i) {
    const double h = i < kPose ? 1e-6 : 1e-4 * lens.fx;
    LensModel l[2] = {lens, lens};
    BoardPose p[2] = {pose, pose};
    move(l[0], p[0], i, h);
    move(l[1], p[1], i, -h);
    const cv::Mat1d up = errors_of(l[0], p[0], view), down = errors_of(l[1], p[1], view);
    if (up.empty() || down.empty())
      return {};
    slopes.col(i) = (up - down) / (2.0 * h);
  }
  return slopes;
}

/// What a view says of its own lens: the sum of squared errors falls by 2 b x - x N x where its focal length and middle
/// are off by x, its pose following.
struct OwnLens {
  cv::Matx33d n;
  cv::Vec3d b;
  double left = 0, freedom = 0; ///< sum of squares with the best x, and its degrees of freedom
  double gain(const cv::Vec3d& x) const { return 2.0 * b.dot(x) - x.dot(n * x); }
};

std::optional<OwnLens> own_lens(const LensModel& lens, const BoardPose& pose, const BoardView& view) {
  const cv::Mat1d errors = errors_of(lens, pose, view);
  const cv::Mat1d slopes = errors.empty() ? cv::Mat1d() : slopes_of(lens, pose, view);
  if (slopes.empty() || slopes.rows <= slopes.cols)
    return std::nullopt;
  cv::Mat1d poses = slopes.colRange(0, kPose).clone();
  for (int i = 0; i < kPose; ++i)
    poses.col(i) /= std::max(cv::norm(poses.col(i)), 1e-300);
  const cv::Mat1d own = slopes.colRange(kPose, kPose + kOwn);
  cv::Mat1d by_pose, errors_by_pose;
  cv::solve(poses, own, by_pose, cv::DECOMP_SVD);
  cv::solve(poses, errors, errors_by_pose, cv::DECOMP_SVD);
  const cv::Mat apart = own - poses * by_pose, rest = errors - poses * errors_by_pose;
  const cv::Mat n = apart.t() * apart, b = -(apart.t() * rest);
  OwnLens out{cv::Matx33d(n), cv::Vec3d(b), 0.0, static_cast<double>(errors.rows - kPose - kOwn)};
  out.left = std::pow(cv::norm(rest), 2) - out.gain(out.n.solve(out.b, cv::DECOMP_SVD));
  return out;
}

/// The lens that fits the views of one group best; the shared one where there are none.
cv::Vec3d group_lens(const std::vector<OwnLens>& views, const std::vector<bool>& second, bool which) {
  cv::Matx33d n = cv::Matx33d::zeros();
  cv::Vec3d b(0, 0, 0);
  for (std::size_t v = 0; v < views.size(); ++v)
    if (second[v] == which) {
      n += views[v].n;
      b += views[v].b;
    }
  return n.solve(b, cv::DECOMP_SVD);
}

/// The most that the sum of squares falls by with two lenses, each view by the better one (k-means, from each view).
double gain_of_two(const std::vector<OwnLens>& views) {
  double most = 0;
  for (std::size_t seed = 0; seed < views.size(); ++seed) {
    cv::Vec3d lens[2] = {{0, 0, 0}, views[seed].n.solve(views[seed].b, cv::DECOMP_SVD)};
    double gain = 0;
    for (int round = 0; round < kRounds; ++round) {
      std::vector<bool> second;
      gain = 0;
      for (const OwnLens& view : views) {
        second.push_back(view.gain(lens[1]) > view.gain(lens[0]));
        gain += view.gain(lens[second.back() ? 1 : 0]);
      }
      lens[0] = group_lens(views, second, false);
      lens[1] = group_lens(views, second, true);
    }
    most = std::max(most, gain);
  }
  return most;
}

} // namespace

LensAgreement lens_agreement(const LensFit& fit, std::span<const BoardView> views) {
  std::vector<OwnLens> own;
  double gain = 0, left = 0, freedom = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto one = own_lens(fit.lens, fit.pose[v], views[v]);
    if (!one)
      return {};
    gain += one->gain(one->n.solve(one->b, cv::DECOMP_SVD));
    left += one->left;
    freedom += one->freedom;
    own.push_back(*one);
  }
  const double added = kOwn * (static_cast<double>(views.size()) - 1.0);
  if (!(added > 0 && left > 0 && gain > 0))
    return {};
  return {gain / added / (left / freedom), gain_of_two(own) / gain};
}

// A print that is longer one way gives the lens another focal length that way where all boards are upright.
std::vector<std::string> shape_faults(const LensFit& fit, const LensAgreement& agreement, bool alike) {
  std::vector<std::string> faults;
  if (fit.rms_px > std::max(1.0, kLargeRms * fit.lens.width_px)) // what follows has no meaning then
    return {fmt::format("corners are {:.2f} px off: blurred pictures, a bent board or a wrong --square; hold the board "
                        "on something flat{}",
                        fit.rms_px,
                        fit.lens.kind == LensKind::pinhole ? "; pictures of a fish-eye need `daylit-calibrate fisheye`"
                                                           : "")};
  const double off = fit.lens.fx / fit.lens.fy - 1.0;
  if (!alike && std::abs(off) > std::max(kSquare, kSure * fit.sigma_aspect) && std::abs(off) < kOtherPixels)
    faults.push_back(fmt::format("the board or the pixels are {:.1f} % longer {}: measure the print in both directions "
                                 "(of a camera whose pixels are not square the file is right)",
                                 100 * std::abs(off), off > 0 ? "across" : "from top to bottom"));
  if (agreement.f > kTwoLenses && agreement.two > kTwoExplain)
    faults.push_back("the pictures do not agree on one lens: two cameras, a camera that was held upside down (pictures "
                     "turned by its software), or zoom or focus that moved; take all with one camera, held one way");
  return faults;
}

} // namespace daylit::calibration
