// The server against clients of plain sockets: polite ones, and all the others.

#include "runtime/http/http_server.h"

#include <atomic>
#include <random>
#include <thread>

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "scene/core/seconds.h"

namespace daylit {
namespace {

using namespace std::chrono_literals;

constexpr const char* kToken = "0123456789abcdef";

/// A socket to the server; reads give up after five seconds.
class Client {
public:
  explicit Client(int port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
    const timeval patience{5, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    connected_ = connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof(to)) == 0;
  }
  ~Client() { close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  bool send(const std::string& text) const {
    return connected_ && ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  /// Up to `most` bytes, or all until the server closes.
  std::string read(std::size_t most = 1 << 20) const {
    std::string text;
    char buffer[4096];
    for (ssize_t got = 0; text.size() < most && (got = recv(socket_, buffer, sizeof(buffer), 0)) > 0;)
      text.append(buffer, static_cast<std::size_t>(got));
    return text;
  }

private:
  int socket_;
  bool connected_ = false;
};

class HttpServerTest : public testing::Test {
protected:
  void start(const std::string& token = "") {
    auto server = HttpServer::start({"127.0.0.1", 0, token}, routes());
    ASSERT_TRUE(server) << server.error().message();
    server_ = std::move(*server);
  }
  std::vector<HttpRoute> routes() {
    using Method = HttpRoute::Method;
    return {{Method::get, "/hello",
             [](const HttpRequest& r) {
               return HttpReply{200, "text/plain", "hello " + (r.query.contains("who") ? r.query.at("who") : "")};
             }},
            {Method::get, "/flow",
             [this](const HttpRequest&) {
               HttpReply reply{200, "text/event-stream", ""};
               reply.stream = [this, alive = std::make_shared<int>(++viewers_)]() -> std::optional<std::string> {
                 std::this_thread::sleep_for(1ms);
                 return std::string(piece_bytes_, 'x');
               };
               return reply;
             }},
            {Method::post, "/change", [this](const HttpRequest& r) {
               changed_ += r.body;
               return HttpReply{200, "text/plain", "done"};
             }}};
  }
  std::string ask(const std::string& request) const {
    const Client client(server_->port());
    client.send(request);
    return client.read();
  }
  std::string get(const std::string& target, const std::string& headers = "") const {
    return ask("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n");
  }
  std::string post(const std::string& body, const std::string& headers = "") const {
    return ask("POST /change HTTP/1.1\r\nHost: localhost\r\n" + headers +
               "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  }
  static int status(const std::string& reply) { return reply.size() > 12 ? std::atoi(reply.c_str() + 9) : 0; }

  std::atomic<std::size_t> piece_bytes_ = 10;
  std::atomic<int> viewers_ = 0;
  std::string changed_;
  std::unique_ptr<HttpServer> server_;
};

TEST_F(HttpServerTest, answers_its_routes_and_nothing_else) {
  start();
  const std::string reply = get("/hello?who=a%20b&x=1");
  EXPECT_EQ(status(reply), 200) << reply;
  EXPECT_NE(reply.find("\r\n\r\nhello a b"), std::string::npos) << reply;
  for (const char* path : {"/", "/hello/", "/hello/../etc/passwd", "/../../etc/passwd", "//etc/passwd", "/HELLO"})
    EXPECT_EQ(status(get(path)), 404) << path;
  EXPECT_EQ(status(ask("DELETE /hello HTTP/1.1\r\nHost: localhost\r\n\r\n")), 405);
}

TEST_F(HttpServerTest, a_change_needs_the_token_and_comes_from_no_other_page) {
  start(kToken);
  const std::string bearer = std::string("Authorization: Bearer ") + kToken + "\r\n";
  EXPECT_EQ(status(post("a")), 401);
  EXPECT_EQ(status(post("b", "Authorization: Bearer 0123456789abcdeX\r\n")), 401);
  EXPECT_EQ(status(post("c", bearer + "Origin: http://elsewhere.example\r\n")), 403);
  EXPECT_EQ(changed_, "");
  EXPECT_EQ(status(post("d", bearer)), 200);
  EXPECT_EQ(status(post("e", bearer + "Origin: http://localhost\r\n")), 200);
  EXPECT_EQ(changed_, "de");
  EXPECT_EQ(status(get("/hello")), 200) << "at a loopback address looking is free";
  server_.reset();
  start();
  EXPECT_EQ(status(post("f", bearer)), 403) << "without a token there are no changes";
}

TEST_F(HttpServerTest, a_page_under_another_name_does_not_reach_it) {
  start();
  EXPECT_EQ(status(ask("GET /hello HTTP/1.1\r\nHost: evil.example\r\n\r\n")), 403);
  EXPECT_EQ(status(ask("GET /hello HTTP/1.1\r\nHost: 127.0.0.1.evil.example\r\n\r\n")), 403);
  EXPECT_EQ(status(ask("GET /hello HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(server_->port()) + "\r\n\r\n")), 200);
}

TEST_F(HttpServerTest, another_address_needs_a_token_for_everything) {
  EXPECT_FALSE(HttpServer::start({"0.0.0.0", 0, ""}, routes()));
  EXPECT_FALSE(HttpServer::start({"0.0.0.0", 0, "short"}, routes()));
  auto open = HttpServer::start({"0.0.0.0", 0, kToken}, routes());
  ASSERT_TRUE(open) << open.error().message();
  server_ = std::move(*open);
  EXPECT_EQ(status(get("/hello")), 401);
  EXPECT_EQ(status(get(std::string("/hello?token=") + kToken)), 200);
}

TEST_F(HttpServerTest, a_port_in_use_is_an_error) {
  start();
  const auto second = HttpServer::start({"127.0.0.1", server_->port(), ""}, routes());
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message().find(std::to_string(server_->port())), std::string::npos);
}

TEST_F(HttpServerTest, it_ends_at_once_whatever_its_clients_do) {
  start();
  piece_bytes_ = 100'000;
  const Client silent(server_->port()), reading(server_->port()), deaf(server_->port());
  silent.send("GET /hel");
  for (const Client* c : {&reading, &deaf})
    c->send("GET /flow HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(reading.read(500).substr(0, 15), "HTTP/1.1 200 OK");
  const double begin = wall_seconds();
  server_.reset();
  EXPECT_LT(wall_seconds() - begin, 0.4);
}

TEST_F(HttpServerTest, viewers_beyond_its_places_are_refused_and_short_requests_still_answered) {
  start();
  std::vector<std::unique_ptr<Client>> watching;
  for (int k = 0; k < 12; ++k) {
    watching.push_back(std::make_unique<Client>(server_->port()));
    watching.back()->send("GET /flow HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_EQ(status(watching.back()->read(20)), 200);
  }
  EXPECT_EQ(status(get("/flow")), 503);
  EXPECT_EQ(status(get("/hello")), 200);
  // The rest of its places taken by clients that say nothing: the next is told so at once.
  for (int k = 0; k < 12; ++k)
    watching.push_back(std::make_unique<Client>(server_->port()));
  const double begin = wall_seconds();
  int answered = 200;
  for (; answered == 200 && wall_seconds() - begin < 1;)
    answered = status(get("/hello"));
  EXPECT_EQ(answered, 503);
  EXPECT_GE(server_->counts().refused, 2u);
}

TEST_F(HttpServerTest, malformed_requests_do_no_harm) {
  start(kToken);
  const std::string good = "GET /hello?who=me HTTP/1.1\r\nHost: localhost\r\nRange: bytes=0-1,2-3\r\n"
                           "Accept-Encoding: gzip\r\nContent-Length: 3\r\n\r\nabc";
  std::string ranges = "GET /hello HTTP/1.1\r\nHost: localhost\r\nRange: bytes=0-";
  for (int k = 0; k < 2000; ++k)
    ranges += ",0-";
  EXPECT_NE(status(ask(ranges + "\r\n\r\n")), 206);
  ask("GET /" + std::string(100'000, 'a') + " HTTP/1.1\r\n\r\n");
  ask(std::string(200'000, '\n'));
  std::mt19937 random(7);
  for (int k = 0; k < 300; ++k) {
    std::string text = good;
    for (int change = 0; change < 1 + k % 8; ++change)
      text[random() % text.size()] = static_cast<char>(random());
    const Client client(server_->port());
    client.send(text.substr(0, random() % text.size() + 1)); // and goes away
  }
  int answered = 503; // until the last of them is served
  for (const double begin = wall_seconds(); answered == 503 && wall_seconds() - begin < 10;)
    answered = status(get("/hello"));
  EXPECT_EQ(answered, 200);
}

} // namespace
} // namespace daylit
