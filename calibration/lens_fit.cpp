#include "calibration/lens_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <opencv2/calib3d.hpp>

namespace daylit::calibration {

namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr int kPose = 6;
constexpr double kRobust = 1.5, kAlmostAll = 4.0; ///< times the median distance: from there on corners count linearly
constexpr int kRounds = 40;                       ///< of Levenberg-Marquardt
constexpr double kConverged = 1e-8;               ///< relative change of the cost

/// Free numbers of a lens: fx, fy, cx, cy and as many coefficients as its model has.
int lens_numbers(LensKind kind) { return kind == LensKind::equidistant ? 8 : 9; }

double& number(LensModel& lens, int i) {
  double* const first[] = {&lens.fx, &lens.fy, &lens.cx, &lens.cy};
  return i < 4 ? *first[i] : lens.distortion[static_cast<std::size_t>(i - 4)];
}

double& number(BoardPose& pose, int i) { return i < 3 ? pose.rotation[i] : pose.translation[i - 3]; }

glm::dvec3 rotated(const glm::dvec3& rotation, const glm::dvec3& p) {
  const double angle = glm::length(rotation);
  return angle < 1e-12 ? p + glm::cross(rotation, p) : glm::angleAxis(angle, rotation / angle) * p;
}

/// 2 atan2(|v|, w) v / |v| of the one of q and -q that turns by less than half a turn.
glm::dvec3 rotation_vector(const glm::dquat& q) {
  const glm::dvec3 v = (q.w < 0 ? -1.0 : 1.0) * glm::dvec3(q.x, q.y, q.z);
  const double sine = glm::length(v);
  return sine > 0 ? 2.0 * std::atan2(sine, std::abs(q.w)) / sine * v : glm::dvec3(0.0);
}

/// Reprojection errors of a view, x and y of each corner, pixels; false where a corner has no image.
bool residuals(const LensModel& lens, const BoardPose& pose, const BoardView& view, std::vector<double>& out) {
  out.clear();
  for (std::size_t k = 0; k < view.board_m.size(); ++k) {
    const std::optional<glm::dvec2> at = lens.project(pose.apply(view.board_m[k]));
    if (!at)
      return false;
    out.push_back(at->x - view.corner_px[k].x);
    out.push_back(at->y - view.corner_px[k].y);
  }
  return true;
}

/// Weight of a corner at a distance r: 1, or d / r beyond d (Huber 1964).
double huber(double r, double d) { return r <= d ? 1.0 : d / r; }

double cost_of(const std::vector<double>& r, double bound) {
  double cost = 0;
  for (std::size_t k = 0; k < r.size(); k += 2) {
    const double d = std::hypot(r[k], r[k + 1]);
    cost += d <= bound ? d * d : 2.0 * bound * d - bound * bound;
  }
  return cost;
}

/// Lens and poses together, or the poses alone.
class Problem {
public:
  Problem(std::span<const BoardView> views, int free_lens_numbers) : views_(views), lens_count_(free_lens_numbers) {}

  double cost(const LensModel& lens, const std::vector<BoardPose>& poses, double bound) const {
    double sum = 0;
    std::vector<double> r;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      if (!residuals(lens, poses[v], views_[v], r))
        return kNone;
      sum += cost_of(r, bound);
    }
    return sum;
  }

  /// Levenberg-Marquardt (More 1978) with central differences; false where a corner has no image to begin with.
  bool solve(LensModel& lens, std::vector<BoardPose>& poses, double bound) {
    double lambda = 1e-3, best = cost(lens, poses, bound);
    if (!std::isfinite(best))
      return false;
    for (int round = 0; round < kRounds && linearise(lens, poses, bound); ++round) {
      const double next = descend(lens, poses, bound, best, lambda);
      const bool converged = best - next < kConverged * best;
      best = next;
      if (converged)
        break;
    }
    return true;
  }

