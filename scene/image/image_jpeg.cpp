#include "scene/image/image_codecs.h"

#include <csetjmp>
#include <cstdlib>
#include <cstring>
#include <memory>

#include <jerror.h>
#include <jpeglib.h>

// libjpeg reports errors by longjmp. Functions that call setjmp hold no object with a destructor.

namespace daylit::detail {

namespace {

constexpr int kMaxScans = 256; ///< a progressive file may repeat scans without end

struct JpegState {
  jpeg_decompress_struct decoder{};
  jpeg_error_mgr errors{};
  jpeg_progress_mgr progress{};
  std::jmp_buf jump{};
  char message[JMSG_LENGTH_MAX] = {};
  bool damaged = false; ///< a warning that means lost picture data
};

JpegState& state_of(j_common_ptr info) { return *static_cast<JpegState*>(info->client_data); }

void on_error(j_common_ptr info) {
  JpegState& state = state_of(info);
  info->err->format_message(info, state.message);
  std::longjmp(state.jump, 1);
}

/// Level -1 is "corrupt data, carried on". Stray bytes between markers and odd version numbers lose nothing; all
/// other kinds replaced picture data by a guess.
void on_message(j_common_ptr info, int level) {
  const int code = info->err->msg_code;
  if (level >= 0 || code == JWRN_EXTRANEOUS_DATA || code == JWRN_ADOBE_XFORM || code == JWRN_JFIF_MAJOR)
    return;
  JpegState& state = state_of(info);
  if (!state.damaged)
    info->err->format_message(info, state.message);
  state.damaged = true;
}

void on_progress(j_common_ptr info) {
  if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number > kMaxScans) {
    std::strncpy(state_of(info).message, "more scans than any real file has", JMSG_LENGTH_MAX - 1);
    std::longjmp(state_of(info).jump, 1);
  }
}

bool read_header(JpegState& state, Bytes bytes) {
  state.decoder.err = jpeg_std_error(&state.errors);
  state.errors.error_exit = on_error;
  state.errors.emit_message = on_message;
  state.decoder.client_data = &state;
  if (setjmp(state.jump))
    return false;
  jpeg_create_decompress(&state.decoder);
  state.decoder.client_data = &state;
  state.progress.progress_monitor = on_progress;
  state.decoder.progress = &state.progress;
  jpeg_mem_src(&state.decoder, bytes.data(), static_cast<unsigned long>(bytes.size()));
  return jpeg_read_header(&state.decoder, TRUE) == JPEG_HEADER_OK;
}

bool read_rows(JpegState& state, std::uint8_t* out) {
  if (setjmp(state.jump))
    return false;
  state.decoder.out_color_space = JCS_RGB;
  state.decoder.dct_method = JDCT_ISLOW;
  jpeg_start_decompress(&state.decoder);
  while (state.decoder.output_scanline < state.decoder.output_height) {
    JSAMPROW row = out + std::size_t{3} * state.decoder.output_width * state.decoder.output_scanline;
    jpeg_read_scanlines(&state.decoder, &row, 1);
  }
  jpeg_finish_decompress(&state.decoder);
  return true;
}

Result<Rgb8Image> decode_with(JpegState& state, Bytes bytes, const std::string& name) {
  if (!read_header(state, bytes))
    return damaged_file(name, std::string("cannot read the JPEG file (") + state.message + ")");
  if (state.decoder.jpeg_color_space == JCS_CMYK || state.decoder.jpeg_color_space == JCS_YCCK)
    return Error{ErrorCode::file_malformed, "a CMYK JPEG", name, "export the photograph as RGB"};
  const int width = static_cast<int>(state.decoder.image_width), height = static_cast<int>(state.decoder.image_height);
  if (auto error = check_image_size(width, height, 1, bytes.size(), name))
    return *error;
  Rgb8Image image{width, height, {}};
  image.bytes.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  if (!read_rows(state, image.bytes.data()) || state.damaged)
    return damaged_file(name, std::string("cannot read the JPEG file (") + state.message + ")");
  return image;
}

struct JpegWriter {
  jpeg_compress_struct encoder{};
  jpeg_error_mgr errors{};
  std::jmp_buf jump{};
  unsigned char* out = nullptr; ///< by malloc
  unsigned long size = 0;
};

void on_write_error(j_common_ptr info) { std::longjmp(static_cast<JpegWriter*>(info->client_data)->jump, 1); }

bool write_rows(JpegWriter& w, const Rgb8Image* image, int quality) {
  w.encoder.err = jpeg_std_error(&w.errors);
  w.errors.error_exit = on_write_error;
  w.encoder.client_data = &w;
  if (setjmp(w.jump))
    return false;
  jpeg_create_compress(&w.encoder);
  w.encoder.client_data = &w;
  jpeg_mem_dest(&w.encoder, &w.out, &w.size);
  w.encoder.image_width = static_cast<JDIMENSION>(image->width);
  w.encoder.image_height = static_cast<JDIMENSION>(image->height);
  w.encoder.input_components = 3;
  w.encoder.in_color_space = JCS_RGB;
  jpeg_set_defaults(&w.encoder);
  jpeg_set_quality(&w.encoder, quality, TRUE);
  jpeg_start_compress(&w.encoder, TRUE);
  while (w.encoder.next_scanline < w.encoder.image_height) {
    // libjpeg's rows are not const, but writing does not change them.
    JSAMPROW row = const_cast<JSAMPROW>(image->bytes.data()) + std::size_t{3} * image->width * w.encoder.next_scanline;
    jpeg_write_scanlines(&w.encoder, &row, 1);
  }
  jpeg_finish_compress(&w.encoder);
  return true;
}

} // namespace

bool is_jpeg(Bytes bytes) { return bytes.size() >= 3 && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes[2] == 0xff; }

Result<Rgb8Image> decode_jpeg(Bytes bytes, const std::string& name) {
  const auto state = std::make_unique<JpegState>();
  const Result<Rgb8Image> image = decode_with(*state, bytes, name);
  jpeg_destroy_decompress(&state->decoder);
  return image;
}

} // namespace daylit::detail

namespace daylit {

Result<std::vector<std::uint8_t>> encoded_jpeg(const Rgb8Image& image, int quality) {
  const std::size_t expected = 3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  if (image.width < 1 || image.height < 1 || image.bytes.size() != expected)
    return Error{ErrorCode::value_invalid, "an empty image cannot be written", "picture", ""};
  const auto writer = std::make_unique<detail::JpegWriter>();
  const bool written = detail::write_rows(*writer, &image, quality);
  jpeg_destroy_compress(&writer->encoder);
  std::vector<std::uint8_t> out(writer->out, writer->out + (written ? writer->size : 0));
  std::free(writer->out);
  if (!written)
    return Error{ErrorCode::limit_exceeded, "cannot be encoded as JPEG", "picture", "JPEG holds 65500 pixels a side"};
  return out;
}

} // namespace daylit
