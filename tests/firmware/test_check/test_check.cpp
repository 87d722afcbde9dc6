// The four words every suite uses, on both compilers.
#include <stdint.h>

#include "check.h"

namespace {

uint16_t add(uint16_t left, uint16_t right) {
  return static_cast<uint16_t>(left + right);
}

}  // namespace

TEST_CASE("CHECK, CHECK_EQ and REQUIRE accept what holds") {
  REQUIRE(add(1, 2) == 3);
  CHECK(add(65535, 1) == 0);
  CHECK_EQ(add(40000, 20000), 60000U);
}

TEST_CASE("CHECK_EQ compares a byte with a number") {
  const uint8_t count = 200;
  CHECK_EQ(count, 200);
}
