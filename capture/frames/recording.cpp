#include "capture/frames/recording.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <span>
#include <string_view>
#include <thread>

#include <nlohmann/json.hpp>

#include "scene/core/atomic_file.h"
#include "scene/core/checksum.h"
#include "scene/core/read_file.h"

namespace daylit {

namespace {

constexpr const char* kIndex = "frames.jsonl";
constexpr int kLargestSide = 32768;
constexpr std::size_t kMostIndexBytes = std::size_t{1} << 30, kMostFrameBytes = std::size_t{1} << 30;

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

/// PNM holds samples of two bytes high byte first.
std::vector<std::uint8_t> swapped(std::vector<std::uint8_t> bytes, const PixelFormat& format) {
  if (format.bytes_per_sample() == 2)
    for (std::size_t i = 0; i + 1 < bytes.size(); i += 2)
      std::swap(bytes[i], bytes[i + 1]);
  return bytes;
}

std::string header_of(const CameraFrame& frame) {
  return (frame.format.mosaic == Mosaic::rgb ? "P6\n" : "P5\n") + std::to_string(frame.width_px) + " " +
         std::to_string(frame.height_px) + "\n" + std::to_string((1 << frame.format.bits) - 1) + "\n";
}

std::string checksum_of(const std::vector<std::uint8_t>& bytes) {
  Checksum sum;
  sum.add(bytes);
  return sum.hex();
}

Error malformed(const std::string& what, const std::string& where) {
  return {ErrorCode::file_malformed, what, where, "record the sequence again"};
}

/// The header that header_of() writes; what follows it are the samples.
Result<CameraFrame> parse_picture(const std::vector<std::uint8_t>& file, Mosaic mosaic, const std::string& name) {
  CameraFrame frame;
  int largest = 0;
  const std::string_view text(reinterpret_cast<const char*>(file.data()), std::min<std::size_t>(file.size(), 64));
  if (!text.starts_with(mosaic == Mosaic::rgb ? "P6\n" : "P5\n"))
    return malformed("not a binary PGM or PPM picture of this kind", name);
  const char *at = text.data() + 3, *end = text.data() + text.size();
  for (int* number : {&frame.width_px, &frame.height_px, &largest}) {
    const auto [next, error] = std::from_chars(at, end, *number);
    if (error != std::errc() || next == end || *number < 1)
      return malformed("damaged picture header", name);
    at = next + 1;
  }
  frame.format = {mosaic, 0};
  for (int bits = 8; bits <= 16; ++bits)
    if (largest == (1 << bits) - 1)
      frame.format.bits = bits;
  if (frame.format.bits == 0 || frame.width_px > kLargestSide || frame.height_px > kLargestSide)
    return malformed("picture of an impossible size or depth", name);
  const auto begin = file.begin() + (at - text.data());
  if (static_cast<std::size_t>(file.end() - begin) != frame_bytes(frame.width_px, frame.height_px, frame.format))
    return malformed("the picture is cut off or too long", name);
  frame.bytes = swapped({begin, file.end()}, frame.format);
  return frame;
}

} // namespace

Result<RecordingWriter> RecordingWriter::create(const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed)
    return Error{ErrorCode::io, "cannot be made: " + failed.message(), folder.string(), "choose another folder"};
  if (std::filesystem::exists(folder / kIndex))
    return Error{ErrorCode::io, "holds a recording already", folder.string(), "choose another folder"};
  return RecordingWriter(folder);
}

Result<void> RecordingWriter::add(const CameraFrame& frame) {
  char name[32];
  std::snprintf(name, sizeof(name), "%08llu.%s", static_cast<unsigned long long>(count_),
                frame.format.mosaic == Mosaic::rgb ? "ppm" : "pgm");
  const std::string header = header_of(frame);
  const std::vector<std::uint8_t> samples = swapped(frame.bytes, frame.format);
  const std::span<const std::byte> parts[] = {bytes_of(header), std::as_bytes(std::span(samples))};
  if (const auto written = write_file_atomically(folder_ / name, parts); !written)
    return written;
  const nlohmann::ordered_json line{{"file", name},
                                    {"id", frame.id},
                                    {"time_ns", frame.time_ns},
                                    {"exposure_us", frame.exposure_us},
                                    {"mosaic", name_of(frame.format.mosaic)},
                                    {"xxh64", checksum_of(frame.bytes)}};
  const std::string text = line.dump() + "\n", path = (folder_ / kIndex).string();
  std::FILE* index = std::fopen(path.c_str(), "ab");
  const bool whole = index && std::fwrite(text.data(), 1, text.size(), index) == text.size();
  if ((index && std::fclose(index) != 0) || !whole)
    return Error{ErrorCode::io, "cannot be written", path, "free space on the disk"};
  ++count_;
  return {};
}

