#include <fstream>
#include <iostream>

#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "scene/core/atomic_file.h"
#include "sh/basis.h"

namespace daylit::bench {

nlohmann::json machine() {
  std::string processor = "unknown", line;
  std::ifstream cpu("/proc/cpuinfo");
  while (std::getline(cpu, line))
    if (line.rfind("model name", 0) == 0) {
      processor = line.substr(line.find(':') + 2);
      break;
    }
  return {{"processor", processor},
          {"compiler", "g++ " __VERSION__},
          {"vectors", sh::instruction_set()},
          {"version", DAYLIT_VERSION},
          {"clock", "thread CPU time, minimum of alternating repetitions"}};
}

Result<void> deliver(const nlohmann::json& document, const CommonOptions& options) {
  if (options.json)
    std::cout << document.dump() << '\n';
  if (options.output.empty())
    return {};
  return write_file_atomically(options.output, document.dump(1) + "\n");
}

} // namespace daylit::bench
