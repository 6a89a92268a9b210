#include "scene/image/image_codecs.h"

#include <cstring>
#include <exception>
#include <limits>
#include <mutex>

#include <Iex.h>
#include <ImfChannelList.h>
#include <ImfCompression.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <ImfTileDescription.h>
#include <ImfVersion.h>

namespace daylit::detail {

namespace {

constexpr std::size_t kMaxChannels = 256; ///< the library buffers whole scan-line blocks of all channels

class MemoryInput : public Imf::IStream {
public:
  MemoryInput(Bytes bytes, const std::string& name) : Imf::IStream(name.c_str()), bytes_(bytes) {}
  bool read(char c[], int n) override {
    if (n < 0 || static_cast<std::size_t>(n) > bytes_.size() - position_)
      throw Iex::InputExc("the file ends too early");
    std::memcpy(c, bytes_.data() + position_, static_cast<std::size_t>(n));
    position_ += static_cast<std::size_t>(n);
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override {
    if (position > bytes_.size())
      throw Iex::InputExc("an offset points behind the end of the file");
    position_ = position;
  }
  void clear() override {}

private:
  Bytes bytes_;
  std::size_t position_ = 0;
};

class MemoryOutput : public Imf::OStream {
public:
  MemoryOutput() : Imf::OStream("memory") {}
  void write(const char c[], int n) override {
    const std::size_t end = position_ + static_cast<std::size_t>(n);
    if (bytes.size() < end)
      bytes.resize(end);
    std::memcpy(bytes.data() + position_, c, static_cast<std::size_t>(n));
    position_ = end;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  std::vector<std::uint8_t> bytes;

private:
  std::size_t position_ = 0;
};

std::uint32_t little_endian_32(const std::uint8_t* p) {
  return std::uint32_t{p[0]} | std::uint32_t{p[1]} << 8 | std::uint32_t{p[2]} << 16 | std::uint32_t{p[3]} << 24;
}

/// Reads a header without the library. What it refuses, the library would answer by allocating sizes from the file
/// unchecked, or by running out of step with the attribute sizes (its fixed-size types ignore them).
class HeaderWalk {
public:
  explicit HeaderWalk(Bytes bytes) : bytes_(bytes) {}

  /// True when every attribute (name, type, size, value) of the single-part header has the size that its type says.
  bool consistent() {
    position_ = 8;
    std::string name, type;
    while (position_ < bytes_.size() && bytes_[position_] != 0) {
      std::uint32_t size = 0;
      if (!text(name) || !text(type) || !word(size) || size > bytes_.size() - position_)
        return false;
      if (!value_fits(type, bytes_.subspan(position_, size)))
        return false;
      position_ += size;
    }
    return position_ < bytes_.size();
  }

private:
  bool text(std::string& out) {
    const std::size_t begin = position_;
    while (position_ < bytes_.size() && position_ - begin < 256)
      if (bytes_[position_++] == 0) {
        out.assign(bytes_.begin() + static_cast<std::ptrdiff_t>(begin),
                   bytes_.begin() + static_cast<std::ptrdiff_t>(position_ - 1));
        return true;
      }
    return false;
  }

  bool word(std::uint32_t& out) {
    if (bytes_.size() - position_ < 4)
      return false;
    out = little_endian_32(&bytes_[position_]);
    position_ += 4;
    return true;
  }

  static bool value_fits(const std::string& type, Bytes value) {
    static const std::pair<const char*, std::size_t> kFixed[] = {{"box2f", 16},
                                                                 {"box2i", 16},
                                                                 {"chromaticities", 32},
                                                                 {"compression", 1},
                                                                 {"deepImageState", 1},
                                                                 {"double", 8},
                                                                 {"envmap", 1},
                                                                 {"float", 4},
                                                                 {"int", 4},
                                                                 {"keycode", 28},
                                                                 {"m33d", 72},
                                                                 {"m33f", 36},
                                                                 {"m44d", 128},
                                                                 {"m44f", 64},
                                                                 {"lineOrder", 1},
                                                                 {"rational", 8},
                                                                 {"tiledesc", 9},
                                                                 {"timecode", 8},
                                                                 {"v2d", 16},
                                                                 {"v2f", 8},
                                                                 {"v2i", 8},
                                                                 {"v3d", 24},
                                                                 {"v3f", 12},
                                                                 {"v3i", 12}};
    for (const auto& [known, size] : kFixed)
      if (type == known)
        return value.size() == size;
    if (type == "chlist")
      return channels_fit(value);
    if (type == "preview")
      return value.size() >= 8 &&
             std::uint64_t{little_endian_32(&value[0])} * little_endian_32(&value[4]) == (value.size() - 8) / 4;
    if (type == "stringvector")
      return strings_fit(value);
    return type != "idmanifest"; // deep data only; it unpacks to a size of its own choice
  }

