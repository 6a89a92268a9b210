#pragma once

// Memory that is streamed through frame after frame, on large pages where the system has them: hardware prefetch does
// not stop every 4 KiB, and what fits a cache by its size does not lose to conflicts of scattered pages.

#include <cstddef>
#include <cstdlib>
#include <new>
#include <vector>

#include <sys/mman.h>

namespace daylit::detail {

template <class Number>
struct HugePages {
  using value_type = Number;
  static constexpr std::size_t kPage = std::size_t{2} << 20;

  HugePages() = default;
  template <class Other>
  explicit HugePages(const HugePages<Other>&) {}

  Number* allocate(std::size_t count) {
    const std::size_t bytes = count * sizeof(Number), align = bytes >= kPage / 2 ? kPage : 64;
    void* memory = std::aligned_alloc(align, (bytes + align - 1) / align * align);
    if (!memory)
      throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
    if (align == kPage) // advice: without it the pages are small
      madvise(memory, (bytes + align - 1) / align * align, MADV_HUGEPAGE);
#endif
    return static_cast<Number*>(memory);
  }
  void deallocate(Number* memory, std::size_t) { std::free(memory); }
  bool operator==(const HugePages&) const { return true; }
};

template <class Number>
using HugeVector = std::vector<Number, HugePages<Number>>;

} // namespace daylit::detail
