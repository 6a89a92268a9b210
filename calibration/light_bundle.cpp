#include "calibration/light_bundle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/small_turn.h"
#include "capture/hdr/bracket.h"
#include "scene/core/parallel_stage.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kBlur[] = {2.0 * kDegree, 1.0 * kDegree, 0.5 * kDegree, 0.25 * kDegree, 0.12 * kDegree};
constexpr int kRounds = 12;
constexpr double kSettled = 0.01;    ///< of the blur: turns below it end a level
constexpr double kLongestStep = 1.0; ///< of the blur
constexpr std::size_t kDirections = 20000;
constexpr float kDarkest = 0.004f; ///< of full scale: below, codes are too coarse
constexpr double kModel = 0.01;    ///< relative deviation of log radiance that is not noise: lens, interpolation
constexpr double kHuber = 2.0;     ///< deviations, from where on differences count linearly
constexpr std::size_t kFewestDirections = 30;
constexpr int kUnknowns = 4; ///< of a picture: turn, log exposure

/// Log of the luminance of a picture, blurred; NaN where that has no meaning.
struct LogPicture {
  cv::Mat1f value;
  double variance_at_full = 0; ///< of the relative error, at full scale: noise falls with the pixels averaged
};

/// Blurred in linear light. Without meaning: saturated or near it, too dark, and the margin, where the blur lacks
/// neighbours.
LogPicture log_picture(const HandHeldPicture& p, double blur) {
  const double sigma = std::max(blur * p.lens.fx, 0.8);
  cv::Mat1f light(p.light.height, p.light.width), lost(light.size());
  for (int y = 0; y < light.rows; ++y)
    for (int x = 0; x < light.cols; ++x) {
      light(y, x) = luminance(p.light.at(x, y));
      lost(y, x) = p.usable[static_cast<std::size_t>(y) * p.light.width + x] ? 0.0f : 1.0f;
    }
  const int margin = static_cast<int>(std::ceil(2.0 * sigma));
  cv::GaussianBlur(light, light, {}, sigma);
  cv::GaussianBlur(lost, lost, {}, sigma);
  LogPicture out{cv::Mat1f(light.size(), std::numeric_limits<float>::quiet_NaN()), 0.0};
  for (int y = margin; y < light.rows - margin; ++y)
    for (int x = margin; x < light.cols - margin; ++x)
      if (light(y, x) > kDarkest && lost(y, x) < 1e-4f)
        out.value(y, x) = std::log(light(y, x));
  out.variance_at_full = usual_noise(8).photon / (4.0 * std::numbers::pi * sigma * sigma);
  return out;
}

/// What a picture shows in a world direction.
struct Seen {
  double log_light = kUnknown, variance = 0;
  glm::dvec3 slope{0.0}; ///< d log_light per radian that the picture is turned about the world's axes
  bool valid() const { return !std::isnan(log_light); }
};

double between_texels(const cv::Mat1f& m, const glm::dvec2& p) {
  const int x = static_cast<int>(std::floor(p.x)), y = static_cast<int>(std::floor(p.y));
  if (x < 0 || y < 0 || x + 1 >= m.cols || y + 1 >= m.rows)
    return kUnknown;
  const double u = p.x - x, v = p.y - y;
  return (1 - v) * ((1 - u) * static_cast<double>(m(y, x)) + u * static_cast<double>(m(y, x + 1))) +
         v * ((1 - u) * static_cast<double>(m(y + 1, x)) + u * static_cast<double>(m(y + 1, x + 1)));
}

double lookup(const HandHeldPicture& p, const LogPicture& log, const glm::dvec3& world) {
  const glm::dvec3 d = glm::transpose(p.world_from_camera) * world;
  const auto at = d.z > 0 ? p.lens.project(d) : std::nullopt;
  return at ? between_texels(log.value, *at) : kUnknown;
}

/// Turned by w the picture shows at d what it showed at d - w x d: the slope is -(d x gradient).
Seen look(const HandHeldPicture& p, const LogPicture& log, const glm::dvec3& d, double step) {
  Seen seen;
  seen.log_light = lookup(p, log, d);
  if (!seen.valid())
    return seen;
  const glm::dvec3 a = glm::normalize(glm::cross(d, std::abs(d.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0))),
                   b = glm::cross(d, a);
  const auto along = [&](const glm::dvec3& t) {
    return (lookup(p, log, d + step * t) - lookup(p, log, d - step * t)) / (2.0 * step);
  };
  const glm::dvec3 gradient = along(a) * a + along(b) * b;
  if (std::isnan(gradient.x))
    return {};
  seen.slope = -glm::cross(d, gradient);
  seen.variance = log.variance_at_full / std::exp(seen.log_light);
  return seen;
}

