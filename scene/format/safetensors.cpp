#include "scene/format/safetensors.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace daylit::detail {

namespace {

// A compact volume has at most 50 tensors, and up to as many of padding.
constexpr std::size_t kMostTensors = 128, kMostMetadata = 64, kMostDimensions = 8;
constexpr std::uint64_t kAlignment = 64;
const std::string kPaddingPrefix = "_padding_";

/// Takes the header apart while it is parsed, so that nested or endless JSON never becomes a tree in memory.
/// Levels: 1 the header, 2 one tensor or the metadata, 3 a list of numbers.
class HeaderHandler : public nlohmann::json_sax<nlohmann::json> {
public:
  explicit HeaderHandler(SafetensorsHeader& header) : header_(header) {}
  std::string problem;

  bool null() override { return fail("a null"); }
  bool boolean(bool) override { return fail("a boolean"); }
  bool number_integer(number_integer_t) override { return fail("a negative number"); }
  bool number_float(number_float_t, const string_t&) override { return fail("a number that is no size"); }
  bool binary(binary_t&) override { return fail("binary data"); }

  bool number_unsigned(number_unsigned_t value) override {
    if (level_ != 3)
      return fail("a number in the wrong place");
    if (numbers_.size() >= kMostDimensions)
      return fail("too many dimensions");
    numbers_.push_back(value);
    return true;
  }

  bool string(string_t& value) override {
    if (level_ != 2)
      return fail("a string in the wrong place");
    if (in_metadata_) {
      if (header_.metadata.size() >= kMostMetadata || !header_.metadata.try_emplace(key_, std::move(value)).second)
        return fail("too many metadata entries, or one twice");
    } else if (key_ == "dtype") {
      entry_.dtype = std::move(value);
    } else {
      return fail("an unknown tensor property");
    }
    return true;
  }

  bool start_object(std::size_t) override {
    if (++level_ > 2)
      return fail("objects nested too deeply");
    if (level_ == 2) {
      in_metadata_ = key_ == "__metadata__";
      tensor_ = key_;
      entry_ = {};
      has_offsets_ = false;
    }
    return true;
  }

  bool end_object() override {
    if (level_-- != 2 || in_metadata_)
      return true;
    if (!has_offsets_ || entry_.dtype.empty())
      return fail("a tensor without type or place");
    if (header_.tensors.size() >= kMostTensors || !header_.tensors.try_emplace(tensor_, std::move(entry_)).second)
      return fail("too many tensors, or one twice");
    return true;
  }

  bool start_array(std::size_t) override {
    if (level_ != 2 || in_metadata_)
      return fail("a list in the wrong place");
    ++level_;
    numbers_.clear();
    return true;
  }

  bool end_array() override {
    --level_;
    if (key_ == "shape") {
      entry_.shape = numbers_;
    } else if (key_ == "data_offsets" && numbers_.size() == 2) {
      entry_.begin = numbers_[0];
      entry_.end = numbers_[1];
      has_offsets_ = true;
    } else {
      return fail("an unknown tensor property");
    }
    return true;
  }

  bool key(string_t& value) override {
    key_ = std::move(value);
    return true;
  }

  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override {
    return fail("text that is not JSON");
  }

private:
  bool fail(const char* what) {
    if (problem.empty())
      problem = what;
    return false;
  }

  SafetensorsHeader& header_;
  std::string key_, tensor_;
  TensorEntry entry_;
  std::vector<std::uint64_t> numbers_;
  int level_ = 0;
  bool in_metadata_ = false, has_offsets_ = false;
};

/// Sizes follow from type and shape, and the tensors cover [0, data_bytes) in a row.
bool covers_data(const SafetensorsHeader& header, std::uint64_t data_bytes) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges;
  for (const auto& [_, t] : header.tensors) {
    std::uint64_t bytes = dtype_bytes(t.dtype);
    if (bytes == 0 || t.begin > t.end || t.end > data_bytes)
      return false;
    for (const std::uint64_t d : t.shape) {
      if (d != 0 && bytes > std::numeric_limits<std::uint64_t>::max() / d)
        return false;
      bytes *= d;
    }
    if (bytes != t.end - t.begin)
      return false;
    ranges.push_back({t.begin, t.end});
  }
  std::sort(ranges.begin(), ranges.end());
  std::uint64_t reached = 0;
  for (const auto& [begin, end] : ranges) {
    if (begin != reached)
      return false;
    reached = end;
  }
  return reached == data_bytes;
}

} // namespace

std::uint64_t dtype_bytes(const std::string& dtype) {
  if (dtype == "F64")
    return 8;
  if (dtype == "F32" || dtype == "I32" || dtype == "U32")
    return 4;
  return dtype == "F16" || dtype == "I16" || dtype == "U16" ? 2 : dtype == "U8" || dtype == "I8" ? 1 : 0;
}

Result<SafetensorsHeader> parse_safetensors(std::span<const std::uint8_t> file, const std::string& name) {
  const auto malformed = [&name](std::string what) {
    return Error{ErrorCode::file_malformed, std::move(what), name, "the file is cut off, damaged, or no volume"};
  };
  std::uint64_t length = 0;
  if (file.size() < sizeof(length))
    return malformed("too short for a safetensors file");
  std::memcpy(&length, file.data(), sizeof(length));
  if (length > file.size() - sizeof(length))
    return malformed("the header is longer than the file");
  SafetensorsHeader header;
  header.data_offset = sizeof(length) + length;
  HeaderHandler handler(header);
  const std::uint8_t* text = file.data() + sizeof(length);
  if (!nlohmann::json::sax_parse(text, text + length, &handler) || !handler.problem.empty())
    return malformed("the header holds " + handler.problem);
  if (!covers_data(header, file.size() - header.data_offset))
    return malformed("the tensors do not match the size of the file");
  return header;
}

SafetensorsImage layout_safetensors(std::span<const TensorToWrite> tensors,
                                    const std::map<std::string, std::string>& metadata) {
  static constexpr std::array<std::byte, kAlignment> kZeros{};
  nlohmann::ordered_json header;
  header["__metadata__"] = metadata;
  SafetensorsImage image;
  std::uint64_t offset = 0;
  const auto place = [&](const std::string& name, const std::string& dtype, const std::vector<std::uint64_t>& shape,
                         std::span<const std::byte> bytes) {
    header[name] = {{"dtype", dtype}, {"shape", shape}, {"data_offsets", {offset, offset + bytes.size()}}};
    offset += bytes.size();
    image.parts.push_back(bytes);
  };
  for (std::size_t i = 0; i < tensors.size(); ++i) {
    place(tensors[i].name, tensors[i].dtype, tensors[i].shape, tensors[i].bytes);
    const std::uint64_t padding = (kAlignment - offset % kAlignment) % kAlignment;
    if (padding > 0)
      place(fmt::format("{}{}", kPaddingPrefix, i), "U8", {padding}, std::span(kZeros).first(padding));
  }
  std::string text = header.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  text.append((kAlignment - (text.size() + sizeof(std::uint64_t)) % kAlignment) % kAlignment, ' ');
  const std::uint64_t length = text.size();
  image.header.assign(reinterpret_cast<const char*>(&length), sizeof(length));
  image.header += text;
  return image;
}

} // namespace daylit::detail
