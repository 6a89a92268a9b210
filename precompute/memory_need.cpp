#include "precompute/memory_need.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "scene/core/memory.h"

namespace daylit::precompute {

namespace {

constexpr double kOfMachine = 0.6;
constexpr double kMargin = 1.1;          ///< more than bakes of a box, a classroom and a school took
constexpr double kProgram = 6e7;         ///< bytes
constexpr double kProbeBytes = 250;      ///< per probe of the grid, in the air or not
constexpr double kRowBytes = 0.8;        ///< per element and node: what an element sees of the sky
constexpr double kSolveFloats = 7;       ///< per patch and column: right-hand side, three channels, and their copy
constexpr double kFineFloats = 6;        ///< the same of the fine sky: both copies
constexpr double kComponents = 180;      ///< of a probe cluster's rows at an error of 3 % ...
constexpr double kComponentsPower = 0.8; ///< ... ~ error^-this
constexpr double kFilling = 0.95;        ///< probes of a cluster / most
constexpr double kBeside = 1.5;          ///< with l = 4, projections and lists of parts
constexpr double kParts = 0.5;           ///< what a cluster tells apart / elements, of one room
constexpr double kThreadBytes = 2.4e4;   ///< per thread and part, at work on a cluster
constexpr double kSketch = 360;          ///< floats per element: random suns
// Of the address space: what libraries, allocator and threads reserve and do not use. Each thread has a buffer of 134
// MB from OpenBLAS, which waits for ever where it gets none, and 72 MB of stack and heap.
constexpr double kReserved = 2.5e8, kReservedByThread = 2.1e8;

double threads() {
  return static_cast<double>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

/// Solved clusters twice, rows of all probe clusters in floats as a basis and its coordinates, and what each thread
/// works on.
double fine_sky_bytes(const BakeReport& counts, const BakeOptions& options) {
  const auto patches = static_cast<double>(counts.patches), elements = static_cast<double>(counts.elements),
             probes = static_cast<double>(counts.probes_valid), parts = kParts * elements * options.seen_of_room;
  const double in_cluster = kFilling * static_cast<double>(kProbesInCluster);
  const double components = kComponents * std::pow(0.03 / options.compact_error, kComponentsPower);
  const double rows = kBeside * probes / in_cluster * components * (parts + 9 * std::min(in_cluster, probes));
  return 4 * (kFineFloats * patches * static_cast<double>(options.clusters) + rows + kSketch * elements) +
         threads() * kThreadBytes * parts;
}

} // namespace

/// program + probes + exchange + the larger of solution and result; a fine sky has its light on the elements beside.
double needed_memory(const BakeReport& counts, const SkyPartition& partition, const BakeOptions& options) {
  const auto patches = static_cast<double>(counts.patches), regions = static_cast<double>(partition.size());
  double bytes =
      kProgram + kProbeBytes * static_cast<double>(counts.probes) + static_cast<double>(counts.exchange.bytes);
  if (partition.interpolated())
    bytes +=
        kRowBytes * static_cast<double>(counts.elements) * regions +
        std::max(4 * kSolveFloats * patches * static_cast<double>(options.clusters), fine_sky_bytes(counts, options));
  else
    bytes += 4 * regions * (kSolveFloats * patches + 27 * static_cast<double>(counts.probes_valid));
  return kMargin * bytes;
}

Result<void> check_memory(double needed_bytes, double allowed_bytes) {
  if (allowed_bytes <= 0 || needed_bytes <= allowed_bytes)
    return {};
  return Error{ErrorCode::limit_exceeded,
               fmt::format("this bake needs about {:.2g} GB of memory, and {:.2g} GB may be taken", needed_bytes / 1e9,
                           allowed_bytes / 1e9),
               "--memory", "allow more, or ask for less: a larger --max-error, one room (--inside), points (--points)"};
}

Result<double> allowed_memory(double wanted_bytes) {
  const double wanted = wanted_bytes > 0 ? wanted_bytes : kOfMachine * machine_memory_bytes(),
               reserved = kReserved + kReservedByThread * threads(), left = address_space_left_bytes();
  if (left <= reserved)
    return Error{ErrorCode::limit_exceeded,
                 fmt::format("ulimit -v leaves {:.2g} GB, and the program reserves {:.2g} GB before it begins",
                             left / 1e9, reserved / 1e9),
                 "--memory", "allow more"};
  return std::min(wanted, left - reserved);
}

} // namespace daylit::precompute
