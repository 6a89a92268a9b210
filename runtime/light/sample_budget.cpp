#include "runtime/light/sample_budget.h"

#include <cmath>

namespace daylit {

namespace {
constexpr double kFloor = 0.002, kScale = 0.1, kPower = 0.75;
constexpr int kLeast = 16, kMost = 1024;
} // namespace

double expected_direct_error(int lights) { return std::hypot(kFloor, kScale * std::pow(lights, -kPower)); }

int lights_for_error(double error) {
  int lights = kLeast;
  while (lights < kMost && expected_direct_error(lights) > error)
    lights *= 2;
  return lights;
}

} // namespace daylit
