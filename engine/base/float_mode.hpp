// float_mode: the processor's floating-point settings on which bit identity rests.
#pragma once

namespace colony {

/// CHECKs that this thread rounds to nearest, keeps subnormals and traps nothing (MXCSR at its default): a library that switches
/// on flush-to-zero would change results silently.
void check_floating_point_mode();

}  // namespace colony