/// Everything that pictures show in the same directions: all[direction][picture].
using Views = std::vector<std::vector<std::pair<std::size_t, Seen>>>;

Result<Views> views_of(const std::vector<HandHeldPicture>& pictures, const std::vector<LogPicture>& logs,
                       const std::vector<glm::dvec3>& directions, const std::string& stage, const Progress& progress) {
  Views all(directions.size());
  const auto done = parallel_stage(stage, directions.size(), 1000, progress, [&](std::size_t k) {
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      if (glm::dot(pictures[i].world_from_camera[2], directions[k]) <= 0)
        continue;
      if (const Seen seen = look(pictures[i], logs[i], directions[k], 0.5 / pictures[i].lens.fx); seen.valid())
        all[k].emplace_back(i, seen);
    }
  });
  if (!done)
    return done.error();
  return all;
}

/// Two pictures in one direction: first and second, and by how much their log radiances differ.
template <class Each>
void for_pairs(const Views& views, const std::vector<HandHeldPicture>& pictures, const Each& each) {
  for (const auto& seen : views)
    for (std::size_t a = 0; a < seen.size(); ++a)
      for (std::size_t b = a + 1; b < seen.size(); ++b)
        each(seen[a], seen[b],
             seen[a].second.log_light - std::log(pictures[seen[a].first].exposure) - seen[b].second.log_light +
                 std::log(pictures[seen[b].first].exposure));
}

double median_of(std::vector<double>& v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::ranges::nth_element(v, middle);
  return *middle;
}

/// Deviation of differences that is more than noise explains: 1.48 x their median size (Rousseeuw & Croux 1993).
double spread_of(const Views& views, const std::vector<HandHeldPicture>& pictures) {
  std::vector<double> size;
  for_pairs(views, pictures, [&](const auto&, const auto&, double off) { size.push_back(std::abs(off)); });
  return std::max(kModel, size.empty() ? 0.0 : 1.48 * median_of(size));
}

struct Start {
  std::vector<glm::dmat3> world_from_camera;
  double sigma_turn = 0.0;
  std::vector<double> exposure;
};

/// Normal equations of turn and log exposure of all pictures; `own` without what holds them to the start.
struct Normal {
  cv::Mat1d a, b, own;
};

Normal normal_equations(const Views& views, const std::vector<HandHeldPicture>& pictures, const Start& start) {
  const int n = kUnknowns * static_cast<int>(pictures.size());
  Normal normal{cv::Mat1d(n, n, 0.0), cv::Mat1d(n, 1, 0.0), {}};
  const double spread = spread_of(views, pictures);
  for_pairs(views, pictures, [&](const auto& first, const auto& second, double off) {
    const double sigma = std::sqrt(spread * spread + first.second.variance + second.second.variance);
    const double beyond = std::abs(off) / (kHuber * sigma), weight = 1.0 / (sigma * sigma * std::max(1.0, beyond));
    const double slope[] = {first.second.slope.x,   first.second.slope.y,   first.second.slope.z,   -1.0,
                            -second.second.slope.x, -second.second.slope.y, -second.second.slope.z, 1.0};
    const int at[] = {kUnknowns * static_cast<int>(first.first), kUnknowns * static_cast<int>(second.first)};
    for (int r = 0; r < 2 * kUnknowns; ++r) {
      const int row = at[r / kUnknowns] + r % kUnknowns;
      normal.b(row) -= weight * slope[r] * off;
      for (int c = 0; c < 2 * kUnknowns; ++c)
        normal.a(row, at[c / kUnknowns] + c % kUnknowns) += weight * slope[r] * slope[c];
    }
  });
  normal.own = normal.a.clone();
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const int row = kUnknowns * static_cast<int>(i);
    const double turn = 1.0 / std::pow(start.sigma_turn, 2), exposure = 1.0 / std::pow(kStatedExposure, 2);
    const glm::dvec3 turned = turn_vector(pictures[i].world_from_camera * glm::transpose(start.world_from_camera[i]));
    for (int c = 0; c < 3; ++c) {
      normal.a(row + c, row + c) += turn;
      normal.b(row + c) -= turn * turned[c];
    }
    normal.a(row + 3, row + 3) += exposure;
    normal.b(row + 3) -= exposure * std::log(pictures[i].exposure / start.exposure[i]);
  }
  return normal;
}

