#include "precompute/check_command.h"

#include <cstdio>

#include <CLI/CLI.hpp>

#include "precompute/room_check.h"
#include "scene/core/program.h"

namespace daylit::precompute {

/// Exit code: done when the room can be baked, failed otherwise.
int check_command(int argc, char** argv) {
  std::filesystem::path room;
  std::string up = "z";
  bool json = false, quiet = false;
  int threads = 0;
  CLI::App app{"Says what a bake would find in a room: openings, materials, faces, size, cost.\n"
               "Example: daylit-precompute check room.obj",
               "daylit-precompute check"};
  app.add_option("ROOM", room, "room model: OBJ (z up) or glTF 2.0 (.gltf, .glb); metres")->required();
  app.add_option("--up", up, "axis that points up in the model, y or z")->check(CLI::IsMember({"y", "z"}));
  app.add_option("--threads", threads, "worker threads, 0 = all cores")->check(CLI::NonNegativeNumber);
  app.add_flag("--quiet", quiet, "only the exit code and the error");
  app.add_flag("--json", json, "the report as one JSON object");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitDone : kExitUsage;
  }
  watch_for_interrupt();
  return run_program("daylit-precompute check", json, [&]() -> Result<void> {
    set_thread_count(threads);
    const Result<RoomCheck> check = check_room(room, up == "y" ? UpAxis::y : UpAxis::z);
    if (!check)
      return check.error();
    if (json)
      std::printf("%s\n", to_json(*check).c_str());
    else if (!quiet)
      std::fputs(to_text(*check).c_str(), stdout);
    if (check->problem)
      return *check->problem;
    return {};
  });
}

} // namespace daylit::precompute
