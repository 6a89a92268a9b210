#pragma once

namespace daylit::precompute {

/// `daylit-precompute check ROOM [--up y|z] [--json] [--quiet]`: arguments from "check" on; the exit code of the
/// program (0 the room can be baked, 1 it cannot, 2 usage). The report goes to stdout.
int check_command(int argc, char** argv);

} // namespace daylit::precompute
