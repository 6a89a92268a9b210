#include "scene/core/memory.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

namespace daylit {

namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();
constexpr double kUnlimited = 0x1p60; // version 1 writes its largest number of pages

/// The number in a file; none where it says "max" or is not there.
double number_in(const std::filesystem::path& file) {
  std::ifstream stream(file);
  double bytes = kNoLimit;
  return stream >> bytes && bytes < kUnlimited ? bytes : kNoLimit;
}

/// min over the group and those around it.
double least_above(const std::filesystem::path& top, std::filesystem::path group, const char* file) {
  double least = number_in(top / file);
  for (group = group.relative_path(); !group.empty(); group = group.parent_path())
    least = std::min(least, number_in(top / group / file));
  return least;
}

double page_bytes() { return static_cast<double>(sysconf(_SC_PAGESIZE)); }

} // namespace

double control_group_bytes(const std::filesystem::path& own, const std::filesystem::path& mounted) {
  std::ifstream stream(own);
  double least = kNoLimit;
  for (std::string line; std::getline(stream, line);) { // number:controllers:/group
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos)
      continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",",
                      group = line.substr(second + 1);
    if (controllers == ",,")
      least = std::min(least, least_above(mounted, group, "memory.max"));
    else if (controllers.find(",memory,") != std::string::npos)
      least = std::min(least, least_above(mounted / "memory", group, "memory.limit_in_bytes"));
  }
  return least;
}

double machine_memory_bytes() {
  return std::min(page_bytes() * static_cast<double>(sysconf(_SC_PHYS_PAGES)),
                  control_group_bytes("/proc/self/cgroup", "/sys/fs/cgroup"));
}

/// One arena: those of further threads cannot hold a block above 64 MB.
void keep_freed_memory() {
  constexpr int kLargest = std::numeric_limits<int>::max();
  mallopt(M_ARENA_MAX, 1);
  mallopt(M_MMAP_THRESHOLD, kLargest);
  mallopt(M_TRIM_THRESHOLD, kLargest);
}

double peak_memory_bytes() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  return 1024.0 * static_cast<double>(use.ru_maxrss);
}

double address_space_left_bytes() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
    return kNoLimit;
  double pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return std::max(0.0, static_cast<double>(limit.rlim_cur) - page_bytes() * pages);
}

} // namespace daylit
