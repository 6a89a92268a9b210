#pragma once

// A sequence of frames on disk, bit for bit. A folder with one file per frame in a format that every viewer opens
// (binary PGM, or PPM for RGB; samples of more than 8 bits high byte first; a mosaic is stored as it is), and
// frames.jsonl: one line per frame in the order of arrival with "file", "id", "time_ns", "exposure_us", "mosaic" and
// "xxh64", the checksum of the samples. A frame counts once its line is there: a recording that was cut off is whole up
// to its last line.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "capture/frames/frame_source.h"

namespace daylit {

class RecordingWriter {
public:
  /// Makes the folder. Error io: it cannot be made, or holds a recording already.
  static Result<RecordingWriter> create(const std::filesystem::path& folder);
  /// Error io: the disk is full, say; frames written so far stay.
  Result<void> add(const CameraFrame& frame);
  std::uint64_t frames() const { return count_; }

private:
  explicit RecordingWriter(std::filesystem::path folder) : folder_(std::move(folder)) {}
  std::filesystem::path folder_;
  std::uint64_t count_ = 0;
};

class Recording {
public:
  /// Reads frames.jsonl. Errors: it is missing or malformed (with its line).
  static Result<Recording> open(const std::filesystem::path& folder);
  std::size_t size() const { return entries_.size(); }
  std::int64_t time_ns(std::size_t k) const { return entries_[k].time_ns; }
  double exposure_us(std::size_t k) const { return entries_[k].exposure_us; }
  /// Errors: the file is missing, is no such picture, or not the one that was recorded (checksum).
  Result<CameraFrame> read(std::size_t k) const;

private:
  struct Entry {
    std::string file;
    std::uint64_t id = 0;
    std::int64_t time_ns = 0;
    double exposure_us = 0.0;
    Mosaic mosaic = Mosaic::mono;
    std::string checksum;
  };
  Recording(std::filesystem::path folder, std::vector<Entry> entries)
      : folder_(std::move(folder)), entries_(std::move(entries)) {}
  static Result<Entry> parse_entry(const std::string& line);

  std::filesystem::path folder_;
  std::vector<Entry> entries_;
};

enum class ReplayTiming {
  original, ///< a frame comes as long after the first as it did when it was recorded
  fast,     ///< each frame as soon as it is asked for; none is superseded
};

/// Replays a recording that has at least one frame.
std::unique_ptr<FrameSource> replay(Recording recording, ReplayTiming timing);

} // namespace daylit
