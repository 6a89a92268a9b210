#pragma once

#include <thread>

namespace daylit {

/// For work that is worth nothing when it is not finished: as long as this lives, after watch_for_interrupt(), an
/// interrupt ends the process with kExitInterrupted within half a second, also out of a codec or a solver that cannot
/// be asked to stop. Work that notices by itself within a quarter of a second ends as always; no half file is left in
/// either case.
class PromptExit {
public:
  PromptExit();

private:
  std::jthread watch_;
};

} // namespace daylit
