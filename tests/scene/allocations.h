#pragma once

// Counts instead of limiting: a reader that asks for too much fails the test, not the process.

#include <cstddef>

namespace daylit::test {

/// Largest request to operator new in this process since the last reset, bytes. Link allocations.cpp.
std::size_t largest_allocation();
void reset_largest_allocation();

} // namespace daylit::test
