#include "runtime/session/sky_stage.h"

#include <algorithm>

#include "runtime/session/stage_clock.h"

namespace daylit {

SkyStage::Tables SkyStage::make_tables(const SkyImage& sky) const {
  return {sky.geometry(), SkyResampler::make(sky),
          RegionSums::make(sky.geometry(), volume_.partition, regions_that_count(volume_))};
}

void SkyStage::update(const SkyImage& sky, std::uint64_t id, FrameReport& report) {
  StageClock clock(report);
  const Version picture = picture_.of(sky.image(), id, sky.geometry().get());
  clock.end("compare");
  light_.update({picture}, [&](SkyLight& light) {
    if (!tables_ || tables_->geometry != sky.geometry())
      tables_ = make_tables(sky);
    const auto measured = find_sun(sky, tables_->resampler.pixel_directions());
    light.sun = steady_sun_.update(sky, measured);
    light.pyramid.resize(std::max<std::size_t>(light.pyramid.size(), 1));
    tables_->resampler.resample(sky, measured ? &*measured : nullptr, light.pyramid[0]);
    halve_sky_map(light.pyramid);
    clock.end("sky");
    std::vector<Rgb> regions = tables_->regions.reduce(sky);
    if (light.sun) // the regions hold the sun as this frame measured it
      add_distant_light(volume_.partition, light.sun->direction,
                        light.sun->normal_irradiance - measured->normal_irradiance, regions);
    clock.end("regions");
    combiner_.update(regions);
    clock.end("combine");
  });
}

} // namespace daylit
