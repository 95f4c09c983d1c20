#include "engine/base/float_mode.hpp"

#include <xmmintrin.h>

#include "engine/base/check.hpp"

namespace colony {

void check_floating_point_mode() {
  constexpr unsigned kSticky = 0x3FU;     // what happened so far; no setting
  constexpr unsigned kDefault = 0x1F80U;  // all exceptions masked, nearest, no flush-to-zero, no denormals-are-zero
  CHECK((_mm_getcsr() & ~kSticky) == kDefault);
}

}  // namespace colony
