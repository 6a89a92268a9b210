#include "precompute/room_check.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "precompute/bake.h"
#include "precompute/detail/text_format.h"
#include "precompute/probes.h"
#include "radiosity/patches.h"
#include "radiosity/surface_mesh.h"

namespace daylit::precompute {

namespace {

constexpr int kDefaultRegions = 64;

/// Seconds for each patch (its rays), for each pair (decisions, products), per gathered ray and for the rest, and the
/// growth of the exchange matrix: fitted to `daylit-bench transport-cost` from 2,000 to 50,000 facets, two cores.
constexpr double kSecondsPerPatch = 3.5e-4, kSecondsPerPair = 1e-8, kSecondsPerGatherRay = 1.9e-7, kSecondsFixed = 0.2;
constexpr double kMatrixBytesAt2000 = 5.5e6, kMatrixGrowth = 1.65;

/// Materials in use, with the sum of the areas of their triangles, m^2.
std::vector<CheckedMaterial> list_materials(const Room& room) {
  std::vector<CheckedMaterial> out;
  for (const Material& m : room.materials)
    out.push_back({m.name, m.reflectance, m.transmittance, m.refractive_index, m.is_window, 0, 0.0});
  for (const RoomTriangle& t : room.triangles) {
    ++out[t.material].triangles;
    out[t.material].area_m2 += area_m2(room, t);
  }
  std::erase_if(out, [](const CheckedMaterial& m) { return m.triangles == 0; });
  return out;
}

/// Area |sum of cross products of the fan| / 2, m^2, and mean of the corners.
CheckedOpening describe(const Aperture& aperture) {
  CheckedOpening out{0.0, glm::dvec3(0.0), aperture.inward, aperture.transmittance};
  glm::dvec3 twice_area(0.0);
  for (std::size_t i = 1; i + 1 < aperture.corners.size(); ++i)
    twice_area += glm::cross(aperture.corners[i] - aperture.corners[0], aperture.corners[i + 1] - aperture.corners[0]);
  for (const glm::dvec3& corner : aperture.corners)
    out.centre_m += corner / static_cast<double>(aperture.corners.size());
  out.area_m2 = 0.5 * glm::length(twice_area);
  return out;
}

std::string metres(double value) { return detail::format("%.2f m", value); }

void check_size(const Bounds& bounds, std::vector<std::string>& questions) {
  const glm::dvec3 size = bounds.size();
  const double longest = std::max({size.x, size.y, size.z});
  if (longest > 100)
    questions.push_back("the room is " + metres(longest) +
                        " long: is the model in metres? Models in centimetres or millimetres must be scaled");
  else if (longest < 1)
    questions.push_back("the room is only " + metres(longest) + " long: is the model in metres?");
  if (size.z > 2 * std::max(size.x, size.y) || (size.y < 0.7 * size.z && size.y > 1.8 && size.z > 4.5))
    questions.push_back("the height (z) is " + metres(size.z) + " for " + metres(size.x) + " x " + metres(size.y) +
                        ": is z up? Otherwise use --up y");
}

void check_materials(const std::vector<CheckedMaterial>& materials, std::vector<std::string>& questions) {
  for (const CheckedMaterial& m : materials) {
    const float brightest = std::max({m.reflectance.r, m.reflectance.g, m.reflectance.b});
    if (!m.is_window && brightest > 0.95f)
      questions.push_back("material \"" + m.name + "\" reflects more than 95 %: fresh white paint has about 85 %");
    if (!m.is_window && brightest == 0.0f)
      questions.push_back("material \"" + m.name + "\" is perfectly black: is its Kd missing?");
    if (m.is_window && std::max({m.transmittance.r, m.transmittance.g, m.transmittance.b}) <= 0.0f)
      questions.push_back("window \"" + m.name + "\" lets no light through: check its Tf");
  }
}

/// Meshes the room and places the probes as a bake would; the rest is extrapolated from how many there are.
/// Seconds c0 + c1 n + c2 n^2 + c3 p rays for n patches and p probes; bytes of the matrix ~ n^1.65 and of the volume.
Result<BakeEstimate> estimate_bake(const Room& room, const RayScene& scene, const std::vector<Aperture>& apertures) {
  const BakeOptions options;
  const auto mesh = radiosity::mesh_surfaces(room, {.edge_m = 0, .target_facets = options.target_facets});
  if (!mesh)
    return mesh.error();
  const auto rays = radiosity::facet_scene(*mesh);
  if (!rays)
    return rays.error();
  auto probes = make_grid(room.bounds(), options.grid, options.spacing_m);
  if (!probes)
    return probes.error();
  mark_air(*probes, scene, apertures);
  BakeEstimate e;
  e.facets = mesh->facets.size();
  e.patches = radiosity::find_patches(room, *mesh, *rays, apertures).patches.size();
  e.probes = probes->size();
  e.probes_in_air = static_cast<std::size_t>(std::ranges::count(probes->valid, 1));
  const double n = static_cast<double>(e.patches), p = static_cast<double>(e.probes_in_air);
  e.seconds =
      kSecondsFixed + kSecondsPerPatch * n + kSecondsPerPair * n * n + kSecondsPerGatherRay * p * options.gather_rays;
  e.memory_gb = (kMatrixBytesAt2000 * std::pow(n / 2000, kMatrixGrowth) +
                 4.0 * 27 * kDefaultRegions * static_cast<double>(e.probes)) /
                1e9;
  if (e.probes_in_air == 0)
    return Error{ErrorCode::geometry_invalid, "no point of the room's inside can be reached from an opening", "",
                 "check that the walls enclose a space and that the windows lie in them"};
  return e;
}

/// Goes through the steps of a bake up to the probes; the first that fails is the problem.
std::optional<Error> find_problem(const Room& room, RoomCheck& check) {
  const auto scene = RayScene::build(room);
  if (!scene)
    return scene.error();
  const auto apertures = find_apertures(room, *scene);
  if (!apertures)
    return apertures.error();
  check.apertures = apertures->report;
  for (const Aperture& a : apertures->list)
    check.openings.push_back(describe(a));
  if (apertures->report.unexplained_escape > 0.001)
    check.questions.emplace_back("rays leave through gaps without an outline: are walls missing or not joined?");
  const auto estimate = estimate_bake(room, *scene, apertures->list);
  if (!estimate)
    return estimate.error();
  check.estimate = *estimate;
  return std::nullopt;
}

} // namespace

Result<RoomCheck> check_room(const std::filesystem::path& path, UpAxis up) {
  const auto file = read_room(path, up);
  if (!file)
    return file.error();
  RoomCheck check;
  check.file = path.string();
  check.faces = file->report;
  check.bounds = file->room.bounds();
  check.materials = list_materials(file->room);
  check_size(check.bounds, check.questions);
  check_materials(check.materials, check.questions);
  check.problem = find_problem(file->room, check);
  if (const auto clean = refuse_dropped_faces(file->report, path); !check.problem && !clean)
    check.problem = clean.error();
  if (check.problem && (check.problem->where.empty() || check.problem->where == "room"))
    check.problem->where = check.file;
  return check;
}

} // namespace daylit::precompute