  /// (name, 16 bytes) entries and an empty name that ends exactly here.
  static bool channels_fit(Bytes value) {
    std::size_t position = 0;
    while (position < value.size() && value[position] != 0) {
      while (position < value.size() && value[position] != 0)
        ++position;
      position += 17;
    }
    return position + 1 == value.size();
  }

  static bool strings_fit(Bytes value) {
    std::size_t position = 0;
    while (position < value.size()) {
      if (value.size() - position < 4)
        return false;
      const std::uint32_t length = little_endian_32(&value[position]);
      position += 4;
      if (length > value.size() - position)
        return false;
      position += length;
    }
    return true;
  }

  Bytes bytes_;
  std::size_t position_ = 0;
};

/// Chunks (tiles, or scan lines at worst one by one) that the offset table must list, 8 bytes each.
std::size_t minimum_chunks(const Imf::Header& header, std::size_t width, std::size_t height) {
  if (!header.hasTileDescription())
    return height / 256;
  const Imf::TileDescription& tile = header.tileDescription();
  if (tile.xSize == 0 || tile.ySize == 0)
    return std::numeric_limits<std::size_t>::max();
  return ((width + tile.xSize - 1) / tile.xSize) * ((height + tile.ySize - 1) / tile.ySize);
}

std::optional<Error> check_header(const Imf::Header& header, std::size_t file_bytes, const std::string& name) {
  const Imath::Box2i data = header.dataWindow();
  const long long width = 1ll + data.max.x - data.min.x, height = 1ll + data.max.y - data.min.y;
  std::size_t bytes_per_texel = 0, channels = 0;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c, ++channels)
    bytes_per_texel += c.channel().type == Imf::HALF ? 2 : 4;
  if (channels > kMaxChannels)
    return Error{ErrorCode::limit_exceeded, "more than 256 channels", name, "export the image with RGB channels only"};
  const bool lossy_dct = header.compression() == Imf::DWAA_COMPRESSION || header.compression() == Imf::DWAB_COMPRESSION;
  if (auto error = check_image_size(width, height, lossy_dct ? 1 : bytes_per_texel, file_bytes, name))
    return error;
  const Imath::Box2i display = header.displayWindow();
  if (data.min != display.min || data.max != display.max)
    return Error{ErrorCode::file_malformed, "the data window differs from the display window (a cropped image)", name,
                 "save the image uncropped: what was cut off cannot be guessed"};
  if (minimum_chunks(header, static_cast<std::size_t>(width), static_cast<std::size_t>(height)) > file_bytes / 8)
    return damaged_file(name, "the header claims more tiles than the file can hold");
  return std::nullopt;
}

std::string channel_names(const Imf::ChannelList& channels) {
  std::string text;
  int listed = 0;
  for (auto c = channels.begin(); c != channels.end() && listed < 12; ++c, ++listed)
    text += (text.empty() ? "" : ", ") + std::string(c.name());
  return text.empty() ? "none" : text;
}

bool is_full(const Imf::ChannelList& channels, const char* name) {
  const Imf::Channel* c = channels.findChannel(name);
  return c && c->xSampling == 1 && c->ySampling == 1;
}

/// "Z" as the format calls depth, else what grey pictures are saved as, else the only channel. Empty when there is
/// none.
std::vector<std::string> depth_channel(const Imf::ChannelList& channels) {
  for (const char* name : {"Z", "Y", "R"})
    if (is_full(channels, name))
      return {name};
  std::vector<std::string> names;
  for (auto c = channels.begin(); c != channels.end(); ++c)
    names.emplace_back(c.name());
  return names.size() == 1 && is_full(channels, names[0].c_str()) ? names : std::vector<std::string>{};
}

/// The file's channels for red, green and blue: "R", "G", "B", or "Y" three times. Empty when there are none.
std::vector<std::string> colour_channels(const Imf::ChannelList& channels) {
  const auto full = [&](const char* name) { return is_full(channels, name); };
  if (full("R") && full("G") && full("B"))
    return {"R", "G", "B"};
  if (full("Y") && !channels.findChannel("RY") && !channels.findChannel("BY"))
    return {"Y"};
  return {};
}

void read_channels(Imf::InputFile& file, const std::vector<std::string>& names, RgbImage& image) {
  const Imath::Box2i window = file.header().dataWindow();
  Imf::FrameBuffer buffer;
  for (std::size_t c = 0; c < names.size(); ++c)
    buffer.insert(names[c], Imf::Slice::Make(Imf::FLOAT, &image.texels[0][static_cast<int>(c)], window.min, image.width,
                                             image.height, sizeof(Rgb), sizeof(Rgb) * image.width));
  file.setFrameBuffer(buffer);
  file.readPixels(window.min.y, window.max.y);
  if (names.size() == 1)
    for (Rgb& texel : image.texels)
      texel = Rgb(texel.r);
}

/// What to read of a file, or why it cannot be.
Result<std::vector<std::string>> channels_to_read(const Imf::ChannelList& channels, const std::string& name,
                                                  ExrUse use) {
  std::vector<std::string> names = use == ExrUse::depth ? depth_channel(channels) : colour_channels(channels);
  if (!names.empty())
    return names;
  const std::string found = " (found: " + channel_names(channels) + ")";
  return use == ExrUse::depth
             ? Error{ErrorCode::file_malformed, "no channel Z, Y or R" + found, name, "export depth as one channel Z"}
             : Error{ErrorCode::file_malformed, "no channels R, G, B and no channel Y" + found, name,
                     "export the image with plain RGB channels"};
}

Result<HdrFile> decode_exr_or_throw(Bytes bytes, const std::string& name, ExrUse use) {
  MemoryInput header_stream(bytes, name);
  int version = 0;
  header_stream.seekg(4);
  version = static_cast<int>(little_endian_32(&bytes[4]));
  header_stream.seekg(8);
  Imf::Header header;
  header.readFrom(header_stream, version);
  if (auto error = check_header(header, bytes.size(), name))
    return *error;
  const auto names = channels_to_read(header.channels(), name, use);
  if (!names)
    return names.error();
  MemoryInput stream(bytes, name);
  Imf::InputFile file(stream, 0);
  if (!file.isComplete())
    return damaged_file(name, "the file is incomplete");
  const Imath::Box2i window = header.dataWindow();
  HdrFile out;
  out.radiance = RgbImage(window.max.x - window.min.x + 1, window.max.y - window.min.y + 1);
  read_channels(file, *names, out.radiance);
  for (auto a = header.begin(); a != header.end(); ++a)
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute()))
      out.attributes[a.name()] = text->value();
  return out;
}

/// Tile sizes bound what the library allocates; set once for the process.
void bound_library_allocations() {
  static std::once_flag once;
  std::call_once(once, [] {
    Imf::Header::setMaxImageSize(kMaxImageSide, kMaxImageSide);
    Imf::Header::setMaxTileSize(4096, 4096);
  });
}

} // namespace

