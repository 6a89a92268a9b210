#pragma once

namespace daylit {

/// For a program whose work is worth nothing when it is not finished: after watch_for_interrupt(), an interrupt ends
/// the process with kExitInterrupted within half a second, also out of a codec or a solver that cannot be asked to
/// stop. Work that notices by itself within a quarter of a second ends as always; no half file is left in either case.
void leave_promptly_when_interrupted();

} // namespace daylit
