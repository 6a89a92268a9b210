#pragma once

namespace daylit {

/// daylit-run cameras: the cameras that answer, one per line.
int cameras_command(int argc, char** argv);
/// daylit-run record CAMERA -o DIR: a sequence of a camera's frames, bit for bit.
int record_command(int argc, char** argv);

} // namespace daylit
