#pragma once

#include <vector>

#include "runtime/http/http_server.h"
#include "runtime/live/live_status.h"
#include "runtime/live/picture_board.h"

namespace daylit {

/// What a live run shows over HTTP; board and status must outlive the server. All in one table:
///   /stream.mjpg   pictures as motion JPEG, each as soon as it is drawn
///   /snapshot.png, /snapshot.exr   the next picture, in the photograph's code values, or linear
///   /status        JSON; /events: the same, twice a second (server-sent events)
///   /metrics       for Prometheus
///   /healthz       200 while the run goes on; /readyz: 200 while there are pictures to be seen
std::vector<HttpRoute> live_routes(PictureBoard& board, const LiveStatus& status);

} // namespace daylit