bool is_exr(Bytes bytes) { return bytes.size() >= 4 && little_endian_32(bytes.data()) == 20000630u; }

Result<HdrFile> decode_exr(Bytes bytes, const std::string& name, ExrUse use) {
  if (bytes.size() < 9)
    return damaged_file(name, "the file ends inside the EXR header");
  const std::uint32_t flags = little_endian_32(&bytes[4]);
  if ((flags & 0xffu) != 2u)
    return Error{ErrorCode::file_version, "EXR file version " + std::to_string(flags & 0xffu) + " (2 is read)", name,
                 "export the image again"};
  if (flags & 0x1800u)
    return Error{ErrorCode::file_malformed, "a deep or multi-part EXR file", name,
                 "export a flat single-part image with channels R, G, B"};
  if (!HeaderWalk(bytes).consistent())
    return damaged_file(name, "the EXR header is damaged");
  bound_library_allocations();
  try {
    return decode_exr_or_throw(bytes, name, use);
  } catch (const std::exception& error) {
    return damaged_file(name, std::string("cannot read the EXR file (") + error.what() + ")");
  }
}

Result<std::vector<std::uint8_t>> encode_exr(const RgbImage& image,
                                             const std::map<std::string, std::string>& attributes) {
  if (image.empty())
    return Error{ErrorCode::value_invalid, "an empty image cannot be written", "", ""};
  try {
    Imf::Header header(image.width, image.height);
    header.compression() = Imf::ZIP_COMPRESSION;
    for (const auto& [key, value] : attributes)
      header.insert(key, Imf::StringAttribute(value));
    const char* const names[3] = {"R", "G", "B"};
    Imf::FrameBuffer buffer;
    for (int c = 0; c < 3; ++c) {
      header.channels().insert(names[c], Imf::Channel(Imf::FLOAT));
      // The frame buffer is only read from here; its interface has no const form.
      char* base = const_cast<char*>(reinterpret_cast<const char*>(&image.texels[0][c]));
      buffer.insert(names[c], Imf::Slice(Imf::FLOAT, base, sizeof(Rgb), sizeof(Rgb) * image.width));
    }
    MemoryOutput stream;
    {
      Imf::OutputFile file(stream, header, 0);
      file.setFrameBuffer(buffer);
      file.writePixels(image.height);
    }
    return std::move(stream.bytes);
  } catch (const std::exception& error) {
    return Error{ErrorCode::io, std::string("cannot encode the EXR file (") + error.what() + ")", "", ""};
  }
}

} // namespace daylit::detail
