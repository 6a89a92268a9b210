#pragma once

// How many lights an error target costs.

namespace daylit {

/// Expected RMS error of the direct skylight on an object, relative to the mean of its direct and indirect light. A
/// law fitted to `daylit-bench direct`: the part that the lights decide falls with their number, what remains is the
/// sharing between pixels and the measured sky.
double expected_direct_error(int lights);
/// The smallest power of two in 16..1024 whose expected error is at most `error`; 1024 where none is.
int lights_for_error(double error);

} // namespace daylit
