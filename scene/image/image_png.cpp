#include "scene/image/image_codecs.h"

#include <bit>
#include <csetjmp>
#include <cstring>

#include <png.h>

// libpng reports errors by longjmp. Functions that call setjmp hold no object with a destructor: everything that owns
// memory lives in the caller.

namespace daylit::detail {

namespace {

struct PngState {
  Bytes bytes;
  std::size_t position = 0;
  char message[160] = {};
  int width = 0, height = 0;
  int bits = 0; ///< of the file, per channel; read_grey16_header() says it and whether the file is grey
  bool is_grey = false;
};

void on_error(png_structp png, png_const_charp message) {
  auto* state = static_cast<PngState*>(png_get_error_ptr(png));
  std::strncpy(state->message, message, sizeof(state->message) - 1);
  std::longjmp(png_jmpbuf(png), 1);
}
void on_warning(png_structp, png_const_charp) {}

void on_read(png_structp png, png_bytep out, std::size_t size) {
  auto* input = static_cast<PngState*>(png_get_io_ptr(png));
  if (size > input->bytes.size() - input->position)
    png_error(png, "the file ends too early");
  std::memcpy(out, input->bytes.data() + input->position, size);
  input->position += size;
}

/// Reads up to the first pixel; reports errors by longjmp.
void start_reading(png_structp png, png_infop info, PngState& input) {
  png_set_read_fn(png, &input, on_read);
  png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX); // what is above ours has an error of its own
  png_set_chunk_malloc_max(png, 64u << 20);
  png_set_chunk_cache_max(png, 256);
  png_read_info(png, info);
  input.width = static_cast<int>(png_get_image_width(png, info));
  input.height = static_cast<int>(png_get_image_height(png, info));
  if (input.width > kMaxImageSide || input.height > kMaxImageSide)
    png_error(png, "the picture is too large");
}

/// Asks for 8-bit RGB without any change of the transfer function.
bool read_header(png_structp png, png_infop info, PngState& input) {
  if (setjmp(png_jmpbuf(png)))
    return false;
  start_reading(png, info, input);
  png_set_expand(png);
  png_set_scale_16(png);
  png_set_gray_to_rgb(png);
  png_set_strip_alpha(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  return true;
}

/// Asks for the numbers of a grey picture of 16 bits as this machine has them.
bool read_grey16_header(png_structp png, png_infop info, PngState& input) {
  if (setjmp(png_jmpbuf(png)))
    return false;
  start_reading(png, info, input);
  input.bits = png_get_bit_depth(png, info);
  input.is_grey = png_get_color_type(png, info) == PNG_COLOR_TYPE_GRAY;
  if (std::endian::native == std::endian::little)
    png_set_swap(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  return true;
}

bool read_rows(png_structp png, png_bytepp rows) {
  if (setjmp(png_jmpbuf(png)))
    return false;
  png_read_image(png, rows);
  png_read_end(png, nullptr);
  return true;
}

struct PngReader {
  explicit PngReader(PngState& input)
      : png(png_create_read_struct(PNG_LIBPNG_VER_STRING, &input, on_error, on_warning)),
        info(png ? png_create_info_struct(png) : nullptr) {}
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
  png_structp png;
  png_infop info;
};

struct PngWriter {
  explicit PngWriter(PngState& state)
      : png(png_create_write_struct(PNG_LIBPNG_VER_STRING, &state, on_error, on_warning)),
        info(png ? png_create_info_struct(png) : nullptr) {}
  ~PngWriter() { png_destroy_write_struct(&png, &info); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
  png_structp png;
  png_infop info;
};

void on_write(png_structp png, png_bytep data, std::size_t size) {
  auto* out = static_cast<std::vector<std::uint8_t>*>(png_get_io_ptr(png));
  out->insert(out->end(), data, data + size);
}
void on_flush(png_structp) {}

struct PngKind {
  int width = 0, height = 0, bits = 8, colour_type = PNG_COLOR_TYPE_RGB;
};

bool write_rows(PngWriter& writer, std::vector<std::uint8_t>* out, const PngKind& kind, png_bytepp rows) {
  if (setjmp(png_jmpbuf(writer.png)))
    return false;
  png_set_write_fn(writer.png, out, on_write, on_flush);
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(kind.width), static_cast<png_uint_32>(kind.height),
               kind.bits, kind.colour_type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(writer.png, 4);
  png_write_info(writer.png, writer.info);
  if (kind.bits == 16 && std::endian::native == std::endian::little)
    png_set_swap(writer.png);
  png_write_image(writer.png, rows);
  png_write_end(writer.png, nullptr);
  return true;
}

std::vector<png_bytep> row_pointers(std::uint8_t* first, std::size_t row_bytes, int height) {
  std::vector<png_bytep> rows(static_cast<std::size_t>(height));
  for (std::size_t y = 0; y < rows.size(); ++y)
    rows[y] = first + y * row_bytes;
  return rows;
}

std::size_t rgb_row_bytes(const Rgb8Image& image) { return 3 * static_cast<std::size_t>(image.width); }

/// Why the header could not be read: the size that it gives, where that was read and is above the limit.
Error header_error(const PngState& input, const std::string& name) {
  if (input.width > 0 && input.height > 0)
    if (auto error = check_image_size(input.width, input.height, 1, input.bytes.size(), name))
      return *error;
  return damaged_file(name, std::string("cannot read the PNG file (") + input.message + ")");
}

} // namespace

bool is_png(Bytes bytes) { return bytes.size() >= 8 && png_sig_cmp(bytes.data(), 0, 8) == 0; }

Result<Rgb8Image> decode_png(Bytes bytes, const std::string& name) {
  PngState input{bytes};
  PngReader reader(input);
  if (!reader.info)
    return Error{ErrorCode::limit_exceeded, "not enough memory for the PNG reader", name, ""};
  if (!read_header(reader.png, reader.info, input))
    return header_error(input, name);
  if (auto error = check_image_size(input.width, input.height, 1, bytes.size(), name))
    return *error;
  if (png_get_rowbytes(reader.png, reader.info) != 3 * static_cast<std::size_t>(input.width))
    return damaged_file(name, "unexpected PNG pixel layout");
  Rgb8Image image{input.width, input.height, {}};
  image.bytes.resize(3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  std::vector<png_bytep> rows = row_pointers(image.bytes.data(), rgb_row_bytes(image), image.height);
  if (!read_rows(reader.png, rows.data()))
    return damaged_file(name, std::string("cannot read the PNG file (") + input.message + ")");
  return image;
}

Result<Grey16Image> decode_png_grey16(Bytes bytes, const std::string& name) {
  PngState input{bytes};
  PngReader reader(input);
  if (!reader.info)
    return Error{ErrorCode::limit_exceeded, "not enough memory for the PNG reader", name, ""};
  if (!read_grey16_header(reader.png, reader.info, input))
    return header_error(input, name);
  if (!input.is_grey || input.bits != 16)
    return Error{ErrorCode::file_malformed,
                 std::string(input.is_grey ? "a grey" : "a colour") + " PNG of " + std::to_string(input.bits) +
                     " bits where one of 16 bits, grey, is needed",
                 name, "save the numbers themselves, not a picture of them to look at"};
  if (auto error = check_image_size(input.width, input.height, 2, bytes.size(), name))
    return *error;
  Grey16Image image{input.width, input.height, {}};
  image.values.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  std::vector<png_bytep> rows = row_pointers(reinterpret_cast<std::uint8_t*>(image.values.data()),
                                             2 * static_cast<std::size_t>(image.width), image.height);
  if (!read_rows(reader.png, rows.data()))
    return damaged_file(name, std::string("cannot read the PNG file (") + input.message + ")");
  return image;
}

Result<std::vector<std::uint8_t>> encode_png_grey16(const Grey16Image& image, const std::string& name) {
  PngState state{};
  PngWriter writer(state);
  std::vector<std::uint8_t> out;
  auto* const first = reinterpret_cast<std::uint8_t*>(const_cast<std::uint16_t*>(image.values.data())); // as above
  std::vector<png_bytep> rows = row_pointers(first, 2 * static_cast<std::size_t>(image.width), image.height);
  if (!writer.info || !write_rows(writer, &out, {image.width, image.height, 16, PNG_COLOR_TYPE_GRAY}, rows.data()))
    return Error{ErrorCode::io, std::string("cannot encode the PNG file (") + state.message + ")", name, ""};
  return out;
}

Result<std::vector<std::uint8_t>> encode_png(const Rgb8Image& image, const std::string& name) {
  const std::size_t expected = 3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  if (image.width <= 0 || image.height <= 0 || image.bytes.size() != expected)
    return Error{ErrorCode::value_invalid, "an empty image cannot be written", name, ""};
  PngState state{};
  PngWriter writer(state);
  std::vector<std::uint8_t> out;
  // libpng's row pointers are not const, but writing does not change the rows.
  std::vector<png_bytep> rows =
      row_pointers(const_cast<std::uint8_t*>(image.bytes.data()), rgb_row_bytes(image), image.height);
  if (!writer.info || !write_rows(writer, &out, {image.width, image.height}, rows.data()))
    return Error{ErrorCode::io, std::string("cannot encode the PNG file (") + state.message + ")", name, ""};
  return out;
}

} // namespace daylit::detail
