// An IEEE single as the original packets carry it, made an integer without float arithmetic.
#pragma once

#include <stdint.h>

namespace core {

// value * scale, rounded to nearest (half away from zero). False for NaN, infinity and anything
// beyond `limit`; `out` is then left alone.
bool float32_to_int(const uint8_t* bytes, uint32_t scale, int32_t limit, int32_t& out);

}  // namespace core
