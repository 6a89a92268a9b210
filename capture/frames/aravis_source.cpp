#include "capture/frames/aravis_source.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include <arv.h>

#include "capture/frames/camera_thread.h"
#include "capture/frames/video_camera.h"

namespace daylit {

namespace {

using namespace std::chrono_literals;

constexpr int kBuffers = 6;
constexpr std::uint64_t kPop_us = 50'000;
constexpr auto kSilence = 2s; ///< without a frame: the camera is opened again

/// What a thread of Aravis wrote. ThreadSanitizer does not see how it was handed over, and would judge every byte.
__attribute__((no_sanitize("thread"))) void copy_unseen(const std::uint8_t* from, std::uint8_t* to, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i)
    to[i] = from[i];
}

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class T>
using Owned = std::unique_ptr<T, Unref>;

/// GError that says what was being done when it came.
class Attempt {
public:
  ~Attempt() { g_clear_error(&error_); }
  GError** out() { return &error_; }
  /// True when the call before failed; the first failure is kept.
  bool failed(const std::string& what) {
    if (!error_)
      return false;
    if (text_.empty())
      text_ = what + ": " + error_->message;
    g_clear_error(&error_);
    return true;
  }
  const std::string& text() const { return text_; }

private:
  GError* error_ = nullptr;
  std::string text_;
};

struct KnownFormat {
  ArvPixelFormat code;
  PixelFormat format;
};
constexpr std::array kFormats{KnownFormat{ARV_PIXEL_FORMAT_MONO_8, {Mosaic::mono, 8}},
                              KnownFormat{ARV_PIXEL_FORMAT_MONO_10, {Mosaic::mono, 10}},
                              KnownFormat{ARV_PIXEL_FORMAT_MONO_12, {Mosaic::mono, 12}},
                              KnownFormat{ARV_PIXEL_FORMAT_MONO_14, {Mosaic::mono, 14}},
                              KnownFormat{ARV_PIXEL_FORMAT_MONO_16, {Mosaic::mono, 16}},
                              KnownFormat{ARV_PIXEL_FORMAT_RGB_8_PACKED, {Mosaic::rgb, 8}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_RG_8, {Mosaic::rggb, 8}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_GR_8, {Mosaic::grbg, 8}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_GB_8, {Mosaic::gbrg, 8}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_BG_8, {Mosaic::bggr, 8}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_RG_10, {Mosaic::rggb, 10}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_GR_10, {Mosaic::grbg, 10}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_GB_10, {Mosaic::gbrg, 10}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_BG_10, {Mosaic::bggr, 10}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_RG_12, {Mosaic::rggb, 12}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_GR_12, {Mosaic::grbg, 12}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_GB_12, {Mosaic::gbrg, 12}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_BG_12, {Mosaic::bggr, 12}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_RG_16, {Mosaic::rggb, 16}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_GR_16, {Mosaic::grbg, 16}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_GB_16, {Mosaic::gbrg, 16}},
                              KnownFormat{ARV_PIXEL_FORMAT_BAYER_BG_16, {Mosaic::bggr, 16}}};

std::optional<PixelFormat> format_of(ArvPixelFormat code, const std::optional<Mosaic>& mosaic) {
  for (const KnownFormat& known : kFormats)
    if (known.code == code) {
      PixelFormat format = known.format;
      if (mosaic && format.mosaic == Mosaic::mono)
        format.mosaic = *mosaic;
      return format;
    }
  return std::nullopt;
}

/// Empty: it can have all of them.
std::string refused_exposures(const std::vector<int>& exposures_us, ArvCamera* camera) {
  Attempt a;
  double least = 0, most = 0;
  arv_camera_get_exposure_time_bounds(camera, &least, &most, a.out());
  if (a.failed("range of exposures"))
    return a.text();
  for (const int us : exposures_us)
    if (us < least || us > most)
      return "it exposes for " + std::to_string(std::llround(least)) + " to " + std::to_string(std::llround(most)) +
             " microseconds, not for " + std::to_string(us);
  return "";
}

/// The names that [sky] or [interior] pixel_format may have with this camera.
std::string formats_of(ArvCamera* camera) {
  guint n = 0;
  GError* error = nullptr;
  const char** names = arv_camera_dup_available_pixel_formats_as_strings(camera, &n, &error);
  std::string list;
  for (guint k = 0; names && k < n; ++k)
    list += (list.empty() ? "" : ", ") + std::string(names[k]);
  g_free(names);
  g_clear_error(&error);
  return list;
}

/// Empty: set; else what the camera did not take.
std::string apply(const CameraSettings& s, ArvCamera* camera) {
  Attempt a;
  if (!s.pixel_format.empty())
    arv_camera_set_pixel_format_from_string(camera, s.pixel_format.c_str(), a.out());
  if (a.failed("pixel_format = \"" + s.pixel_format + "\""))
    return a.text() + "; it has " + formats_of(camera);
  if (s.width_px && s.height_px)
    arv_camera_set_region(camera, -1, -1, *s.width_px, *s.height_px, a.out()), a.failed("size");
  if (s.frame_rate_hz)
    arv_camera_set_frame_rate(camera, *s.frame_rate_hz, a.out()), a.failed("frame rate");
  if (s.exposure_us)
    arv_camera_set_exposure_time(camera, *s.exposure_us, a.out()), a.failed("exposure");
  if (!s.exposures_us.empty()) {
    if (std::string refused = refused_exposures(s.exposures_us, camera); !refused.empty())
      return refused;
    arv_camera_set_exposure_time(camera, s.exposures_us.front(), a.out()), a.failed("exposure");
  }
  if (s.gain)
    arv_camera_set_gain(camera, *s.gain, a.out()), a.failed("gain");
  if (arv_camera_is_gv_device(camera)) {
    if (s.packet_bytes > 0)
      arv_camera_gv_set_packet_size(camera, s.packet_bytes, a.out());
    else
      arv_camera_gv_auto_packet_size(camera, a.out());
    a.failed("packet size");
  }
  return a.text();
}

bool is_address(const std::string& camera) { return camera.find_first_not_of("0123456789.") == std::string::npos; }

std::int64_t steady_ns() { return std::chrono::steady_clock::now().time_since_epoch() / 1ns; }

/// The camera's clock on ours. The way of a time stamp to this machine takes at least as long as the fastest did, and
/// that long is taken for nothing: offset = min over frames of (arrival - stamp). The minimum is let rise by 100 parts
/// in a million, more than two quartz clocks drift apart.
class CameraClock {
public:
  std::int64_t on_ours(std::int64_t stamp_ns, std::int64_t arrival_ns) {
    const std::int64_t offset = arrival_ns - stamp_ns;
    const std::int64_t risen = offset_ns_ + (arrival_ns - last_ns_) / 10'000;
    offset_ns_ = last_ns_ == 0 || offset < risen ? offset : risen;
    last_ns_ = arrival_ns;
    return stamp_ns + offset_ns_;
  }

private:
  std::int64_t offset_ns_ = 0, last_ns_ = 0;
};

class AravisCamera final : public CameraThread {
public:
  AravisCamera(const CameraSettings& settings, std::function<void(const CameraFrame&)> each)
      : CameraThread(std::move(each)), settings_(settings) {}

private:
  std::string stream_until_lost() override {
    if (!is_address(settings_.camera))
      arv_update_device_list(); // Aravis keeps the address that an id once had; the camera may have another one now
    Attempt a;
    const Owned<ArvCamera> camera(
        arv_camera_new(settings_.camera.empty() ? nullptr : settings_.camera.c_str(), a.out()));
    if (a.failed("cannot be opened") || !camera)
      return a.text();
    if (const std::string refused = apply(settings_, camera.get()); !refused.empty())
      return refused;
    const char* name = arv_camera_get_pixel_format_as_string(camera.get(), nullptr);
    if (!format_of(arv_camera_get_pixel_format(camera.get(), a.out()), settings_.mosaic))
      return std::string("its pixel format ") + (name ? name : "") +
             " is not read; choose one of Mono, RGB8 or Bayer that is not packed";
    const Owned<ArvStream> stream(arv_camera_create_stream(camera.get(), nullptr, nullptr, a.out()));
    if (a.failed("another program may be using it") || !stream)
      return a.text();
    const auto payload = arv_camera_get_payload(camera.get(), a.out());
    exposure_us_ = settings_.exposures_us.empty() ? arv_camera_get_exposure_time(camera.get(), nullptr) : 0.0;
    for (int k = 0; k < kBuffers; ++k)
      arv_stream_push_buffer(stream.get(), arv_buffer_new(payload, nullptr));
    arv_camera_set_acquisition_mode(camera.get(), ARV_ACQUISITION_MODE_CONTINUOUS, a.out());
    a.failed("continuous acquisition");
    arv_camera_start_acquisition(camera.get(), a.out());
    if (a.failed("cannot be started"))
      return a.text();
    const std::string trouble = take_frames(camera.get(), stream.get());
    arv_camera_stop_acquisition(camera.get(), nullptr);
    return trouble;
  }

