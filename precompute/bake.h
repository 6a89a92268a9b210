#pragma once

// One room in, one basis irradiance volume out.

#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "precompute/audit.h"
#include "precompute/compact_sky.h"
#include "precompute/probe_density.h"
#include "precompute/standing_faces.h"
#include "precompute/surface_light.h"
#include "radiosity/energy.h"
#include "radiosity/first_bounce.h"
#include "radiosity/form_factors.h"
#include "radiosity/solve.h"
#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/room/aperture.h"
#include "scene/room/room_formats.h"
#include "scene/sky/sky_partition.h"
#include "scene/volume/volume.h"

namespace daylit::precompute {

struct BakeOptions {
  double facet_edge_m = 0; ///< 0: chosen for target_facets
  double near_m = 0.08;    ///< radiosity::MeshOptions::near_m: less than the thickness of most walls
  int target_facets = 2500;
  double visibility_rays = 229376;  ///< of partly hidden pairs, per unit of form factor
  int directions = 16384;           ///< of direct light, radiosity::FirstBounceOptions
  int gather_rays = 2048;           ///< per probe
  double low_rank_tolerance = 1e-4; ///< of far blocks of the exchange matrix; 0: all entries are kept
  double tolerance = 1e-5;          ///< residual of the solver
  Bounds box;                       ///< world metres, of the grid; empty: of the whole room
  glm::ivec3 grid{0};               ///< probes per axis; 0: spacing_m decides
  double spacing_m = 0.3;
  ProbeDensity density;                  ///< of the grid; empty: regular
  Planes near_surfaces;                  ///< that the grid has beside, world metres (standing_faces.h)
  std::vector<glm::dvec3> points;        ///< world metres; not empty: probes exactly here, no grid
  std::vector<glm::dvec3> receivers;     ///< world metres, where the light is wanted: facets are larger where what they
                                         ///< send hardly comes (radiosity::SizeField). Empty: all alike
  radiosity::WorkStore* store = nullptr; ///< where finished work is kept and found again
  double memory_bytes = 0;               ///< that the bake may take; 0: no limit
  double seen_of_room = 1;               ///< of what one place sees in a single room: of several rooms less. For
                                         ///< the prediction of memory alone
  double compact_error = 0.03;           ///< of the factors of a fine sky
  std::size_t more_elements = 1100;      ///< than facets, on which the light of a fine sky falls
  std::size_t clusters = 1024;           ///< of surfaces whose further bounces are solved together, for a fine sky
  ShOrder sh_order = ShOrder::second;    ///< fourth: the coefficients of l = 4 too
  bool audit = false;                    ///< measure the error at held-out points and skies
  std::vector<glm::dvec3> held_out;      ///< world metres, of the audit; empty: chosen
  std::vector<glm::dvec3> held_out_standing = {}; ///< the same where objects stand (points_above())
  std::vector<RoomPoints> held_out_rooms = {};    ///< the same room by room (points_by_room())
};

/// "draft", "normal", "high". At given points the transport is finer: no interpolation hides its error there, and no
/// neighbours average its noise.
Result<BakeOptions> quality_options(const std::string& name, bool given_points = false);

struct StageTime {
  std::string name;
  double seconds = 0;
};

struct BakeReport {
  RoomReport room;
  ApertureReport apertures;
  std::size_t facets = 0, patches = 0, elements = 0;
  std::size_t fixed_facets = 0;       ///< of the facets, SurfaceMesh::fixed_facets
  double mean_facet_m2 = 0;           ///< area of the facet that light comes from: mean by area and importance
  std::size_t sides_skipped = 0;      ///< no light reaches them
  std::size_t sides_without_path = 0; ///< lit, but no light goes from them to any of the given points
  double facet_edge_m = 0;
  double doubled_m2 = 0; ///< faces on faces, SurfaceMesh::doubled_m2
  int regions = 0, regions_stored = 0;
  std::size_t probes = 0, probes_valid = 0;
  std::size_t probes_interpolated = 0; ///< in the air, without light of their own (far_probes.h)
  std::size_t probes_repeated = 0;     ///< given points at the position of another: gathered once
  double seen_fraction = 1;            ///< of the area that the sky lights, by one place: constant regions only
  radiosity::ExchangeReport exchange;
  radiosity::FirstBounceReport first_bounce;
  radiosity::SolveReport solve;
  bool adjoint = false;          ///< solved from the probes towards the light: fewer columns
  radiosity::RowClosure closure; ///< of the form factors, before their rows were closed
  radiosity::EnergyBalance energy;
  CompactReport compact; ///< fine skies only
  AuditReport audit;     ///< empty without BakeOptions::audit
  std::vector<StageTime> stages;
  double total_seconds = 0;
  double memory_bytes = 0; ///< needed_memory()
};

/// The volume of `room` for every region of `partition`. Errors of the stages are passed on; limit_exceeded before the
/// first of them where needed_memory() is more than the bake may take.
Result<BasisVolume> bake(const RoomFile& room, const SkyPartition& partition, const BakeOptions& options,
                         const Progress& progress, BakeReport& report);

/// The first stage alone: the counts that bake() would report (facets, patches, elements, probes), the bytes of its
/// form factors and of all. Errors of that stage, and of form factors that need too much memory.
Result<BakeReport> count_bake(const RoomFile& room, const SkyPartition& partition, const BakeOptions& options);

/// The report as JSON (one object) and as the lines a person reads.
/// Without `times` it is a function of the input: the same room and settings give the same text.
std::string to_json(const BakeReport& report, bool times = true);
std::string to_text(const BakeReport& report);

} // namespace daylit::precompute
