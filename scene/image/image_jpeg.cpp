#include "scene/image/image_codecs.h"

#include <csetjmp>
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

} // namespace

bool is_jpeg(Bytes bytes) { return bytes.size() >= 3 && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes[2] == 0xff; }

Result<Rgb8Image> decode_jpeg(Bytes bytes, const std::string& name) {
  const auto state = std::make_unique<JpegState>();
  const Result<Rgb8Image> image = decode_with(*state, bytes, name);
  jpeg_destroy_decompress(&state->decoder);
  return image;
}

} // namespace daylit::detail
