#include "sh/sh9.h"

namespace daylit::sh {
static_assert(evaluate9<double>(0.0, 0.0, 1.0)[2] > 0.0, "Y_1,0 ~ +z: no Condon-Shortley phase");
} // namespace daylit::sh
