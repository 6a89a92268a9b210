#pragma once

#include <cstddef>
#include <span>

namespace daylit::bench {

/// Reads every byte in order with the widest vectors: what no program that needs the bytes can undercut.
void read_plainly(std::span<const std::byte> bytes);

} // namespace daylit::bench
