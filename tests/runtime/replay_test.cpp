#include "runtime/live/replay.h"

#include <cstring>
#include <fstream>
#include <iterator>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "capture/frames/recording.h"
#include "scene/image/image_formats.h"
#include "test_session.h"

namespace daylit {
namespace {

constexpr std::int64_t kFrame_ns = 40'000'000;

CameraFrame to_16_bits(const RgbImage& picture, float largest, std::uint64_t id, std::int64_t time_ns) {
  CameraFrame frame{picture.width, picture.height, {Mosaic::rgb, 16}, {}, id, time_ns, 1000.0};
  for (const Rgb& t : picture.texels)
    for (int c = 0; c < 3; ++c) {
      const auto code = static_cast<unsigned>(std::lround(65535 * std::clamp(t[c] / largest, 0.0f, 1.0f)));
      frame.bytes.push_back(static_cast<std::uint8_t>(code));
      frame.bytes.push_back(static_cast<std::uint8_t>(code >> 8));
    }
  return frame;
}

/// Five interior frames; the sky arrives at half the rate, from the second frame on half as bright.
struct RecordedStudio : test::Studio {
  static constexpr float kSkyRange = 4.0f;
  RecordedStudio() {
    config.output.png = folder / "out.png";
    config.output.exr = folder / "out.exr";
    config.interior.scale = 1.0 / double(kSkyRange);
    auto interior = RecordingWriter::create(folder / "tape/interior");
    auto outside = RecordingWriter::create(folder / "tape/sky");
    RgbImage radiance(sky.width, sky.height);
    radiance.texels = sky.radiance;
    for (std::uint64_t k = 0; k < 5; ++k) {
      (void)interior->add(to_16_bits(photo, 1.0f, 100 + k, std::int64_t(k) * kFrame_ns));
      if (k % 2 == 0)
        (void)outside->add(
            to_16_bits(radiance, k < 2 ? kSkyRange : 2 * kSkyRange, 7 + k, std::int64_t(k) * kFrame_ns - 5'000'000));
    }
  }
  Result<std::vector<DrawnFrame>> replay(int most = 0) const {
    std::vector<DrawnFrame> frames;
    const auto done = replay_recording(config, {folder / "tape", most, Backend::rays},
                                       [&](const DrawnFrame& f) { frames.push_back(f); });
    if (!done)
      return done.error();
    return frames;
  }
  std::string bytes(const std::string& name) const {
    std::ifstream file(folder / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
};

TEST(Replay, each_frame_is_drawn_under_the_newest_sky_of_its_time) {
  const RecordedStudio studio;
  const auto frames = studio.replay();
  ASSERT_TRUE(frames) << frames.error().message();
  ASSERT_EQ(frames->size(), 5u);
  for (std::size_t k = 0; k < 5; ++k) {
    EXPECT_EQ((*frames)[k].interior_id, 100 + k);
    EXPECT_EQ((*frames)[k].sky_id, 7 + k / 2 * 2);
    EXPECT_NEAR((*frames)[k].sky_age_s, 0.005 + 0.04 * static_cast<double>(k % 2), 1e-9);
    EXPECT_TRUE((*frames)[k].drawn);
  }
  const auto picture = [&](int k) { return read_hdr_image(studio.folder / ("out-0000" + std::to_string(k) + ".exr")); };
  const auto bright = picture(0), dark = picture(2);
  ASSERT_TRUE(bright && dark);
  // The object is lit by the sky alone, which became half as bright.
  auto session = studio.open(Backend::rays);
  const auto frame = studio.render(*session);
  ASSERT_TRUE(frame);
  std::size_t checked = 0;
  for (std::size_t i = 0; i < studio.photo.texels.size(); ++i)
    if (frame->composite.coverage[i] == 1.0f && bright->radiance.texels[i].g > 0.01f) {
      EXPECT_NEAR(dark->radiance.texels[i].g / bright->radiance.texels[i].g, 0.5f, 0.01f) << i;
      ++checked;
    }
  EXPECT_GT(checked, 50u);
}

TEST(Replay, the_same_recording_gives_the_same_bits) {
  const RecordedStudio studio;
  ASSERT_TRUE(studio.replay());
  std::vector<std::string> first;
  for (const char* name : {"out-00000.png", "out-00004.png", "out-00004.exr"})
    first.push_back(studio.bytes(name));
  ASSERT_TRUE(studio.replay());
  EXPECT_GT(first[0].size(), 100u);
  EXPECT_EQ(first,
            (std::vector{studio.bytes("out-00000.png"), studio.bytes("out-00004.png"), studio.bytes("out-00004.exr")}));
  EXPECT_EQ(studio.replay(2)->size(), 2u);
}

TEST(Replay, a_frame_without_its_marker_is_left_as_it_is_and_called_lost) {
  RecordedStudio studio;
  studio.config.world_from_camera.reset();
  studio.config.marker = MarkerConfig{};
  studio.config.marker->ids = {23};
  const auto frames = studio.replay(1);
  ASSERT_TRUE(frames) << frames.error().message();
  EXPECT_EQ((*frames)[0].tracking, TrackingState::lost);
  EXPECT_FALSE((*frames)[0].drawn);
  const auto picture = read_hdr_image(studio.folder / "out-00000.exr");
  ASSERT_TRUE(picture);
  for (std::size_t i = 0; i < studio.photo.texels.size(); ++i)
    EXPECT_NEAR(picture->radiance.texels[i].g, studio.photo.texels[i].g, 1e-5f);
}

TEST(Replay, a_missing_recording_is_an_error_that_names_it) {
  const RecordedStudio studio;
  std::filesystem::remove_all(studio.folder / "tape/sky");
  const auto frames = studio.replay();
  ASSERT_FALSE(frames);
  EXPECT_NE(frames.error().message().find("tape/sky"), std::string::npos) << frames.error().message();
}

TEST(Replay, frames_are_drawn_with_the_newest_depth_picture_of_their_time) {
  const RecordedStudio studio;
  auto tape = RecordingWriter::create(studio.folder / "tape/depth");
  ASSERT_TRUE(tape);
  // From the third frame on something stands 0.3 m before the camera.
  CameraFrame sheet{RecordedStudio::kWidth, RecordedStudio::kHeight, {Mosaic::mono, 16}, {}, 1, 2 * kFrame_ns - 1, 0.0};
  for (int i = 0; i < RecordedStudio::kWidth * RecordedStudio::kHeight; ++i)
    sheet.bytes.insert(sheet.bytes.end(), {300 & 255, 300 >> 8});
  ASSERT_TRUE(tape->add(sheet));
  const auto frames = studio.replay();
  ASSERT_TRUE(frames) << frames.error().message();
  const auto before = read_hdr_image(studio.folder / "out-00001.exr"),
             behind = read_hdr_image(studio.folder / "out-00002.exr");
  ASSERT_TRUE(before && behind);
  std::size_t drawn = 0, drawn_behind = 0;
  for (std::size_t i = 0; i < studio.photo.texels.size(); ++i) {
    drawn += glm::length(before->radiance.texels[i] - studio.photo.texels[i]) > 1e-3f;
    drawn_behind += glm::length(behind->radiance.texels[i] - studio.photo.texels[i]) > 1e-3f;
  }
  EXPECT_GT(drawn, 200u);
  EXPECT_EQ(drawn_behind, 0u);
}

TEST(Replay, depth_in_colour_is_refused) {
  const RecordedStudio studio;
  auto tape = RecordingWriter::create(studio.folder / "tape/depth");
  ASSERT_TRUE(tape);
  ASSERT_TRUE(tape->add(to_16_bits(studio.photo, 1.0f, 1, 0)));
  const auto frames = studio.replay(1);
  ASSERT_FALSE(frames);
  EXPECT_NE(frames.error().message().find("not a grey picture of more than 8 bits"), std::string::npos)
      << frames.error().message();
}

} // namespace
} // namespace daylit