  /// Diagonal of (J^T J)^-1 of the lens, and at the end the same of fx - fy.
  std::array<double, 13> variances(const LensModel& lens, const std::vector<BoardPose>& poses) {
    std::array<double, 13> out{};
    cv::Mat inverse;
    if (!linearise(lens, poses, kNone) || cv::invert(normal_, inverse, cv::DECOMP_SVD) == 0.0)
      return out;
    for (int i = 0; i < lens_count_; ++i)
      out[static_cast<std::size_t>(i)] = inverse.at<double>(i, i);
    out.back() = out[0] + out[1] - 2.0 * inverse.at<double>(0, 1);
    return out;
  }

private:
  /// The first step, damped more and more, that lowers the cost; the cost after it.
  double descend(LensModel& lens, std::vector<BoardPose>& poses, double bound, double best, double& lambda) const {
    for (; lambda < 1e12; lambda *= 10) {
      LensModel tried = lens;
      std::vector<BoardPose> tried_poses = poses;
      if (!step(lambda, tried, tried_poses))
        continue;
      const double next = cost(tried, tried_poses, bound);
      if (next >= best)
        continue;
      lens = tried;
      poses = tried_poses;
      lambda = std::max(0.1 * lambda, 1e-12);
      return next;
    }
    return best;
  }

  int size() const { return lens_count_ + kPose * static_cast<int>(views_.size()); }

  /// J^T W J and -J^T W r, view by view: a view depends on the lens and its own pose.
  bool linearise(const LensModel& lens, const std::vector<BoardPose>& poses, double bound) {
    normal_ = cv::Mat::zeros(size(), size(), CV_64F);
    gradient_ = cv::Mat::zeros(size(), 1, CV_64F);
    std::vector<double> r;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      if (!residuals(lens, poses[v], views_[v], r))
        return false;
      const std::vector<std::vector<double>> j = jacobian(lens, poses[v], views_[v]);
      if (j.empty())
        return false;
      add_view(v, j, r, bound);
    }
    return true;
  }

  /// Column by column: derivatives of the residuals by the lens's numbers and the pose's.
  std::vector<std::vector<double>> jacobian(const LensModel& lens, const BoardPose& pose, const BoardView& view) const {
    std::vector<std::vector<double>> columns;
    std::vector<double> up, down;
    for (int i = 0; i < lens_count_ + kPose; ++i) {
      LensModel l[2] = {lens, lens};
      BoardPose p[2] = {pose, pose};
      const double h = i < lens_count_ ? (i < 4 ? 1e-4 * lens.fx : 1e-5) : 1e-6;
      for (int side = 0; side < 2; ++side)
        (i < lens_count_ ? number(l[side], i) : number(p[side], i - lens_count_)) += side == 0 ? h : -h;
      if (!residuals(l[0], p[0], view, up) || !residuals(l[1], p[1], view, down))
        return {};
      for (std::size_t k = 0; k < up.size(); ++k)
        up[k] = (up[k] - down[k]) / (2.0 * h);
      columns.push_back(up);
    }
    return columns;
  }

  void add_view(std::size_t v, const std::vector<std::vector<double>>& j, const std::vector<double>& r, double bound) {
    const int pose = lens_count_ + kPose * static_cast<int>(v);
    const auto place = [&](int i) { return i < lens_count_ ? i : pose + i - lens_count_; };
    const int count = lens_count_ + kPose;
    std::vector<double> weight;
    for (std::size_t k = 0; k < r.size(); k += 2)
      weight.insert(weight.end(), 2, huber(std::hypot(r[k], r[k + 1]), bound));
    for (int a = 0; a < count; ++a) {
      const std::vector<double>& ja = j[static_cast<std::size_t>(a)];
      for (std::size_t k = 0; k < r.size(); ++k)
        gradient_.at<double>(place(a), 0) -= weight[k] * ja[k] * r[k];
      for (int b = 0; b < count; ++b) {
        double sum = 0;
        for (std::size_t k = 0; k < r.size(); ++k)
          sum += weight[k] * ja[k] * j[static_cast<std::size_t>(b)][k];
        normal_.at<double>(place(a), place(b)) += sum;
      }
    }
  }

  /// (J^T W J + lambda diag) step = -J^T W r.
  bool step(double lambda, LensModel& lens, std::vector<BoardPose>& poses) const {
    cv::Mat damped = normal_.clone(), x;
    for (int i = 0; i < size(); ++i)
      damped.at<double>(i, i) += lambda * std::max(normal_.at<double>(i, i), 1e-12);
    if (!cv::solve(damped, gradient_, x, cv::DECOMP_CHOLESKY))
      return false;
    for (int i = 0; i < lens_count_; ++i)
      number(lens, i) += x.at<double>(i, 0);
    for (std::size_t v = 0; v < poses.size(); ++v)
      for (int i = 0; i < kPose; ++i)
        number(poses[v], i) += x.at<double>(lens_count_ + kPose * static_cast<int>(v) + i, 0);
    return lens.fx > 1.0 && lens.fy > 1.0;
  }

  std::span<const BoardView> views_;
  int lens_count_;
  cv::Mat normal_, gradient_;
};

