#include "runtime/cmd/live_routes.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <thread>
#include <utility>

namespace daylit {

namespace {

using namespace std::chrono_literals;
using Viewer = PictureBoard::Viewer;
using Wants = PictureBoard::Wants;

constexpr auto kSlice = 100ms, kEventEvery = 500ms, kSnapshotWait = 3000ms;
constexpr double kSilent_s = 10; ///< the longest that drawing one picture may take

HttpReply unavailable(const LiveStatus& status) {
  return {503, "text/plain; charset=utf-8", status.report().state + "\n"};
}

/// multipart/x-mixed-replace: each part takes the place of the one before.
HttpReply motion_jpeg(PictureBoard& board) {
  HttpReply reply{200, "multipart/x-mixed-replace; boundary=daylit", ""};
  reply.stream = [viewer = std::make_shared<Viewer>(board, Wants::view),
                  shown = std::uint64_t{0}]() mutable -> std::optional<std::string> {
    const auto picture = viewer->after(shown, kSlice);
    if (!picture)
      return "";
    shown = picture->index();
    const std::string& jpeg = picture->jpeg();
    return "--daylit\r\nContent-Type: image/jpeg\r\nContent-Length: " + std::to_string(jpeg.size()) + "\r\n\r\n" +
           jpeg + "\r\n";
  };
  return reply;
}

/// The next picture that is drawn: asking for it has it drawn.
template <class Encode>
HttpReply snapshot(PictureBoard& board, const LiveStatus& status, Wants wants, const std::string& type,
                   const Encode& encode) {
  std::uint64_t shown = board.last_index();
  Viewer viewer(board, wants);
  for (const auto end = std::chrono::steady_clock::now() + kSnapshotWait; std::chrono::steady_clock::now() < end;) {
    const auto picture = viewer.after(shown, kSlice);
    if (!picture)
      continue;
    shown = picture->index();
    if (const auto bytes = encode(*picture))
      return {200, type, std::string(bytes->begin(), bytes->end())};
  }
  return unavailable(status);
}

HttpReply events(const LiveStatus& status) {
  HttpReply reply{200, "text/event-stream", ""};
  reply.stream = [&status, next = std::chrono::steady_clock::now()]() mutable -> std::optional<std::string> {
    const auto now = std::chrono::steady_clock::now();
    if (now < next) {
      std::this_thread::sleep_for(std::min<std::chrono::steady_clock::duration>(next - now, kSlice));
      return "";
    }
    next = now + kEventEvery;
    return "event: status\ndata: " + to_json(status.report()) + "\n\n";
  };
  return reply;
}

HttpReply ready(const LiveStatus& status) {
  const LiveReport r = status.report();
  return r.interior.source.connected && r.sky.source.connections > 0
             ? HttpReply{200, "text/plain; charset=utf-8", "ready\n"}
             : unavailable(status);
}

} // namespace

std::vector<HttpRoute> live_routes(PictureBoard& board, const LiveStatus& status) {
  using Method = HttpRoute::Method;
  const auto png = [](const LivePicture& p) { return encoded_png(p.view()); };
  // The picture in hand may have been drawn before anybody asked for the linear one.
  const auto exr = [](const LivePicture& p) { return encoded_exr(p.linear()); };
  return {{Method::get, "/stream.mjpg", [&](const HttpRequest&) { return motion_jpeg(board); }},
          {Method::get, "/snapshot.png",
           [&, png](const HttpRequest&) { return snapshot(board, status, Wants::view, "image/png", png); }},
          {Method::get, "/snapshot.exr",
           [&, exr](const HttpRequest&) { return snapshot(board, status, Wants::linear, "image/x-exr", exr); }},
          {Method::get, "/status",
           [&](const HttpRequest&) {
             return HttpReply{200, "application/json", to_json(status.report())};
           }},
          {Method::get, "/events", [&](const HttpRequest&) { return events(status); }},
          {Method::get, "/metrics",
           [&](const HttpRequest&) {
             return HttpReply{200, "text/plain; version=0.0.4; charset=utf-8", to_prometheus(status.report())};
           }},
          {Method::get, "/healthz",
           [&](const HttpRequest&) {
             return status.silence_s() < kSilent_s ? HttpReply{200, "text/plain; charset=utf-8", "ok\n"}
                                                   : unavailable(status);
           }},
          {Method::get, "/readyz", [&](const HttpRequest&) { return ready(status); }}};
}

} // namespace daylit
