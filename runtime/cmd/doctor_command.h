#pragma once

namespace daylit {

/// daylit-run doctor CONFIG.toml: what is wrong here, and what to change. Returns the exit code: 1 where daylit-run
/// would have no picture.
int doctor_command(int argc, char** argv);

} // namespace daylit
