#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include <arv.h>

namespace daylit::test {

/// A camera at an address of this machine that always sends the same samples.
class FakeCamera {
public:
  FakeCamera(std::string address, std::vector<std::uint8_t> samples)
      : address_(std::move(address)), samples_(std::move(samples)) {
    plug_in();
  }
  ~FakeCamera() { unplug(); }
  FakeCamera(const FakeCamera&) = delete;
  FakeCamera& operator=(const FakeCamera&) = delete;

  void plug_in() {
    camera_ = arv_gv_fake_camera_new(address_.c_str(), address_.c_str());
    if (is_running())
      arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(camera_), fill, this);
  }
  void unplug() {
    if (camera_)
      g_object_unref(camera_);
    camera_ = nullptr;
  }
  bool is_running() const { return camera_ && arv_gv_fake_camera_is_running(camera_); }

private:
  static void fill(ArvBuffer* buffer, void* camera, guint32, guint32, ArvPixelFormat) {
    const auto& samples = static_cast<FakeCamera*>(camera)->samples_;
    std::size_t size = 0; // 0 here, although the pointer is right
    if (void* data = const_cast<void*>(arv_buffer_get_data(buffer, &size)))
      std::memcpy(data, samples.data(), samples.size());
  }
  std::string address_;
  std::vector<std::uint8_t> samples_;
  ArvGvFakeCamera* camera_ = nullptr;
};

} // namespace daylit::test
