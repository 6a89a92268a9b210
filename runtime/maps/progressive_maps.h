#pragma once

// Blurred maps for a picture that cannot wait: the mip chain's at once, the exact ones in their place, tile by tile,
// from a thread of its own.

#include <cstdint>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "runtime/maps/prefilter.h"

namespace daylit {

/// What it shows depends on when it is asked: where same inputs must give same bits, call prefilter() instead.
class ProgressiveMaps {
public:
  struct Snapshot {
    std::vector<RadianceMap> maps; ///< one per lobe
    std::size_t exact_texels = 0;  ///< of all maps, already exact
    bool finished = false;         ///< all of them
    std::uint64_t version = 0;     ///< grows with every change
  };

  /// Computes the approximate maps before it returns, then starts the exact ones; what was still running is cancelled
  /// first. After an error the maps are as they were.
  Result<void> start(RadianceMap source, std::vector<Lobe> lobes, double tolerance = 1e-5);
  /// Cancels the exact maps; the tiles that are done stay.
  void cancel();
  /// Waits for the exact maps, or until they are cancelled.
  void wait();
  Snapshot snapshot() const;

private:
  void refine(const RadianceMap& source, std::span<const Lobe> lobes, double tolerance, std::stop_token stop);

  mutable std::mutex mutex_;
  Snapshot now_;
  std::jthread thread_; ///< last: ends before what it writes to
};

} // namespace daylit
