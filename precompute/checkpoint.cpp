#include "precompute/checkpoint.h"

#include <array>
#include <string_view>
#include <unistd.h>

#include "scene/core/checksum.h"

namespace daylit::precompute {

namespace {

constexpr std::chrono::seconds kPatience{2};

struct Header {
  std::array<char, 8> magic;
  std::uint64_t identity;
  bool is_ours() const { return std::string_view(magic.data(), magic.size()) == kCheckpointKind.start; }
};
Header header_of(std::uint64_t identity) {
  Header header{{}, identity};
  kCheckpointKind.start.copy(header.magic.data(), header.magic.size());
  return header;
}
struct RecordHead {
  std::uint32_t stage, part;
  std::uint64_t index, bytes, checksum;
};

std::span<const std::byte> bytes_of(const auto& value) { return std::as_bytes(std::span(&value, 1)); }

} // namespace

/// With `resume` reads what is there, else removes it.
Result<std::unique_ptr<Checkpoint>> Checkpoint::open(const std::filesystem::path& path, std::uint64_t identity,
                                                     bool resume) {
  std::unique_ptr<Checkpoint> c(new Checkpoint(path, identity));
  std::error_code ignored;
  if (resume && std::filesystem::exists(path, ignored)) {
    if (const Result<void> read = c->read_existing(); !read)
      return read.error();
  } else {
    std::filesystem::remove(path, ignored);
  }
  return c;
}

Checkpoint::~Checkpoint() {
  if (file_)
    std::fclose(file_);
}

/// Records up to the first that is cut short or damaged; the file is cut there.
Result<void> Checkpoint::read_existing() {
  file_ = std::fopen(path_.c_str(), "r+b");
  if (!file_)
    return Error{ErrorCode::io, "cannot open the checkpoint", path_.string(),
                 "check permissions, or run without --resume"};
  Header header{};
  if (std::fread(&header, sizeof header, 1, file_) != 1 || !header.is_ours())
    return Error{ErrorCode::file_malformed, "not a checkpoint of this program", path_.string(), "run without --resume"};
  if (header.identity != identity_)
    return Error{ErrorCode::value_invalid, "the checkpoint is of another room, other settings or another version",
                 path_.string(), "use the arguments of the run that was interrupted, or run without --resume"};
  const std::uint64_t size = std::filesystem::file_size(path_);
  long end = sizeof header;
  for (RecordHead head{}; std::fread(&head, sizeof head, 1, file_) == 1;) {
    const long data = end + static_cast<long>(sizeof head);
    if (head.bytes > size - static_cast<std::uint64_t>(data))
      break;
    std::vector<std::byte> bytes(head.bytes);
    if (std::fread(bytes.data(), 1, bytes.size(), file_) != bytes.size() || checksum64(bytes) != head.checksum)
      break;
    records_[{static_cast<Stage>(head.stage), head.part, head.index}] = {data, head.bytes};
    end = data + static_cast<long>(head.bytes);
  }
  if (records_.empty())
    note_ = path_.string() + " holds nothing that can be used: the bake starts anew";
  else if (static_cast<std::uint64_t>(end) < size)
    note_ = path_.string() + " is cut short or damaged: what is lost of it is computed again";
  if (std::fseek(file_, end, SEEK_SET) != 0 || ::ftruncate(::fileno(file_), end) != 0)
    return Error{ErrorCode::io, "cannot write the checkpoint", path_.string(),
                 "check permissions, or run without --resume"};
  return {};
}

/// Read from the file each time: records may be large.
std::optional<std::vector<std::byte>> Checkpoint::find(const Name& name) {
  const std::lock_guard lock(mutex_);
  const auto found = records_.find(name);
  if (found == records_.end())
    return std::nullopt;
  std::vector<std::byte> bytes(found->second.bytes);
  if (std::fseek(file_, found->second.offset, SEEK_SET) != 0 ||
      std::fread(bytes.data(), 1, bytes.size(), file_) != bytes.size())
    return std::nullopt;
  return bytes;
}

/// Magic and identity; false when the file cannot be written.
bool Checkpoint::write_header() {
  const Header header = header_of(identity_);
  file_ = std::fopen(path_.c_str(), "w+b");
  return file_ && std::fwrite(&header, sizeof header, 1, file_) == 1;
}

/// Appended and flushed, so that a kill loses at most the record in hand.
void Checkpoint::keep(const Name& name, std::span<const std::byte> bytes) {
  const std::lock_guard lock(mutex_);
  if (broken_ || records_.contains(name) || std::chrono::steady_clock::now() - start_ < kPatience)
    return;
  const RecordHead head{static_cast<std::uint32_t>(name.stage), name.part, name.index, bytes.size(), checksum64(bytes)};
  const auto head_bytes = bytes_of(head);
  broken_ = (!file_ && !write_header()) || std::fseek(file_, 0, SEEK_END) != 0 ||
            std::fwrite(head_bytes.data(), 1, head_bytes.size(), file_) != head_bytes.size() ||
            std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size() || std::fflush(file_) != 0;
}

/// The bake is done: nothing is left to resume.
void Checkpoint::remove() {
  const std::lock_guard lock(mutex_);
  if (file_)
    std::fclose(file_);
  file_ = nullptr;
  broken_ = true;
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

} // namespace daylit::precompute
