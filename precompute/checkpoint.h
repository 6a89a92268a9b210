#pragma once

// A file beside the output that grows while a bake runs and lets a killed bake go on.

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "radiosity/work_store.h"
#include "scene/core/output_file.h"
#include "scene/core/result.h"

namespace daylit::precompute {

constexpr FileKind kCheckpointKind{"a checkpoint of a bake", "0dayckp1"};

/// Records of a name, a length, the bytes and their XXH64, one after another. A record that was cut short by a kill, or
/// damaged, and all after it are dropped. Nothing is written in the first two seconds: short bakes leave no traces.
/// Write errors (a full disk) end the keeping, not the bake.
class Checkpoint final : public radiosity::WorkStore {
public:
  /// `identity`: everything that the records depend on (room, settings, program version); a file of another identity is
  /// an Error with `resume`, and overwritten without.
  static Result<std::unique_ptr<Checkpoint>> open(const std::filesystem::path& path, std::uint64_t identity,
                                                  bool resume);
  ~Checkpoint() override;
  Checkpoint(const Checkpoint&) = delete;
  Checkpoint& operator=(const Checkpoint&) = delete;

  std::optional<std::vector<std::byte>> find(const Name& name) override;
  void keep(const Name& name, std::span<const std::byte> bytes) override;
  /// The bake is done: removes the file.
  void remove();
  std::size_t records_found() const { return records_.size(); }
  /// What a user is told of a file that is not whole; else empty.
  const std::string& note() const { return note_; }

private:
  struct Extent {
    long offset;
    std::uint64_t bytes;
  };
  Checkpoint(std::filesystem::path path, std::uint64_t identity) : path_(std::move(path)), identity_(identity) {}
  Result<void> read_existing();
  bool write_header();

  std::filesystem::path path_;
  std::uint64_t identity_;
  std::FILE* file_ = nullptr;
  std::map<Name, Extent> records_;
  std::string note_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  bool broken_ = false;
};

} // namespace daylit::precompute
