#include "runtime/cmd/doctor_command.h"

#include <cstdio>
#include <string>

#include <nlohmann/json.hpp>

#include "runtime/doctor/doctor.h"
#include "scene/core/command_line.h"
#include "scene/core/program.h"
#include "scene/core/prompt_exit.h"

namespace daylit {

namespace {

const char* name_of(Finding::Level level) {
  switch (level) {
  case Finding::Level::ok:
    return "ok";
  case Finding::Level::warning:
    return "warning";
  case Finding::Level::error:
    break;
  }
  return "error";
}

void print(const Finding& f, bool json) {
  if (json)
    std::printf("%s\n",
                nlohmann::ordered_json{
                    {"level", name_of(f.level)}, {"subject", f.subject}, {"found", f.found}, {"change", f.change}}
                    .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)
                    .c_str());
  else
    std::printf("%-8s %s: %s\n%s%s%s", name_of(f.level), f.subject.c_str(), f.found.c_str(),
                f.change.empty() ? "" : "         -> ", f.change.c_str(), f.change.empty() ? "" : "\n");
}

} // namespace

int doctor_command(int argc, char** argv) {
  std::string config;
  bool quiet = false, json = false;
  CLI::App app{
      "Says what stands between a configuration and its picture on this machine, and what to change: cameras,\n"
      "network, lens files, volume and room, objects, graphics, disks. Exit code 1: something must be changed.",
      "daylit-run doctor"};
  app.add_option("CONFIG", config, "CONFIG.toml")->required();
  app.add_flag("--quiet", quiet, "warnings and errors only");
  app.add_flag("--json", json, "one JSON object per finding: level (ok, warning, error), subject, found, change");
  if (const auto code = parse_command_line(app, argc, argv))
    return *code;
  const PromptExit at_interrupt;
  bool failed = false;
  const int code = run_program("daylit-run doctor", json, [&]() -> Result<void> {
    for (const Finding& finding : examine(config)) {
      failed |= finding.level == Finding::Level::error;
      if (!quiet || finding.level != Finding::Level::ok)
        print(finding, json);
    }
    return {};
  });
  return code == kExitDone && failed ? kExitFailed : code;
}

} // namespace daylit