Result<Recording::Entry> Recording::parse_entry(const std::string& line) {
  try {
    const auto json = nlohmann::json::parse(line);
    Entry e{json.at("file").get<std::string>(),
            json.at("id").get<std::uint64_t>(),
            json.at("time_ns").get<std::int64_t>(),
            json.at("exposure_us").get<double>(),
            Mosaic::mono,
            json.at("xxh64").get<std::string>()};
    const auto mosaic = mosaic_named(json.at("mosaic").get<std::string>());
    if (!mosaic)
      return mosaic.error();
    e.mosaic = *mosaic;
    if (e.file.empty() || e.file.find('/') != std::string::npos || e.file.front() == '.')
      return malformed("\"file\" names no file of the folder", "");
    return e;
  } catch (const nlohmann::json::exception& error) {
    return malformed(error.what(), "");
  }
}

Result<Recording> Recording::open(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / kIndex;
  const auto bytes = read_whole_file(path, kMostIndexBytes);
  if (!bytes)
    return bytes.error();
  std::vector<Entry> entries;
  // A last line without its end was cut off while it was written: its frame does not count.
  for (auto begin = bytes->begin(), end = begin; (end = std::find(begin, bytes->end(), '\n')) != bytes->end();
       begin = end + 1) {
    auto entry = parse_entry(std::string(begin, end));
    if (!entry) {
      Error error = entry.error();
      error.where = path.string() + ", line " + std::to_string(entries.size() + 1);
      return error;
    }
    entries.push_back(std::move(*entry));
  }
  if (entries.empty())
    return malformed("there is no frame in the recording", path.string());
  return Recording(folder, std::move(entries));
}

Result<CameraFrame> Recording::read(std::size_t k) const {
  const Entry& entry = entries_[k];
  const std::filesystem::path path = folder_ / entry.file;
  const auto file = read_whole_file(path, kMostFrameBytes);
  if (!file)
    return file.error();
  auto frame = parse_picture(*file, entry.mosaic, path.string());
  if (!frame)
    return frame;
  if (checksum_of(frame->bytes) != entry.checksum)
    return malformed("not the frame that was recorded (checksum)", path.string());
  frame->id = entry.id;
  frame->time_ns = entry.time_ns;
  frame->exposure_us = entry.exposure_us;
  return frame;
}

namespace {

class Replay final : public FrameSource {
public:
  Replay(Recording recording, ReplayTiming timing) : recording_(std::move(recording)), timing_(timing) {}

  Result<std::optional<CameraFrame>> next(std::chrono::milliseconds wait) override {
    if (finished())
      return std::optional<CameraFrame>();
    if (timing_ == ReplayTiming::original && !wait_for_due_frame(wait))
      return std::optional<CameraFrame>();
    auto frame = recording_.read(next_++);
    if (!frame)
      return frame.error();
    ++report_.whole;
    return std::optional<CameraFrame>(std::move(*frame));
  }
  bool finished() const override { return next_ >= recording_.size(); }
  SourceReport report() const override {
    SourceReport report = report_;
    report.connected = !finished();
    report.connections = 1;
    return report;
  }

private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point due(std::size_t k) const {
    return start_ + std::chrono::nanoseconds(recording_.time_ns(k) - recording_.time_ns(0));
  }
  /// Moves on to the newest frame that is due. False: none is within the time.
  bool wait_for_due_frame(std::chrono::milliseconds wait) {
    if (next_ == 0 && start_ == Clock::time_point())
      start_ = Clock::now();
    std::this_thread::sleep_until(std::min(due(next_), Clock::now() + wait));
    const auto now = Clock::now();
    if (due(next_) > now)
      return false;
    for (; next_ + 1 < recording_.size() && due(next_ + 1) <= now; ++next_)
      ++report_.whole, ++report_.superseded;
    return true;
  }

  Recording recording_;
  ReplayTiming timing_;
  Clock::time_point start_{};
  std::size_t next_ = 0;
  SourceReport report_;
};

} // namespace

std::unique_ptr<FrameSource> replay(Recording recording, ReplayTiming timing) {
  return std::make_unique<Replay>(std::move(recording), timing);
}

} // namespace daylit
