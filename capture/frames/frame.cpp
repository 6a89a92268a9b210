#include "capture/frames/frame.h"

#include <algorithm>
#include <array>
#include <iterator>

#include <opencv2/imgproc.hpp>

namespace daylit {

namespace {

constexpr std::array<const char*, 6> kMosaics{"mono", "rgb", "rggb", "grbg", "gbrg", "bggr"};

/// OpenCV's method for a mosaic; -1: there is none to fill in.
int demosaicing_of(Mosaic mosaic) {
  switch (mosaic) {
  case Mosaic::rggb:
    return cv::COLOR_BayerRGGB2RGB_EA;
  case Mosaic::grbg:
    return cv::COLOR_BayerGRBG2RGB_EA;
  case Mosaic::gbrg:
    return cv::COLOR_BayerGBRG2RGB_EA;
  case Mosaic::bggr:
    return cv::COLOR_BayerBGGR2RGB_EA;
  case Mosaic::mono:
  case Mosaic::rgb:
    break;
  }
  return -1;
}

template <class Sample>
RgbImage to_linear(const cv::Mat& samples, int bits) {
  RgbImage picture(samples.cols, samples.rows);
  const int channels = samples.channels();
  const float largest = static_cast<float>((1 << bits) - 1);
  for (int y = 0; y < samples.rows; ++y) {
    const Sample* row = samples.ptr<Sample>(y);
    for (int x = 0; x < samples.cols; ++x)
      for (int c = 0; c < 3; ++c)
        picture.at(x, y)[c] = static_cast<float>(row[channels * x + (channels == 3 ? c : 0)]) / largest;
  }
  return picture;
}

} // namespace

std::string name_of(Mosaic mosaic) { return kMosaics[static_cast<std::size_t>(mosaic)]; }

Result<Mosaic> mosaic_named(const std::string& name) {
  const auto found = std::find(kMosaics.begin(), kMosaics.end(), name);
  if (found == kMosaics.end())
    return Error{ErrorCode::value_invalid, "unknown mosaic \"" + name.substr(0, 20) + "\"", "",
                 "known are mono, rgb, rggb, grbg, gbrg and bggr"};
  return static_cast<Mosaic>(found - kMosaics.begin());
}

std::size_t frame_bytes(int width_px, int height_px, const PixelFormat& format) {
  return static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) *
         static_cast<std::size_t>(format.samples_per_pixel() * format.bytes_per_sample());
}

Result<RgbImage> linear_picture(const CameraFrame& frame) {
  const int method = demosaicing_of(frame.format.mosaic);
  const int least = method >= 0 ? 3 : 1;
  if (frame.width_px < least || frame.height_px < least || frame.format.bits < 8 || frame.format.bits > 16 ||
      frame.bytes.size() != frame_bytes(frame.width_px, frame.height_px, frame.format))
    return Error{ErrorCode::value_invalid,
                 std::to_string(frame.bytes.size()) + " bytes are no frame of " + std::to_string(frame.width_px) +
                     " x " + std::to_string(frame.height_px),
                 "frame " + std::to_string(frame.id), "check the pixel format of the camera"};
  const int depth = frame.format.bits > 8 ? CV_16U : CV_8U;
  cv::Mat samples(frame.height_px, frame.width_px, CV_MAKETYPE(depth, frame.format.samples_per_pixel()),
                  const_cast<std::uint8_t*>(frame.bytes.data()));
  if (method >= 0) {
    cv::Mat colour;
    cv::demosaicing(samples, colour, method);
    samples = colour;
  }
  return depth == CV_16U ? to_linear<std::uint16_t>(samples, frame.format.bits)
                         : to_linear<std::uint8_t>(samples, frame.format.bits);
}

} // namespace daylit
