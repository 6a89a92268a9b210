// daylit-bench camera: pictures served as a GigE Vision camera would, real packets from Aravis' fake camera.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <thread>
#include <tuple>

#include <arv.h>

#include "bench/command.h"
#include "capture/frames/frame.h"
#include "scene/core/command_line.h"
#include "scene/image/image_formats.h"

namespace daylit::bench {

namespace {

struct Arguments {
  std::vector<std::filesystem::path> pictures;
  std::string address = "127.0.0.1", serial = "daylit", mosaic = "mono", response = "linear";
  double white = 1.0, lost_ratio = 0.0, seconds_each = 0.0;
  int exposure_delay = 0;
  bool noise = false;
};

/// Code values of picture k for an exposure and a format, made when they are first asked for.
class Codes {
public:
  Codes(const Arguments& a, Mosaic mosaic, std::vector<RgbImage> pictures, bool says_frames)
      : white_(a.white), seconds_each_(a.seconds_each), srgb_(a.response == "srgb"), mosaic_(mosaic),
        late_(static_cast<std::size_t>(a.exposure_delay)), noise_(a.noise), says_frames_(says_frames),
        pictures_(std::move(pictures)) {}

  /// The next picture's, as large as the buffer; of the exposure that was set so many frames ago.
  void fill(ArvBuffer* buffer, double exposure_set_us, ArvPixelFormat format) {
    set_us_.push_back(exposure_set_us);
    if (set_us_.size() > late_ + 1)
      set_us_.pop_front();
    const double exposure_us = set_us_.front();
    const std::size_t k = (seconds_each_ > 0 ? by_the_clock() : served_++) % pictures_.size();
    const int width = arv_buffer_get_image_width(buffer), height = arv_buffer_get_image_height(buffer);
    auto& codes = made_[{k, width, height, exposure_us, format}];
    if (codes.empty())
      codes = make(pictures_[k], width, height, exposure_us, format);
    if (says_frames_) {
      std::printf("{\"frame\":%llu,\"picture\":%zu,\"exposure_us\":%.0f}\n",
                  static_cast<unsigned long long>(arv_buffer_get_frame_id(buffer)), k, exposure_us);
      std::fflush(stdout);
    }
    std::size_t size = 0; // 0 here, although the pointer is right
    auto* data = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
    if (!data)
      return;
    std::memcpy(data, codes.data(), codes.size());
    ++frames_;
    for (std::size_t i = 2 * (frames_ % 8); noise_ && i < codes.size(); i += 16) // the low byte where there are two
      data[i] ^= 1;
  }

private:
  /// The same of all cameras of this machine.
  std::size_t by_the_clock() const {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return static_cast<std::size_t>(std::chrono::duration<double>(now).count() / seconds_each_);
  }
  /// Colour of a sample: 0, 1, 2 for R, G, B; -1: all of them alike.
  static int channel(Mosaic mosaic, int x, int y) {
    constexpr int kTiles[4][4] = {{0, 1, 1, 2}, {1, 0, 2, 1}, {1, 2, 0, 1}, {2, 1, 1, 0}};
    return mosaic < Mosaic::rggb
               ? -1
               : kTiles[static_cast<int>(mosaic) - static_cast<int>(Mosaic::rggb)][2 * (y & 1) + (x & 1)];
  }
  /// Radiance times exposure over that of the largest code value (white at one millisecond), through the response.
  unsigned code(double radiance, double exposure_us, unsigned largest) const {
    const double v = std::clamp(radiance * exposure_us * 1e-3 / white_, 0.0, 1.0);
    return static_cast<unsigned>(std::lround(largest * (srgb_ ? double(srgb_encode(static_cast<float>(v))) : v)));
  }
  std::vector<std::uint8_t> make(const RgbImage& picture, int width, int height, double exposure_us,
                                 ArvPixelFormat format) const {
    const bool rgb = format == ARV_PIXEL_FORMAT_RGB_8_PACKED, two_bytes = format == ARV_PIXEL_FORMAT_MONO_16;
    const Mosaic mosaic = format == ARV_PIXEL_FORMAT_BAYER_RG_8   ? Mosaic::rggb
                          : format == ARV_PIXEL_FORMAT_BAYER_GR_8 ? Mosaic::grbg
                          : format == ARV_PIXEL_FORMAT_BAYER_GB_8 ? Mosaic::gbrg
                          : format == ARV_PIXEL_FORMAT_BAYER_BG_8 ? Mosaic::bggr
                                                                  : mosaic_;
    std::vector<std::uint8_t> bytes;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const Rgb c = x < picture.width && y < picture.height ? picture.at(x, y) : Rgb(0.0f);
        const int one = channel(mosaic, x, y);
        for (int sample = 0; sample < (rgb ? 3 : 1); ++sample) {
          const float v = rgb ? c[sample] : one < 0 ? luminance(c) : c[one];
          const unsigned value = code(double(v), exposure_us, two_bytes ? 65535 : 255);
          bytes.push_back(static_cast<std::uint8_t>(value));
          if (two_bytes)
            bytes.push_back(static_cast<std::uint8_t>(value >> 8));
        }
      }
    return bytes;
  }