/// Pose by a homography of the corners' directions, turned so that their mean is the axis (cv::solvePnP).
std::optional<BoardPose> first_pose(const LensModel& lens, const BoardView& view) {
  const std::vector<glm::dvec3>& board = view.board_m;
  std::vector<glm::dvec3> direction;
  glm::dvec3 mean(0.0);
  for (const glm::dvec2& p : view.corner_px) {
    const auto d = lens.unproject(p);
    if (!d)
      return std::nullopt;
    direction.push_back(*d);
    mean += *d;
  }
  const glm::dquat turn(glm::normalize(mean), glm::dvec3(0, 0, 1)), back = glm::conjugate(turn);
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> image;
  for (std::size_t k = 0; k < board.size(); ++k) {
    const glm::dvec3 d = turn * direction[k];
    if (d.z < 0.1)
      return std::nullopt;
    object.emplace_back(board[k].x, board[k].y, board[k].z);
    image.emplace_back(d.x / d.z, d.y / d.z);
  }
  cv::Vec3d r, t;
  if (!cv::solvePnP(object, image, cv::Matx33d::eye(), cv::noArray(), r, t, false, cv::SOLVEPNP_ITERATIVE))
    return std::nullopt;
  const glm::dvec3 vector(r[0], r[1], r[2]);
  const double angle = glm::length(vector);
  const glm::dquat whole = back * (angle > 0 ? glm::angleAxis(angle, vector / angle) : glm::dquat(1, 0, 0, 0));
  return BoardPose{rotation_vector(whole), back * glm::dvec3(t[0], t[1], t[2])};
}

/// Median distance of all corners, pixels: how far off a corner usually is.
double median_distance(const LensModel& lens, const std::vector<BoardPose>& poses, std::span<const BoardView> views) {
  std::vector<double> all, r;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!residuals(lens, poses[v], views[v], r))
      return kNone;
    for (std::size_t k = 0; k < r.size(); k += 2)
      all.push_back(std::hypot(r[k], r[k + 1]));
  }
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  return *middle;
}

void judge(LensFit& fit, std::span<const BoardView> views, int count) {
  double sum = 0, corners = 0;
  std::vector<double> r;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const double cost = residuals(fit.lens, fit.pose[v], views[v], r) ? cost_of(r, kNone) : kNone;
    fit.view_rms_px.push_back(std::sqrt(cost / static_cast<double>(views[v].board_m.size())));
    sum += cost;
    corners += static_cast<double>(views[v].board_m.size());
  }
  if (fit.lens.kind == LensKind::equidistant) // beyond the fold two directions share a pixel
    fit.lens.max_theta =
        std::min(fit.lens.max_theta, 0.999 * monotone_field(fit.lens.kind, fit.lens.distortion, fit.lens.max_theta));
  fit.rms_px = std::sqrt(sum / corners);
  const auto variance = Problem(views, count).variances(fit.lens, fit.pose);
  const double freedom = std::max(2.0 * corners - count - kPose * static_cast<double>(views.size()), 1.0);
  for (std::size_t i = 0; i < fit.sigma.size(); ++i)
    fit.sigma[i] = std::sqrt(std::max(variance[i], 0.0) * sum / freedom);
  fit.sigma_aspect = std::sqrt(std::max(variance.back(), 0.0) * sum / freedom) / fit.lens.fy;
}

