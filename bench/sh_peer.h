#pragma once

// Another transform library beside ours in one run. Such a library is built by whoever wants to compare, wrapped in a
// shared object with two C functions (docs/sh.md), and loaded at run time; nothing of it is part of this project.

#include <memory>
#include <string>

#include "scene/core/result.h"

namespace daylit::bench {

class ShPeer {
public:
  /// One channel, Gauss-Legendre grid, row-major `rings` x `longitudes`. alm: complex a_lm of m >= 0, order by order
  /// (m = 0: l = 0 .. degree, then m = 1: l = 1 .. degree, ...), with Condon-Shortley phase.
  using Synthesis = void (*)(int degree, int rings, int longitudes, const double* alm, double* map);
  using Analysis = void (*)(int degree, int rings, int longitudes, const double* map, double* alm);

  static Result<ShPeer> load(const std::string& path);

  Synthesis synthesis = nullptr;
  Analysis analysis = nullptr;

private:
  std::shared_ptr<void> library_;
};

} // namespace daylit::bench
