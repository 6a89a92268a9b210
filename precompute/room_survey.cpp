#include "precompute/room_survey.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "precompute/detail/text_format.h"
#include "scene/room/polygon.h"

namespace daylit::precompute {

namespace {

using detail::format;

constexpr double kLongest_m = 1000.0;
constexpr double kBehind_m = 0.1; // panes closer than this are one pane of two faces, or double glazing
constexpr double kParallel = 0.999;
constexpr std::size_t kMostPanes = 2000;

double brightest(const Rgb& c) { return static_cast<double>(std::max({c.r, c.g, c.b})); }

glm::dvec3 middle(const Aperture& a) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& corner : a.corners)
    sum += corner / static_cast<double>(a.corners.size());
  return sum;
}

double longest_side(const Room& room) {
  const Bounds bounds = room.bounds();
  const glm::dvec3 size = bounds.empty() ? glm::dvec3(0.0) : bounds.size();
  return std::max({size.x, size.y, size.z});
}

void check_size(const Bounds& bounds, std::vector<std::string>& questions) {
  const glm::dvec3 size = bounds.size();
  const double longest = std::max({size.x, size.y, size.z});
  if (longest > 100)
    questions.push_back(format("the room is %.2f m long: is the model in metres? Models in centimetres or millimetres "
                               "must be scaled",
                               longest));
  else if (longest < 1)
    questions.push_back(format("the room is only %.2f m long: is the model in metres?", longest));
  if (size.z > 2 * std::max(size.x, size.y) || (size.y < 0.7 * size.z && size.y > 1.8 && size.z > 4.5))
    questions.push_back(
        format("the height (z) is %.2f m for %.2f m x %.2f m: is z up? Otherwise use --up y", size.z, size.x, size.y));
}

void check_materials(const Room& room, std::vector<std::string>& questions) {
  std::vector<bool> used(room.materials.size());
  for (const RoomTriangle& t : room.triangles)
    used[t.material] = true;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const Material& m = room.materials[i];
    if (!used[i])
      continue;
    if (m.is_window && brightest(m.transmittance) <= 0)
      questions.push_back("window \"" + m.name + "\" lets no light through: check its Tf");
    if (!m.is_window && m.reflectance == Rgb(0.0f))
      questions.push_back("material \"" + m.name + "\" is perfectly black: is its Kd missing?");
    if (!m.is_window && brightest(m.reflectance) > 0.95)
      questions.push_back("material \"" + m.name + "\" reflects more than 95 %: fresh white paint has about 85 %");
  }
}

/// Panes that another one covers at a short distance.
void check_panes(const std::vector<Aperture>& panes, std::vector<std::string>& questions) {
  std::size_t count = 0;
  double distance_m = 0;
  glm::dvec3 where(0.0);
  for (std::size_t i = 0; i < std::min(panes.size(), kMostPanes); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const glm::dvec3 m = middle(panes[i]), n = panes[k].inward;
      const double height = glm::dot(m - panes[k].corners[0], n);
      const glm::dvec3 turn = glm::normalize(daylit::detail::newell_normal(panes[k].corners));
      if (std::abs(height) > kBehind_m || std::abs(glm::dot(n, panes[i].inward)) < kParallel ||
          !daylit::detail::inside_convex(panes[k].corners, turn, m - height * n, 0.0))
        continue;
      if (count++ == 0) {
        distance_m = std::abs(height);
        where = m;
      }
    }
  if (count > 0)
    questions.push_back(format("%zu panes lie close behind another, the first %.0f mm at (%.2f, %.2f, %.2f): light "
                               "passes both. Is that double glazing, or one pane drawn as a box?",
                               count, 1e3 * distance_m, where.x, where.y, where.z));
}

double opening_m2(const std::vector<Aperture>& apertures) {
  double sum = 0;
  for (const Aperture& a : apertures)
    sum += 0.5 * glm::length(daylit::detail::newell_normal(a.corners)) * brightest(a.transmittance);
  return sum;
}

/// The light of a thin gap is that of a hole of its area: under an even sky its part is that of the areas.
void check_gaps(RoomSurvey& survey) {
  const Gaps& gaps = survey.gaps;
  if (!gaps.complete)
    survey.apertures.report.notes.emplace_back("too many edges to look for gaps everywhere: only some were followed");
  if (gaps.list.empty())
    return;
  survey.gap_light = gaps.area_m2 / std::max(opening_m2(survey.apertures.list), 1e-9);
  survey.questions.push_back(
      format("%zu joints do not close: %.2f m long, up to %.1f mm wide. Light that comes in there is up to %.2g %% of "
             "what the openings let in: close them with --close-gaps %.0f",
             gaps.list.size(), gaps.length_m, 1e3 * gaps.widest_m, 100 * survey.gap_light,
             std::ceil(1e3 * gaps.widest_m - 1e-3)));
}

Result<Apertures> apertures_of(const Room& room) {
  const auto rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  return find_apertures(room, *rays);
}

Result<void> close_gaps_of(RoomFile& file, double widest_m) {
  const auto apertures = apertures_of(file.room);
  if (!apertures)
    return apertures.error();
  const auto gaps = find_gaps(file.room, apertures->list, widest_m);
  if (!gaps)
    return gaps.error();
  close_gaps(file.room, *gaps);
  file.report.notes.push_back(format("%zu gaps at joints closed: %.2f m long, up to %.1f mm wide", gaps->list.size(),
                                     gaps->length_m, 1e3 * gaps->widest_m));
  file.content_hash = content_hash(file.room);
  return {};
}

} // namespace

/// A kilometre is more than any room: what is longer was drawn in other units.
Result<void> check_extent(const Room& room) {
  const double longest = longest_side(room);
  if (longest > kLongest_m)
    return Error{ErrorCode::value_invalid, format("the room is %.2f m long", longest), "room",
                 "the model must be in metres: scale it from millimetres or centimetres"};
  return {};
}

Result<void> survey_room(RoomFile& file, double close_gaps_m, RoomSurvey& survey) {
  check_size(file.room.bounds(), survey.questions);
  check_materials(file.room, survey.questions);
  if (const auto fits = check_extent(file.room); !fits)
    return fits;
  if (close_gaps_m > 0)
    if (const auto closed = close_gaps_of(file, close_gaps_m); !closed)
      return closed;
  auto apertures = apertures_of(file.room);
  if (!apertures)
    return apertures.error();
  survey.apertures = std::move(*apertures);
  auto gaps = find_gaps(file.room, survey.apertures.list);
  if (!gaps)
    return gaps.error();
  survey.gaps = std::move(*gaps);
  check_panes(survey.apertures.list, survey.questions);
  if (survey.apertures.report.unexplained_escape > 0.001)
    survey.questions.emplace_back("rays leave through gaps without an outline: are walls missing or not joined?");
  check_gaps(survey);
  return {};
}

} // namespace daylit::precompute
