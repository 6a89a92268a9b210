#pragma once

namespace daylit {

/// daylit-run pose IMAGE --lens FILE --dictionary NAME --size METRES: the markers of a picture and their poses.
int pose_command(int argc, char** argv);

} // namespace daylit
