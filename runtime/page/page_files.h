#pragma once

#include <vector>

#include "runtime/http/http_server.h"

namespace daylit {

/// The page and everything that it loads, "/" first; compiled into the program.
std::vector<HttpRoute> page_files();

} // namespace daylit