/// The largest turn of a Gauss-Newton step.
double improve(std::vector<HandHeldPicture>& pictures, const Normal& normal, double longest) {
  cv::Mat1d x;
  if (!cv::solve(normal.a, normal.b, x, cv::DECOMP_CHOLESKY))
    return 0.0;
  double largest = 0.0;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const int row = kUnknowns * static_cast<int>(i);
    glm::dvec3 w(x(row), x(row + 1), x(row + 2));
    w *= std::min(1.0, longest / std::max(glm::length(w), 1e-12));
    pictures[i].world_from_camera = turn_by(w) * pictures[i].world_from_camera;
    pictures[i].exposure *= std::exp(x(row + 3));
    largest = std::max(largest, glm::length(w));
  }
  return largest;
}

/// From the least eigenvalue of a picture's own block: what it shows beside the others decides so well about its turn.
std::vector<double> sigmas_of(const Normal& normal, std::size_t count) {
  std::vector<double> sigma;
  for (std::size_t i = 0; i < count; ++i) {
    const int row = kUnknowns * static_cast<int>(i);
    cv::Mat eigen;
    cv::eigen(normal.own(cv::Rect(row, row, 3, 3)), eigen);
    const double least = eigen.at<double>(2);
    sigma.push_back(least > 0 ? std::min(1.0 / std::sqrt(least) / kDegree, 180.0) : 180.0);
  }
  return sigma;
}

double disagreement_of(const Views& views, const std::vector<HandHeldPicture>& pictures) {
  std::vector<std::vector<double>> off(pictures.size() * pictures.size());
  for_pairs(views, pictures, [&](const auto& a, const auto& b, double difference) {
    off[a.first * pictures.size() + b.first].push_back(difference);
  });
  double sum = 0, count = 0;
  for (std::vector<double>& pair : off)
    if (pair.size() >= kFewestDirections) {
      sum += std::pow(median_of(pair), 2);
      ++count;
    }
  return count > 0 ? std::sqrt(sum / count) : 0.0;
}

/// Spread evenly over the sphere (Gonzalez 2010).
std::vector<glm::dvec3> even_directions(std::size_t count) {
  std::vector<glm::dvec3> directions;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(count),
                 r = std::sqrt(1.0 - z * z), phi = 2.399963229728653 * static_cast<double>(i);
    directions.emplace_back(r * std::cos(phi), r * std::sin(phi), z);
  }
  return directions;
}

} // namespace

Result<LightAgreement> agree_in_light(std::vector<HandHeldPicture>& pictures, const std::vector<glm::dmat3>& rough,
                                      double sigma_rough, const Progress& progress) {
  const std::vector<glm::dvec3> directions = even_directions(kDirections);
  Start start{rough, sigma_rough, {}};
  for (const HandHeldPicture& p : pictures)
    start.exposure.push_back(p.exposure);
  LightAgreement result;
  for (const double blur : kBlur) {
    std::vector<LogPicture> logs(pictures.size());
    const auto blurred = parallel_stage("blur", pictures.size(), 1, progress,
                                        [&](std::size_t i) { logs[i] = log_picture(pictures[i], blur); });
    if (!blurred)
      return blurred.error();
    for (int round = 0; round < kRounds; ++round) {
      const auto views = views_of(pictures, logs, directions, "light", progress);
      if (!views)
        return views.error();
      const Normal normal = normal_equations(*views, pictures, start);
      result.sigma_deg = sigmas_of(normal, pictures.size());
      result.disagreement = disagreement_of(*views, pictures);
      if (improve(pictures, normal, kLongestStep * blur) < kSettled * blur)
        break;
    }
  }
  for (std::size_t i = 0; i < pictures.size(); ++i)
    result.measured_over_stated.push_back(pictures[i].exposure / start.exposure[i]);
  return result;
}

} // namespace daylit::calibration
