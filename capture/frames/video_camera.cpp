#include "capture/frames/video_camera.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <libv4l2.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/mman.h>

namespace daylit {

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr unsigned kBuffers = 4;
constexpr int kWait_ms = 50;
constexpr auto kSilence = 2s; ///< without a frame: the camera is opened again
constexpr double kExposureStep_us = 100;

struct KnownFormat {
  const char* name;
  std::uint32_t code;
  PixelFormat format;
};
constexpr std::array kFormats{KnownFormat{"RGB8", V4L2_PIX_FMT_RGB24, {Mosaic::rgb, 8}},
                              KnownFormat{"Mono8", V4L2_PIX_FMT_GREY, {Mosaic::mono, 8}},
                              KnownFormat{"Mono10", V4L2_PIX_FMT_Y10, {Mosaic::mono, 10}},
                              KnownFormat{"Mono12", V4L2_PIX_FMT_Y12, {Mosaic::mono, 12}},
                              KnownFormat{"Mono16", V4L2_PIX_FMT_Y16, {Mosaic::mono, 16}},
                              KnownFormat{"BayerRG8", V4L2_PIX_FMT_SRGGB8, {Mosaic::rggb, 8}},
                              KnownFormat{"BayerGR8", V4L2_PIX_FMT_SGRBG8, {Mosaic::grbg, 8}},
                              KnownFormat{"BayerGB8", V4L2_PIX_FMT_SGBRG8, {Mosaic::gbrg, 8}},
                              KnownFormat{"BayerBG8", V4L2_PIX_FMT_SBGGR8, {Mosaic::bggr, 8}},
                              KnownFormat{"BayerRG12", V4L2_PIX_FMT_SRGGB12, {Mosaic::rggb, 12}},
                              KnownFormat{"BayerGR12", V4L2_PIX_FMT_SGRBG12, {Mosaic::grbg, 12}},
                              KnownFormat{"BayerGB12", V4L2_PIX_FMT_SGBRG12, {Mosaic::gbrg, 12}},
                              KnownFormat{"BayerBG12", V4L2_PIX_FMT_SBGGR12, {Mosaic::bggr, 12}}};

class SystemVideoDevice final : public VideoDevice {
public:
  ~SystemVideoDevice() override { close(); }
  int open(const std::string& path) override {
    close();
    return file_ = v4l2_open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  }
  void close() override {
    if (file_ >= 0)
      v4l2_close(file_);
    file_ = -1;
  }
  int control(unsigned long request, void* argument) override { return v4l2_ioctl(file_, request, argument); }
  void* map(std::size_t bytes, std::int64_t offset) override {
    void* memory = v4l2_mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file_, offset);
    return memory == MAP_FAILED ? nullptr : memory;
  }
  void unmap(void* memory, std::size_t bytes) override { v4l2_munmap(memory, bytes); }
  int wait(int milliseconds) override {
    pollfd p{file_, POLLIN, 0};
    return poll(&p, 1, milliseconds);
  }

private:
  int file_ = -1;
};

v4l2_buffer buffer_number(unsigned k) {
  v4l2_buffer b{};
  b.index = k;
  b.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  b.memory = V4L2_MEMORY_MMAP;
  return b;
}

