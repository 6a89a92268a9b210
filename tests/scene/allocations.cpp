#include "tests/scene/allocations.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<std::size_t> g_largest{0};
}

void* operator new(std::size_t size) {
  std::size_t seen = g_largest.load();
  while (seen < size && !g_largest.compare_exchange_weak(seen, size)) {
  }
  if (void* p = std::malloc(size > 0 ? size : 1))
    return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace daylit::test {

std::size_t largest_allocation() { return g_largest.load(); }
void reset_largest_allocation() { g_largest.store(0); }

} // namespace daylit::test