  std::string take_frames(ArvCamera* camera, ArvStream* stream) {
    std::atomic<bool> lost = false;
    const gulong signal =
        g_signal_connect(arv_camera_get_device(camera), "control-lost",
                         G_CALLBACK(+[](ArvDevice*, std::atomic<bool>* flag) { *flag = true; }), &lost);
    say_connected();
    last_id_.reset();
    clock_ = {};
    auto last = std::chrono::steady_clock::now();
    while (!is_to_stop() && !lost && std::chrono::steady_clock::now() - last < kSilence)
      if (ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream, kPop_us)) {
        const bool whole = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
        const std::uint64_t missing = gap_before(arv_buffer_get_frame_id(buffer));
        take(whole ? frame_of(buffer) : std::nullopt, missing);
        arv_stream_push_buffer(stream, buffer);
        if (const auto& cycle = settings_.exposures_us; !cycle.empty())
          arv_camera_set_exposure_time(camera, cycle[++exposures_set_ % cycle.size()], nullptr);
        last = std::chrono::steady_clock::now();
      }
    g_signal_handler_disconnect(arv_camera_get_device(camera), signal);
    const std::string trouble =
        lost ? "the camera is gone: unplugged, or taken by another program" : "no frame came for two seconds";
    say_lost(trouble); // at once: to end the acquisition of a camera that is gone takes a second
    return trouble;
  }

