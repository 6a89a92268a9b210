#include "runtime/maps/progressive_maps.h"

#include <utility>

namespace daylit {

Result<void> ProgressiveMaps::start(RadianceMap source, std::vector<Lobe> lobes, double tolerance) {
  cancel();
  auto approximate = prefilter(source, lobes, PrefilterMethod::mip_chain, {tolerance, {}, {}});
  if (!approximate)
    return approximate.error();
  {
    const std::lock_guard lock(mutex_);
    now_ = {std::move(*approximate), 0, false, now_.version + 1};
  }
  thread_ = std::jthread([this, source = std::move(source), lobes = std::move(lobes), tolerance](std::stop_token stop) {
    refine(source, lobes, tolerance, std::move(stop));
  });
  return {};
}

void ProgressiveMaps::refine(const RadianceMap& source, std::span<const Lobe> lobes, double tolerance,
                             std::stop_token stop) {
  const auto tile_done = [this](const MapTile& tile, const RadianceMap& map) {
    const std::lock_guard lock(mutex_);
    for (const std::uint32_t t : tile.texels)
      now_.maps[tile.lobe].radiance[t] = map.radiance[t];
    now_.exact_texels += tile.texels.size();
    ++now_.version;
  };
  if (prefilter(source, lobes, PrefilterMethod::exact, {tolerance, std::move(stop), tile_done})) {
    const std::lock_guard lock(mutex_);
    now_.finished = true;
    ++now_.version;
  }
}

void ProgressiveMaps::cancel() {
  thread_.request_stop();
  wait();
}

void ProgressiveMaps::wait() {
  if (thread_.joinable())
    thread_.join();
}

ProgressiveMaps::Snapshot ProgressiveMaps::snapshot() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

} // namespace daylit
