#pragma once

// A camera of the kernel's Video4Linux (USB webcams, capture cards), through libv4l2.

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "capture/frames/aravis_source.h"
#include "capture/frames/camera_thread.h"

struct v4l2_buffer;

namespace daylit {

/// The calls of libv4l2 that are used, so that a test can stand for a device. As in v4l2(3): -1 and errno on failure.
class VideoDevice {
public:
  virtual ~VideoDevice() = default;
  virtual int open(const std::string& path) = 0;
  virtual void close() = 0;
  virtual int control(unsigned long request, void* argument) = 0;
  virtual void* map(std::size_t bytes, std::int64_t offset) = 0; ///< null on failure
  virtual void unmap(void* memory, std::size_t bytes) = 0;
  /// As poll() for reading: positive when a frame is there, or the device has gone.
  virtual int wait(int milliseconds) = 0;
};
std::unique_ptr<VideoDevice> system_video_device();

/// "/dev/video0", "/dev/v4l/by-id/...": a name that stays with the camera.
bool is_video_device(const std::string& camera);
std::vector<std::string> find_video_devices();

/// CameraSettings::pixel_format: RGB8 (what libv4l2 can convert to it, the default), Mono8 to Mono16, BayerRG8 and the
/// like; gain in the device's own unit; exposures in steps of 100 microseconds.
class VideoCamera final : public CameraThread {
public:
  VideoCamera(const CameraSettings& settings, std::function<void(const CameraFrame&)> each,
              std::unique_ptr<VideoDevice> device = system_video_device());

private:
  struct Buffer {
    void* memory = nullptr;
    std::size_t bytes = 0;
  };
  std::string stream_until_lost() override;
  std::string set_up();
  std::string set_format();
  std::string set_controls();
  bool set(std::uint32_t control, double value);
  bool set_exposure(double exposure_us);
  std::string make_buffers();
  std::string take_frames();
  std::string failed(const std::string& what) const;
  std::optional<CameraFrame> frame_of(const v4l2_buffer& buffer) const;

  const CameraSettings settings_;
  const std::unique_ptr<VideoDevice> device_;
  PixelFormat format_;
  int width_ = 0, height_ = 0;
  std::size_t row_bytes_ = 0;
  std::vector<Buffer> buffers_;
  std::size_t exposures_set_ = 0;
};

} // namespace daylit
