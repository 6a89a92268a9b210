#pragma once

// A small HTTP server for a table of routes: bounded in clients, memory and time, whatever the clients do.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/core/result.h"

namespace daylit {

struct HttpRequest {
  std::string path, body;
  std::map<std::string, std::string> query; ///< decoded; the last of equal names
};

/// Called again and again for what comes next; it may wait up to a tenth of a second. Empty text: nothing yet.
/// Nothing: the end.
using HttpStream = std::function<std::optional<std::string>()>;

struct HttpReply {
  int status = 200;
  std::string type = "text/plain; charset=utf-8", body;
  HttpStream stream{}; ///< if there is one, in the place of the body
};

struct HttpRoute {
  enum class Method { get, post };
  Method method = Method::get;
  std::string path; ///< the whole path, "/status"
  /// Called from several threads at once.
  std::function<HttpReply(const HttpRequest&)> handler;
};

struct HttpSettings {
  std::string address = "127.0.0.1";
  int port = 0;      ///< 0: any that is free
  std::string token; ///< needed for every change (POST), and for everything at an address that is not loopback
};

struct HttpCounts {
  std::uint64_t requests = 0, refused = 0; ///< refused: no room for another client
};

/// Serves from threads of its own until it goes; connections still open end then, within a tenth of a second.
///  - A request is a connection. A client gets three seconds to ask, and two without taking a byte to listen; 24 are
///    served at once, 12 of them streams, the next is answered 503. A request has 64 kB at most.
///  - The token comes as "Authorization: Bearer TOKEN" or as ?token=TOKEN. At a loopback address requests must name it
///    in Host, so that a page from elsewhere cannot reach it under a name of its own (DNS rebinding); a change whose
///    Origin is not this server is refused (cross-site request forgery).
class HttpServer {
public:
  /// Errors: device (another program listens there), value_invalid (the address is none of this machine, or not
  /// loopback and there is no token of 16 characters).
  static Result<std::unique_ptr<HttpServer>> start(const HttpSettings& settings, std::vector<HttpRoute> routes);
  virtual ~HttpServer() = default;
  virtual int port() const = 0;
  virtual HttpCounts counts() const = 0;
};

} // namespace daylit