  double white_, seconds_each_;
  bool srgb_;
  Mosaic mosaic_;
  std::size_t late_;
  bool noise_, says_frames_;
  std::deque<double> set_us_; ///< the last exposures that were set
  std::vector<RgbImage> pictures_;
  std::uint64_t served_ = 0, frames_ = 0; ///< served_: pictures, one after another
  std::map<std::tuple<std::size_t, int, int, double, ArvPixelFormat>, std::vector<std::uint8_t>> made_;
};

void fill(ArvBuffer* buffer, void* codes, guint32 exposure_us, guint32, ArvPixelFormat format) {
  static_cast<Codes*>(codes)->fill(buffer, exposure_us, format);
}

Result<std::vector<RgbImage>> read_pictures(const std::vector<std::filesystem::path>& paths) {
  std::vector<RgbImage> pictures;
  for (const auto& path : paths) {
    auto file = read_hdr_image(path);
    if (!file)
      return file.error();
    pictures.push_back(std::move(file->radiance));
  }
  return pictures;
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  const auto mosaic = mosaic_named(a.mosaic);
  if (!mosaic)
    return mosaic.error();
  auto pictures = read_pictures(a.pictures);
  if (!pictures)
    return pictures.error();
  Codes codes(a, *mosaic, std::move(*pictures), options.json);
  ArvGvFakeCamera* camera = arv_gv_fake_camera_new(a.address.c_str(), a.serial.c_str());
  if (!camera || !arv_gv_fake_camera_is_running(camera))
    return Error{ErrorCode::device, "no camera can be served there", a.address,
                 "another one may be; a second address: ip addr add 127.0.0.2/8 dev lo"};
  g_object_set(camera, "gvsp-lost-ratio", a.lost_ratio, nullptr);
  arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(camera), fill, &codes);
  if (!options.quiet)
    std::fprintf(stderr, "daylit-bench camera: %s at %s, until Ctrl-C\n", a.serial.c_str(), a.address.c_str());
  while (!interrupted())
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  g_object_unref(camera);
  return {};
}

} // namespace

Command add_camera(CLI::App& app) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "camera", "pictures (EXR) served one after another as a GigE Vision camera would, to try daylit-run without one");
  command->add_option("PICTURES", a->pictures, "EXR or .hdr, of the size that the client will ask for")->required();
  command->add_option("--address", a->address, "of this machine; a camera each")->capture_default_str();
  command->add_option("--serial", a->serial, "its id is Aravis-Fake-SERIAL")
      ->check([](const std::string& s) { return s.size() < 16 ? std::string() : "15 characters at most"; })
      ->capture_default_str();
  command->add_option("--white", a->white, "radiance of the largest code value, exposed for a millisecond")
      ->check(positive_number())
      ->capture_default_str();
  command->add_option("--seconds-each", a->seconds_each, "a picture for so long, by the clock (default: one per frame)")
      ->check(positive_number());
  command
      ->add_option("--exposure-delay", a->exposure_delay,
                   "frames after which a new exposure takes effect, 0 to 3 as a rule")
      ->check(CLI::Range(0, 100));
  command->add_option("--mosaic", a->mosaic, "that Mono formats carry: mono, rggb, grbg, gbrg or bggr")
      ->capture_default_str();
  command->add_option("--response", a->response, "of its code values")
      ->check(CLI::IsMember({"linear", "srgb"}))
      ->capture_default_str();
  command->add_flag("--noise", a->noise,
                    "a sixteenth of the samples is off by one, others in each frame: a camera whose\n"
                    "pictures are alike bit for bit is called frozen");
  command->add_option("--lost-ratio", a->lost_ratio, "fraction of packets that it drops")->check(CLI::Range(0.0, 1.0));
  return {command, [a](const CommonOptions& options) { return run(*a, options); }};
}

} // namespace daylit::bench
