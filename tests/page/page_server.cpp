// Serves the page on the pictures of a CONFIG.toml, drawn again and again, until stdin ends. Prints the port.
// Usage: page_server CONFIG.toml TOKEN

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <mutex>
#include <string>
#include <thread>

#include <fmt/format.h>

#include "runtime/http/http_server.h"
#include "runtime/input/interior_input.h"
#include "runtime/page/page_files.h"
#include "runtime/page/scene_editor.h"
#include "runtime/page/scene_routes.h"
#include "scene/image/image_formats.h"

namespace daylit {
namespace {

/// The newest picture as JPEG.
class Picture {
public:
  void put(const Rgb8Image& image) {
    const auto jpeg = encoded_jpeg(image);
    const std::lock_guard lock(mutex_);
    if (jpeg)
      text_.assign(jpeg->begin(), jpeg->end());
  }
  HttpReply stream() {
    return {200, "multipart/x-mixed-replace; boundary=frame", "", [this]() -> std::optional<std::string> {
              std::this_thread::sleep_for(std::chrono::milliseconds(50));
              const std::lock_guard lock(mutex_);
              return fmt::format("--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n{}\r\n",
                                 text_.size(), text_);
            }};
  }

private:
  std::mutex mutex_;
  std::string text_;
};

/// What the daemon's /status has.
std::string status(const FrameReport& r, std::uint64_t frames) {
  std::string stages;
  for (const auto& [name, ms] : r.stage_ms)
    stages += fmt::format("\"{}\":{:.3f},", name, ms);
  const auto camera = [&](const char* cause) {
    return fmt::format(R"({{"connected":true,"trouble":"","frame_age_s":0.1,"whole":{0},"used":{0},"superseded":0,)"
                       R"("damaged":3,"missing":1,"refused":0,"black":0,"likely_cause":"{1}"}})",
                       frames, cause);
  };
  return fmt::format(
      R"({{"state":"drawing","pictures_per_s":20.0,"latency_ms":{{"median":40,"p99":60}},"sky_age_s":0.1,)"
      R"("tracking":"measured","stage_ms":{{{}"total":{}}},"sky":{},"interior":{},"warnings":[]}})",
      stages, r.total_ms, camera(""), camera("packets are lost: use a larger packet_size"));
}

Result<void> serve(const std::string& file, const std::string& token) {
  auto config = read_run_config(file);
  if (!config)
    return config.error();
  const auto interior = read_interior(*config);
  const auto sky = read_sky(config->sky);
  if (!interior || !sky)
    return interior ? sky.error() : interior.error();
  config->world_from_camera = interior->world_from_camera;
  const PhotoPixels photo = interior->photo.pixels();
  auto session = Session::open(*config, photo.width(), photo.height(), [](const std::string&, double) { return true; });
  if (!session)
    return session.error();
  float brightest = 0;
  for (const Rgb& c : photo.copy().texels)
    brightest = std::max(brightest, c.g);
  const float exposure = 1.0f / brightest;
  SessionDesk desk;
  SceneEditor editor(desk, file, *config);
  Picture picture;
  std::mutex mutex;
  std::string status_text;
  auto routes = page_files();
  for (HttpRoute& route : scene_routes(desk, editor))
    routes.push_back(std::move(route));
  routes.push_back({HttpRoute::Method::get, "/stream.mjpg", [&](const HttpRequest&) { return picture.stream(); }});
  routes.push_back({HttpRoute::Method::get, "/status", [&](const HttpRequest&) {
                      const std::lock_guard lock(mutex);
                      return HttpReply{200, "application/json", status_text};
                    }});
  auto server = HttpServer::start({"127.0.0.1", 0, token}, std::move(routes));
  if (!server)
    return server.error();
  std::printf("%d\n", (*server)->port());
  std::fflush(stdout);
  std::atomic<bool> over = false;
  std::thread([&over] {
    char c;
    while (::read(0, &c, 1) > 0) {
    }
    over = true;
  }).detach();
  for (std::uint64_t frames = 1; !over; ++frames) {
    const auto frame = session->render({*sky, photo, frames, frames});
    if (!frame)
      return frame.error();
    picture.put(to_srgb8((*frame)->composite.picture, exposure));
    {
      const std::lock_guard lock(mutex);
      status_text = status((*frame)->report, frames);
    }
    desk.serve({*session, &*sky});
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  std::_Exit(0); // the thread that reads stdin is still there
}

} // namespace
} // namespace daylit

int main(int argc, char** argv) {
  if (argc != 3)
    return 2;
  const auto done = daylit::serve(argv[1], argv[2]);
  if (!done)
    std::fprintf(stderr, "%s\n", done.error().message().c_str());
  return done ? 0 : 1;
}