  /// The counter of GigE Vision 1.x has 16 bits and leaves 0 out when it wraps.
  std::uint64_t gap_before(std::uint64_t id) {
    const std::optional<std::uint64_t> last = std::exchange(last_id_, id);
    if (!last)
      return 0;
    if (id > 0xffff || *last > 0xffff)
      return id > *last ? id - *last - 1 : 0;
    std::uint64_t step = (id - *last) & 0xffff;
    if (id < *last && step > 1)
      --step;
    return step > 1 && step < 0x8000 ? step - 1 : 0;
  }

  std::optional<CameraFrame> frame_of(ArvBuffer* buffer) {
    const auto format = format_of(arv_buffer_get_image_pixel_format(buffer), settings_.mosaic);
    std::size_t size = 0;
    const void* data = arv_buffer_get_image_data(buffer, &size);
    const int width = arv_buffer_get_image_width(buffer), height = arv_buffer_get_image_height(buffer);
    if (!format || !data || width < 1 || height < 1 || size < frame_bytes(width, height, *format))
      return std::nullopt;
    CameraFrame frame{width, height, *format, std::vector<std::uint8_t>(frame_bytes(width, height, *format))};
    copy_unseen(static_cast<const std::uint8_t*>(data), frame.bytes.data(), frame.bytes.size());
    frame.id = arv_buffer_get_frame_id(buffer);
    frame.time_ns = static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer));
    frame.exposure_us = exposure_us_;
    // Its first packet came when Aravis says, by a clock that may be set meanwhile: only how long ago counts.
    const std::int64_t since_ns = std::max<std::int64_t>(g_get_real_time() * 1000 - frame.time_ns, 0);
    const std::int64_t arrival_ns = steady_ns() - std::min<std::int64_t>(since_ns, 1s / 1ns);
    frame.taken_ns = clock_.on_ours(static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer)), arrival_ns);
    return frame;
  }

  const CameraSettings settings_;
  std::optional<std::uint64_t> last_id_; ///< of the worker
  double exposure_us_ = 0.0;             ///< of the worker
  std::size_t exposures_set_ = 0;        ///< of the worker
  CameraClock clock_;                    ///< of the worker
};

} // namespace

std::vector<FoundCamera> find_cameras() {
  arv_update_device_list();
  std::vector<FoundCamera> found;
  for (unsigned k = 0; k < arv_get_n_devices(); ++k) {
    const char* address = arv_get_device_address(k);
    found.push_back({arv_get_device_id(k), address ? address : ""});
  }
  for (const std::string& device : find_video_devices())
    found.push_back({device, ""});
  return found;
}

Result<std::unique_ptr<FrameSource>> open_camera(const CameraSettings& s,
                                                 std::function<void(const CameraFrame&)> each) {
  const auto bad = [](const std::optional<double>& value) { return value && !(*value > 0 && *value < 1e9); };
  if (bad(s.exposure_us) || bad(s.frame_rate_hz) || (s.gain && !(*s.gain >= 0 && *s.gain < 1e6)) ||
      s.width_px.has_value() != s.height_px.has_value() || s.width_px.value_or(1) < 1 || s.height_px.value_or(1) < 1 ||
      std::ranges::any_of(s.exposures_us, [](int us) { return us < 1; }) || s.packet_bytes < 0 ||
      s.packet_bytes > 65535)
    return Error{ErrorCode::value_invalid, "exposure, gain, frame rate, size or packet size is out of range",
                 s.camera.empty() ? "camera" : s.camera, "give microseconds, hertz, pixels and bytes"};
  if (is_video_device(s.camera) && s.packet_bytes > 0)
    return Error{ErrorCode::value_invalid, "a packet size is for cameras on a network", s.camera, "leave it out"};
  if (is_video_device(s.camera))
    return source_of(std::make_shared<VideoCamera>(s, std::move(each)));
  return source_of(std::make_shared<AravisCamera>(s, std::move(each)));
}

} // namespace daylit
