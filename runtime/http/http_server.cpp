#include "runtime/http/http_server.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>

#include <httplib.h>

#include "runtime/http/detail/connection.h"

namespace daylit {

namespace {

constexpr std::size_t kMostClients = 24, kMostStreams = 12, kShortestToken = 16;
constexpr int kBacklog = 128;
constexpr int kSendBufferBytes = 256 * 1024; ///< a slow viewer sees a picture of a second ago, not of a minute ago

thread_local bool no_room = false; ///< the connection in hand is one too many

/// A thread for each client. One too many is handled at once, by the thread that accepts, to be refused.
class ClientThreads final : public httplib::TaskQueue {
public:
  ClientThreads() {
    for (std::size_t k = 0; k < kMostClients; ++k)
      threads_.emplace_back([this] { work(); });
  }
  void enqueue(std::function<void()> serve) override {
    {
      const std::lock_guard lock(mutex_);
      if (clients_ < kMostClients) {
        ++clients_;
        jobs_.push_back(std::move(serve));
        come_.notify_one();
        return;
      }
    }
    no_room = true;
    serve();
    no_room = false;
  }
  void shutdown() override {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    come_.notify_all();
    for (std::thread& thread : threads_)
      thread.join();
  }

private:
  void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      come_.wait(lock, [&] { return over_ || !jobs_.empty(); });
      if (jobs_.empty())
        return;
      const auto serve = std::move(jobs_.front());
      jobs_.pop_front();
      lock.unlock();
      serve();
      lock.lock();
      --clients_;
    }
  }

  std::mutex mutex_;
  std::condition_variable come_;
  std::deque<std::function<void()>> jobs_;
  std::size_t clients_ = 0; ///< served, or waiting for a thread that has just served
  bool over_ = false;
  std::vector<std::thread> threads_;
};

bool is_loopback_name(std::string_view host) {
  if (host.starts_with('['))
    return host.substr(0, host.find(']')) == "[::1";
  host = host.substr(0, host.find(':'));
  const auto numeric = [](char c) { return c == '.' || (c >= '0' && c <= '9'); };
  return host == "localhost" || (host.starts_with("127.") && std::all_of(host.begin(), host.end(), numeric));
}

bool is_loopback_address(const std::string& address) { return address == "::1" || is_loopback_name(address); }

/// In a time that does not tell how much of it is right.
bool same_secret(std::string_view a, std::string_view b) {
  unsigned different = a.size() != b.size();
  for (std::size_t i = 0; i < a.size(); ++i)
    different |=
        static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i % std::max<std::size_t>(b.size(), 1)]);
  return !b.empty() && different == 0;
}

/// A stream counts from here to the end of its connection.
class StreamPlace {
public:
  explicit StreamPlace(std::atomic<std::size_t>& streams) : streams_(streams), has_place_(++streams <= kMostStreams) {}
  ~StreamPlace() { --streams_; }
  StreamPlace(const StreamPlace&) = delete;
  StreamPlace& operator=(const StreamPlace&) = delete;
  bool has_place() const { return has_place_; }

private:
  std::atomic<std::size_t>& streams_;
  bool has_place_;
};

