// The window and its OpenGL, on a display server of the test's own (Xvfb) where the machine has no display.

#include <csignal>
#include <cstdlib>

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <unistd.h>

#include "runtime/cmd/local_viewers.h"
#include "runtime/gl/gl_context.h"
#include "runtime/window/view_window.h"
#include "runtime/window/viewer.h"
#include "test_session.h"

namespace daylit {
namespace {

using test::Studio;

/// A display without a screen; ends with the process.
class Display : public testing::Environment {
public:
  void SetUp() override {
    if (std::getenv("DISPLAY"))
      return;
    int pipe_ends[2];
    ASSERT_EQ(pipe(pipe_ends), 0);
    if (fork() == 0) {
      prctl(PR_SET_PDEATHSIG, SIGTERM); // it outlives GLFW, which is ended with the process
      const std::string number = std::to_string(pipe_ends[1]);
      close(pipe_ends[0]);
      execlp("Xvfb", "Xvfb", "-displayfd", number.c_str(), "-screen", "0", "640x480x24", "-nolisten", "tcp",
             static_cast<char*>(nullptr));
      _exit(127);
    }
    close(pipe_ends[1]);
    std::string name = ":";
    for (char c = 0; read(pipe_ends[0], &c, 1) == 1 && c != '\n';)
      name += c;
    close(pipe_ends[0]);
    if (name.size() > 1)
      setenv("DISPLAY", name.c_str(), 1);
  }
};
const auto* const kDisplay = testing::AddGlobalTestEnvironment(new Display);

class Window : public testing::Test {
protected:
  void SetUp() override {
    if (!std::getenv("DISPLAY"))
      GTEST_SKIP() << "no display, and no Xvfb to make one (apt-get install xvfb)";
  }
};

TEST_F(Window, its_opengl_draws_what_egl_draws) {
  Studio studio;
  const auto egl = studio.render(Backend::opengl), window = studio.render(Backend::window);
  ASSERT_TRUE(egl) << egl.error().message();
  ASSERT_TRUE(window) << window.error().message();
  std::size_t same = 0, drawn = 0;
  const float white = 0.4f; // of the photograph
  for (std::size_t i = 0; i < studio.photo.texels.size(); ++i) {
    const Rgb d = glm::abs(egl->composite.picture.texels[i] - window->composite.picture.texels[i]);
    same += std::max({d.r, d.g, d.b}) <= white / 255.0f;
    drawn += window->composite.touched[i] == 2;
  }
  EXPECT_GE(static_cast<double>(same), 0.999 * static_cast<double>(studio.photo.texels.size()));
  EXPECT_GT(drawn, 100u);
}

TEST_F(Window, shows_pictures_of_its_size_only) {
  auto window = ViewWindow::open(64, 48, "test");
  ASSERT_TRUE(window) << window.error().message();
  const Rgb8Image picture{64, 48, std::vector<std::uint8_t>(3 * 64 * 48, 99)};
  for (int k = 0; k < 3; ++k) {
    const auto open = window->show(picture);
    ASSERT_TRUE(open) << open.error().message();
    EXPECT_TRUE(*open);
  }
  EXPECT_FALSE(window->show({32, 48, std::vector<std::uint8_t>(3 * 32 * 48)}));
}

TEST_F(Window, a_live_window_has_pictures_drawn_and_follows_them_whatever_their_size) {
  PictureBoard board;
  {
    auto window = LocalViewers::open(board, true, "", 64, 48);
    ASSERT_TRUE(window) << window.error().message();
    EXPECT_EQ(board.viewers(), 1) << "or nothing would be drawn";
    for (const auto& [width, height] : {std::pair{64, 48}, {32, 48}, {64, 40}}) {
      board.publish({width, height, std::vector<std::uint8_t>(3 * static_cast<std::size_t>(width) * height, 99)}, {});
      const auto open = (*window)->follow();
      ASSERT_TRUE(open) << open.error().message();
      EXPECT_TRUE(*open);
    }
  }
  EXPECT_EQ(board.viewers(), 0);
}

TEST_F(Window, viewer_draws_frames_until_it_has_enough) {
  Studio studio;
  auto session = studio.open(Backend::window); // its context and the viewer's own take turns
  ASSERT_TRUE(session) << session.error().message();
  const auto sky = test::sky_image(studio.sky);
  ASSERT_TRUE(sky);
  int frames = 0;
  std::size_t changed = 0;
  const auto encode = [&](const RgbImage& picture) {
    ++frames;
    for (std::size_t i = 0; i < picture.texels.size(); ++i)
      changed += picture.texels[i] != studio.photo.texels[i];
    return to_srgb8(picture, 1.0f);
  };
  const auto done = run_viewer(
      *session, *sky, {studio.photo}, encode, [] {}, 4);
  ASSERT_TRUE(done) << done.error().message();
  EXPECT_EQ(frames, 4);
  EXPECT_GT(changed, 400u);
}

TEST(ShownParts, direct_and_indirect_light_add_up_and_without_the_differential_part_the_photograph_stays) {
  Studio studio;
  auto session = studio.open(Backend::rays);
  ASSERT_TRUE(session) << session.error().message();
  const auto frame_of = [&](const ShownParts& parts) {
    session->show(parts);
    return *studio.render(*session);
  };
  const Frame all = frame_of({}), direct = frame_of({true, false, true}), indirect = frame_of({false, true, true}),
              plain = frame_of({true, true, false});
  std::size_t shadows = 0;
  for (std::size_t i = 0; i < studio.photo.texels.size(); ++i) {
    if (all.composite.coverage[i] >= 1.0f) {
      const float sum = direct.composite.picture.texels[i].g + indirect.composite.picture.texels[i].g;
      EXPECT_NEAR(sum, all.composite.picture.texels[i].g, 0.004f * sum); // small changes are not written
    }
    shadows += all.composite.touched[i] == 1;
    EXPECT_NE(plain.composite.touched[i], 1);
  }
  EXPECT_GT(shadows, 50u);
}

} // namespace
} // namespace daylit