/// Numbers of the lens that are free, and from which distance on corners count linearly, in medians.
struct FitStage {
  int free;
  double bound;
};

/// Poses, then focal lengths and the middle, then everything.
std::optional<LensFit> fit_from(const LensModel& start, std::span<const BoardView> views,
                                std::initializer_list<FitStage> stages) {
  LensFit fit;
  fit.lens = start;
  for (const BoardView& view : views) {
    const auto pose = first_pose(start, view);
    if (!pose)
      return std::nullopt;
    fit.pose.push_back(*pose);
  }
  for (const FitStage& stage : stages) {
    const double median = median_distance(fit.lens, fit.pose, views);
    if (!std::isfinite(median) ||
        !Problem(views, stage.free).solve(fit.lens, fit.pose, std::max(stage.bound * median, 0.05)))
      return std::nullopt;
  }
  return fit;
}

LensModel first_lens(LensKind kind, int width_px, int height_px, const ImageCircle& circle, double focal_px) {
  LensModel lens;
  lens.kind = kind;
  lens.width_px = width_px;
  lens.height_px = height_px;
  lens.fx = lens.fy = focal_px;
  lens.cx = circle.radius > 0 ? circle.centre.x : 0.5 * (width_px - 1);
  lens.cy = circle.radius > 0 ? circle.centre.y : 0.5 * (height_px - 1);
  lens.max_theta = kind == LensKind::equidistant ? 0.98 * std::numbers::pi : 0.5 * std::numbers::pi;
  return lens;
}

} // namespace

std::vector<glm::dvec3> board_points(int columns, int rows, double square_m) {
  std::vector<glm::dvec3> points;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x)
      points.emplace_back(x * square_m, y * square_m, 0.0);
  return points;
}

/// R(rotation) p + translation.
glm::dvec3 BoardPose::apply(const glm::dvec3& board_point) const {
  return rotated(rotation, board_point) + translation;
}

/// From several focal lengths, as fractions of the circle's radius or the picture's width; the best start goes on.
Result<LensFit> fit_lens(LensKind kind, int width_px, int height_px, const ImageCircle& circle,
                         std::span<const BoardView> views) {
  if (views.size() < kFewestViews)
    return Error{ErrorCode::value_invalid, "at least three pictures of the board are needed", "board", "take more"};
  const double scale = kind == LensKind::equidistant && circle.radius > 0 ? circle.radius : 0.5 * width_px;
  const int all = lens_numbers(kind);
  std::optional<LensFit> best;
  double least = kNone;
  for (const double fraction : {0.35, 0.5, 0.65, 0.9, 1.3, 1.9, 2.8}) {
    const auto fit = fit_from(first_lens(kind, width_px, height_px, circle, fraction * scale), views,
                              {{0, kRobust}, {4, kRobust}, {all, kRobust}});
    const double median = fit ? median_distance(fit->lens, fit->pose, views) : kNone;
    if (median < least) {
      least = median;
      best = fit;
    }
  }
  if (!best)
    return Error{ErrorCode::value_invalid, "no lens explains the corners of these pictures", "board",
                 "check --board and whether all pictures are of one camera and one board"};
  if (const auto fit = refit_lens(best->lens, views))
    return *fit;
  judge(*best, views, all); // pictures that do not determine the distortion: the verdict will say so
  return *best;
}

std::optional<LensFit> refit_lens(const LensModel& start, std::span<const BoardView> views, bool curve_free) {
  const int count = curve_free ? lens_numbers(start.kind) : 4;
  auto fit = fit_from(start, views, {{0, kRobust}, {count, kRobust}, {count, kAlmostAll}});
  if (fit)
    judge(*fit, views, count);
  return fit;
}

std::optional<double> held_out_rms(const LensModel& lens, const BoardView& view) {
  const auto fit = fit_from(lens, std::span(&view, 1), {{0, kAlmostAll}});
  std::vector<double> r;
  if (!fit || !residuals(lens, fit->pose[0], view, r))
    return std::nullopt;
  return std::sqrt(cost_of(r, kNone) / static_cast<double>(view.board_m.size()));
}

} // namespace daylit::calibration
