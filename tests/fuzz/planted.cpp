// A target with a fault of its own, so that the tests see it found: behind the word "bad" a rule is
// broken, or with PLANTED_READ a byte is read behind the end.
#include "feed.h"

volatile uint8_t g_kept;  // so that the read is made

int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  uint8_t* copy = static_cast<uint8_t*>(malloc(size == 0 ? 1 : size));
  memcpy(copy, bytes, size);
  const bool found = size >= 3 && memcmp(copy, "bad", 3) == 0;
#ifdef PLANTED_READ
  if (found) g_kept = copy[size];
#else
  ALWAYS(!found);
#endif
  free(copy);
  return 0;
}
