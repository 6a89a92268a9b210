#include "bench/selftest/closed_form_cases.h"

#include "precompute/bake.h"

namespace daylit::bench {

Result<SelftestQuality> selftest_quality(const std::string& name) {
  if (name != "normal" && name != "high")
    return Error{ErrorCode::usage, "unknown quality '" + name + "'", "--quality", "use normal or high"};
  const auto bake = precompute::quality_options(name);
  if (!bake)
    return bake.error();
  SelftestQuality q{.facets = bake->target_facets, .visibility_rays = bake->visibility_rays};
  if (name == "high") {
    q.sky_rows_px = 1024;
    q.sky_regions = 4096;
    q.tolerance = 0.005;
  }
  return q;
}

std::vector<ClosedFormCase> closed_form_cases() {
  std::vector<ClosedFormCase> all(sky_cases().begin(), sky_cases().end());
  all.insert(all.end(), closed_room_cases().begin(), closed_room_cases().end());
  return all;
}

} // namespace daylit::bench