/// CLOCK_MONOTONIC, which is ours.
std::int64_t taken_ns(const v4l2_buffer& b) {
  if ((b.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
    return b.timestamp.tv_sec * std::int64_t{1'000'000'000} + b.timestamp.tv_usec * std::int64_t{1000};
  return Clock::now().time_since_epoch() / 1ns;
}

} // namespace

std::unique_ptr<VideoDevice> system_video_device() { return std::make_unique<SystemVideoDevice>(); }

bool is_video_device(const std::string& camera) { return camera.starts_with("/dev/"); }

std::vector<std::string> find_video_devices() {
  std::vector<std::string> found;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", none)) {
    const std::string path = entry.path().string();
    SystemVideoDevice device;
    v4l2_capability can{};
    if (path.starts_with("/dev/video") && device.open(path) >= 0 && device.control(VIDIOC_QUERYCAP, &can) == 0 &&
        can.device_caps & V4L2_CAP_VIDEO_CAPTURE)
      found.push_back(path);
  }
  std::ranges::sort(found);
  return found;
}

VideoCamera::VideoCamera(const CameraSettings& settings, std::function<void(const CameraFrame&)> each,
                         std::unique_ptr<VideoDevice> device)
    : CameraThread(std::move(each)), settings_(settings), device_(std::move(device)) {}

std::string VideoCamera::failed(const std::string& what) const { return what + ": " + std::strerror(errno); }

std::string VideoCamera::stream_until_lost() {
  if (device_->open(settings_.camera) < 0)
    return failed("cannot be opened");
  std::string trouble = set_up();
  if (trouble.empty())
    trouble = take_frames();
  say_lost(trouble);
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  device_->control(VIDIOC_STREAMOFF, &type);
  for (const Buffer& b : buffers_)
    device_->unmap(b.memory, b.bytes);
  buffers_.clear();
  device_->close();
  return trouble;
}

std::string VideoCamera::set_up() {
  v4l2_capability can{};
  if (device_->control(VIDIOC_QUERYCAP, &can) != 0)
    return failed("is no video device");
  if (!(can.device_caps & V4L2_CAP_VIDEO_CAPTURE) || !(can.device_caps & V4L2_CAP_STREAMING))
    return "it takes no pictures that can be streamed";
  for (auto step : {&VideoCamera::set_format, &VideoCamera::set_controls, &VideoCamera::make_buffers})
    if (std::string trouble = (this->*step)(); !trouble.empty())
      return trouble;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  return device_->control(VIDIOC_STREAMON, &type) == 0 ? "" : failed("another program may be using it");
}

std::string VideoCamera::set_format() {
  const std::string name = settings_.pixel_format.empty() ? "RGB8" : settings_.pixel_format;
  const auto known = std::ranges::find_if(kFormats, [&](const KnownFormat& k) { return name == k.name; });
  if (known == kFormats.end())
    return "pixel format " + name + " is not read; choose RGB8, Mono8, Mono16 or a Bayer format of 8 or 12 bits";
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (device_->control(VIDIOC_G_FMT, &format) != 0)
    return failed("format");
  format.fmt.pix.pixelformat = known->code;
  format.fmt.pix.bytesperline = 0;
  format.fmt.pix.width =
      static_cast<std::uint32_t>(settings_.width_px.value_or(static_cast<int>(format.fmt.pix.width)));
  format.fmt.pix.height =
      static_cast<std::uint32_t>(settings_.height_px.value_or(static_cast<int>(format.fmt.pix.height)));
  if (device_->control(VIDIOC_S_FMT, &format) != 0 || format.fmt.pix.pixelformat != known->code)
    return "it does not send " + name;
  format_ = known->format;
  if (settings_.mosaic && format_.mosaic == Mosaic::mono)
    format_.mosaic = *settings_.mosaic;
  width_ = static_cast<int>(format.fmt.pix.width);
  height_ = static_cast<int>(format.fmt.pix.height);
  row_bytes_ = std::max<std::size_t>(format.fmt.pix.bytesperline, frame_bytes(width_, 1, format_));
  return "";
}

bool VideoCamera::set(std::uint32_t control, double value) {
  v4l2_control c{control, static_cast<std::int32_t>(std::lround(value))};
  return device_->control(VIDIOC_S_CTRL, &c) == 0;
}

bool VideoCamera::set_exposure(double exposure_us) {
  set(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL); // not every camera has an automatic one
  return set(V4L2_CID_EXPOSURE_ABSOLUTE, std::max(exposure_us / kExposureStep_us, 1.0));
}

std::string VideoCamera::set_controls() {
  std::optional<double> exposure_us = settings_.exposure_us;
  if (!settings_.exposures_us.empty())
    exposure_us = settings_.exposures_us.front();
  if (exposure_us && !set_exposure(*exposure_us))
    return failed("exposure");
  if (settings_.gain) {
    set(V4L2_CID_AUTOGAIN, 0);
    if (!set(V4L2_CID_GAIN, *settings_.gain))
      return failed("gain");
  }
  if (!settings_.frame_rate_hz)
    return "";
  v4l2_streamparm rate{};
  rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  rate.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(1000 * *settings_.frame_rate_hz))};
  return device_->control(VIDIOC_S_PARM, &rate) == 0 ? "" : failed("frame rate");
}

std::string VideoCamera::make_buffers() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (device_->control(VIDIOC_REQBUFS, &request) != 0)
    return failed("another program may be using it");
  for (unsigned k = 0; k < request.count; ++k) {
    v4l2_buffer b = buffer_number(k);
    if (device_->control(VIDIOC_QUERYBUF, &b) != 0)
      return failed("buffer");
    void* memory = device_->map(b.length, b.m.offset);
    if (!memory)
      return failed("memory of a buffer");
    buffers_.push_back({memory, b.length});
    if (device_->control(VIDIOC_QBUF, &b) != 0)
      return failed("buffer");
  }
  return "";
}

/// A frame whose driver says it is damaged, or that is shorter than its size, is counted only.
std::string VideoCamera::take_frames() {
  say_connected();
  std::optional<std::uint32_t> last_id;
  for (auto last = Clock::now(); !is_to_stop() && Clock::now() - last < kSilence;) {
    if (device_->wait(kWait_ms) <= 0)
      continue;
    v4l2_buffer b = buffer_number(0);
    if (device_->control(VIDIOC_DQBUF, &b) != 0) {
      if (errno == EAGAIN)
        continue;
      return failed("the camera is gone");
    }
    const std::uint64_t missing = last_id ? b.sequence - *last_id - 1 : 0;
    last_id = b.sequence;
    take(frame_of(b), missing < 0x8000 ? missing : 0);
    if (device_->control(VIDIOC_QBUF, &b) != 0)
      return failed("the camera is gone");
    if (const auto& cycle = settings_.exposures_us; !cycle.empty())
      set_exposure(cycle[++exposures_set_ % cycle.size()]);
    last = Clock::now();
  }
  return "no frame came for two seconds";
}

std::optional<CameraFrame> VideoCamera::frame_of(const v4l2_buffer& b) const {
  const std::size_t row = frame_bytes(width_, 1, format_), rows = static_cast<std::size_t>(height_);
  const std::size_t used = std::min<std::size_t>(b.bytesused, b.index < buffers_.size() ? buffers_[b.index].bytes : 0);
  if (b.flags & V4L2_BUF_FLAG_ERROR || rows == 0 || used < (rows - 1) * row_bytes_ + row)
    return std::nullopt;
  CameraFrame frame{width_, height_, format_, std::vector<std::uint8_t>(rows * row)};
  const auto* from = static_cast<const std::uint8_t*>(buffers_[b.index].memory);
  for (std::size_t y = 0; y < rows; ++y)
    std::memcpy(&frame.bytes[y * row], from + y * row_bytes_, row);
  frame.id = b.sequence;
  frame.taken_ns = taken_ns(b);
  frame.time_ns = std::chrono::system_clock::now().time_since_epoch() / 1ns;
  frame.exposure_us = settings_.exposures_us.empty() ? settings_.exposure_us.value_or(0.0) : 0.0;
  return frame;
}

} // namespace daylit
