// The hash by which this image is known; the build writes it in behind the linker
// (firmware/toolchain/image_hash.py).
#include <avr/pgmspace.h>

#include "hal/system.h"

extern "C" {

// Found by its name. Visible, so that link-time optimisation neither renames nor drops it.
extern const uint8_t image_hash_bytes[4] __attribute__((externally_visible));
const uint8_t image_hash_bytes[4] __attribute__((progmem, used)) = {};

}  // extern "C"

namespace hal {

uint32_t image_hash() {
  return pgm_read_dword(image_hash_bytes);
}

}  // namespace hal