class Server final : public HttpServer, private httplib::Server {
public:
  Server(HttpSettings settings, std::vector<HttpRoute> routes)
      : settings_(std::move(settings)), routes_(std::move(routes)), loopback_(is_loopback_address(settings_.address)) {
    new_task_queue = [] { return new ClientThreads; };
    set_socket_options([](socket_t socket) { // the default would let a second program listen at the same port
      const int yes = 1, bytes = kSendBufferBytes;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
      setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof(bytes));
    });
    set_payload_max_length(64 * 1024);
    set_default_headers(
        {{"Cache-Control", "no-store"},
         {"X-Content-Type-Options", "nosniff"},
         {"Content-Security-Policy", "default-src 'self'; img-src 'self' blob: data:; frame-ancestors 'none'"}});
    set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      return before_body(request, response);
    });
    for (const HttpRoute& route : routes_)
      if (route.method == HttpRoute::Method::post)
        Post(route.path, [this, &route](const httplib::Request& request, httplib::Response& response) {
          answer(route, request, response);
        });
  }
  ~Server() override {
    stopping_ = true;
    if (listener_.joinable()) {
      stop();
      listener_.join();
    }
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  Result<void> begin() {
    errno = 0;
    if (settings_.port == 0)
      port_ = bind_to_any_port(settings_.address);
    else
      port_ = bind_to_port(settings_.address, settings_.port) ? settings_.port : -1;
    if (port_ < 0)
      return cannot_listen(errno);
    ::listen(svr_sock_, kBacklog); // the library's five lose the sixth of clients that come at once for a second
    listener_ = std::thread([this] { listen_after_bind(); });
    while (!is_running())
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return {};
  }
  int port() const override { return port_; }
  HttpCounts counts() const override { return {requests_, refused_}; }

private:
  /// `why`: the errno of the attempt.
  Error cannot_listen(int why) const {
    const std::string what = "cannot listen at port " + std::to_string(settings_.port);
    if (why == EADDRINUSE)
      return {ErrorCode::device, what + ": another program listens there", settings_.address,
              "end it (another daylit-run?), or choose another [http] port"};
    if (why == EACCES)
      return {ErrorCode::value_invalid, what + ": it is reserved", settings_.address,
              "choose [http] port from 1024 up"};
    return {ErrorCode::value_invalid, what + ": it is no address of this machine", settings_.address,
            "set [http] address to one of those that ip addr shows, 0.0.0.0 for all of them"};
  }

  using Handled = httplib::Server::HandlerResponse;

  /// Every connection comes through here.
  bool process_and_close_socket(socket_t socket) override {
    detail::Connection connection(socket, stopping_);
    if (no_room) {
      ++refused_;
      constexpr std::string_view kText = "HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nRetry-After: 1\r\n"
                                         "Connection: close\r\n\r\n";
      return connection.write(kText.data(), kText.size()) > 0;
    }
    bool closed = false;
    return process_request(connection, true, closed, [](httplib::Request& request) {
      request.ranges.clear(); // nothing is worth a part, and many parts of one picture fill the memory
      request.headers.erase("Range");
      request.headers.erase("Accept-Encoding"); // pictures are packed already; text is short
    });
  }

  static void refuse(httplib::Response& response, int status, const std::string& why) {
    response.status = status;
    response.set_content(why + "\n", "text/plain; charset=utf-8");
  }

  /// Why a request is not answered; empty: it is.
  std::pair<int, std::string> refusal(const httplib::Request& request, bool change) const {
    const std::string host = request.get_header_value("Host");
    if (loopback_ && !is_loopback_name(host))
      return {403, "the name of the server is localhost"};
    if (const std::string origin = request.get_header_value("Origin");
        change && !origin.empty() && origin != "http://" + host && origin != "https://" + host)
      return {403, "changes are taken from this server's own page only"};
    if (change && settings_.token.empty())
      return {403, "changes need a token: set [http] token_file"};
    const std::string bearer = "Bearer ", given = request.get_header_value("Authorization");
    const std::string token =
        given.starts_with(bearer) ? given.substr(bearer.size()) : request.get_param_value("token");
    if ((change || !loopback_) && !same_secret(token, settings_.token))
      return {401, "the token is missing or wrong"};
    return {200, ""};
  }

  /// Before the body of a change is read. Paths are compared as texts: no pattern runs over what a client sends.
  Handled before_body(const httplib::Request& request, httplib::Response& response) {
    ++requests_;
    const bool change = request.method == "POST";
    const bool known = change || request.method == "GET" || request.method == "HEAD";
    const auto route = std::find_if(routes_.begin(), routes_.end(), [&](const HttpRoute& r) {
      return r.path == request.path && (r.method == HttpRoute::Method::post) == change;
    });
    if (const auto [status, why] = refusal(request, change); !why.empty())
      refuse(response, status, why);
    else if (!known)
      refuse(response, 405, "GET or POST");
    else if (route == routes_.end())
      refuse(response, 404, "nothing is here");
    else if (change)
      return Handled::Unhandled;
    else
      answer(*route, request, response);
    return Handled::Handled;
  }

  void answer(const HttpRoute& route, const httplib::Request& request, httplib::Response& response) {
    HttpRequest asked{request.path, request.body, {}};
    for (const auto& [name, value] : request.params)
      asked.query[name] = value;
    HttpReply reply = route.handler(asked);
    response.status = reply.status;
    if (!reply.stream) {
      response.set_content(std::move(reply.body), reply.type);
      return;
    }
    const auto place = std::make_shared<StreamPlace>(streams_);
    if (!place->has_place()) {
      ++refused_;
      return refuse(response, 503, "too many are watching");
    }
    response.set_content_provider(
        reply.type, [this, place, next = std::move(reply.stream)](std::size_t, httplib::DataSink& sink) {
          const auto piece = next();
          if (!piece || stopping_)
            sink.done();
          return piece && !stopping_ && (piece->empty() || sink.write(piece->data(), piece->size()));
        });
  }

  const HttpSettings settings_;
  const std::vector<HttpRoute> routes_;
  const bool loopback_;
  std::atomic<bool> stopping_ = false;
  std::atomic<std::uint64_t> requests_ = 0, refused_ = 0;
  std::atomic<std::size_t> streams_ = 0;
  int port_ = -1;
  std::thread listener_;
};

} // namespace

Result<std::unique_ptr<HttpServer>> HttpServer::start(const HttpSettings& settings, std::vector<HttpRoute> routes) {
  if (!settings.token.empty() && settings.token.size() < kShortestToken)
    return Error{ErrorCode::value_invalid, "the token is shorter than 16 characters", "[http] token_file",
                 "make one with: openssl rand -hex 16"};
  if (settings.token.empty() && !is_loopback_address(settings.address))
    return Error{ErrorCode::value_invalid, "other machines may reach it, and there is no token", "[http] address",
                 "set [http] token_file, or the address 127.0.0.1"};
  auto server = std::make_unique<Server>(settings, std::move(routes));
  if (const auto begun = server->begin(); !begun)
    return begun.error();
  return std::unique_ptr<HttpServer>(std::move(server));
}

} // namespace daylit
