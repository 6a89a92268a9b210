#pragma once

// How much memory this process may take.

#include <filesystem>

namespace daylit {

/// Bytes of the machine's memory, or of the control group of this process or one around it where that allows less.
double machine_memory_bytes();

/// Freed memory stays with this process, of any size, for its next block: the kernel hands out zeroed pages, and those
/// of blocks of tens of megabytes that come and go cost more time than what is computed in them.
void keep_freed_memory();

/// Most bytes that this process has held at once so far.
double peak_memory_bytes();

/// Bytes of address space that `ulimit -v` leaves beside what this process holds already; infinity: no limit.
double address_space_left_bytes();

/// The least that a control group of the list `own` (/proc/self/cgroup: versions 1 and 2) and those around it allow,
/// bytes; infinity: no limit. `mounted`: where the groups are.
double control_group_bytes(const std::filesystem::path& own, const std::filesystem::path& mounted);

} // namespace daylit
