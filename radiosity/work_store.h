#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace daylit::radiosity {

/// Where finished work is kept, so that a killed run can go on. Its bytes are a function of the inputs
/// only: found or computed again, they are the same.
class WorkStore {
public:
  enum class Stage : std::uint32_t { exchange = 1, forward = 2, adjoint = 3 };
  struct Name {
    Stage stage;
    std::uint32_t part;  ///< channel of a solve, else 0
    std::uint64_t index; ///< within the part
    auto operator<=>(const Name&) const = default;
  };

  virtual ~WorkStore() = default;
  virtual std::optional<std::vector<std::byte>> find(const Name& name) = 0;
  /// May decline, and may be called from any thread.
  virtual void keep(const Name& name, std::span<const std::byte> bytes) = 0;
};

} // namespace daylit::radiosity
