// IEEE 754 singles by their bits, at each edge of what becomes an integer.
#include "check.h"
#include "core/bytes.h"
#include "core/float32.h"

namespace {

constexpr int32_t kUntouched = -77777;

// kUntouched: refused.
int32_t made(uint32_t bits, uint32_t scale = 1, int32_t limit = INT32_MAX) {
  uint8_t bytes[4];
  core::put_le(bytes, bits);
  int32_t out = kUntouched;
  const bool good = core::float32_to_int(bytes, scale, limit, out);
  CHECK_EQ(good, out != kUntouched);
  return out;
}

constexpr uint32_t kMinus = 0x80000000U;

}  // namespace

TEST_CASE("a single is rounded to the nearest, halves away from zero, on either side") {
  const struct {
    uint32_t bits;
    int32_t value;
  } cases[] = {
      {0x00000000, 0},        // 0
      {0x00000001, 0},        // the smallest there is
      {0x007FFFFF, 0},        // the largest without its leading one
      {0x00800000, 0},        // 2^-126
      {0x3EFFFFFF, 0},        // just below a half
      {0x3F000000, 1},        // 0.5
      {0x3F800000, 1},        // 1
      {0x3FBFFFFF, 1},        // just below 1.5
      {0x3FC00000, 2},        // 1.5
      {0x40200000, 3},        // 2.5
      {0x42F60000, 123},      // 123
      {0x4AFFFFFE, 8388607},  // exponent 149: the last that is shifted down
      {0x4AFFFFFF, 8388608},  // 8388607.5
      {0x4B000000, 8388608},  // exponent 150: as it stands
      {0x4B7FFFFF, 16777215},
      {0x4B800000, 16777216},    // the first that is shifted up
      {0x4EFFFFFF, 2147483520},  // the last below 2^31
  };
  for (const auto& one : cases) {
    CHECK_EQ(made(one.bits), one.value);
    CHECK_EQ(made(one.bits | kMinus), -one.value);
  }
}

TEST_CASE("no number and no end are refused, and so is what is beyond any integer") {
  const uint32_t refused[] = {0x7F800000,
                              0x7FC00000,
                              0x7FFFFFFF,
                              0x7F7FFFFF,
                              0x4F000000,
                              0x4F800000,
                              0x52800000,
                              0x53000000,
                              0x5F000000,
                              0x6B000000};
  for (const uint32_t bits : refused) {
    CHECK_EQ(made(bits), kUntouched);
    CHECK_EQ(made(bits | kMinus), kUntouched);
  }
}

TEST_CASE("the limit itself is taken, by a half more it is not") {
  CHECK_EQ(made(0x42C80000, 1, 100), 100);         // 100
  CHECK_EQ(made(0x42C8FFFF, 1, 100), 100);         // 100.49999
  CHECK_EQ(made(0x42C90000, 1, 100), kUntouched);  // 100.5
  CHECK_EQ(made(0xC2C8FFFF, 1, 100), -100);
  CHECK_EQ(made(0xC2C90000, 1, 100), kUntouched);
  CHECK_EQ(made(0x00000000, 1, 0), 0);
}

TEST_CASE("the scale multiplies before anything is rounded, to 24 bits of it") {
  CHECK_EQ(made(0x3F800000, 0xFFFFFF), 0xFFFFFF);
  CHECK_EQ(made(0x3DCCCCCD, 10), 1);               // 0.1
  CHECK_EQ(made(0x3DCCCCCD, 1000000), 100000);     // 0.100000001
  CHECK_EQ(made(0x40490FDB, 10000000), 31415927);  // pi
  CHECK_EQ(made(0xC0490FDB, 10000000), -31415927);
  CHECK_EQ(made(0x34000000, 0xFFFFFF), 2);  // 2^-23: 1.9999999
  CHECK_EQ(made(0x2B800000, 0xFFFFFF), 0);  // 2^-40
  CHECK_EQ(made(0x33000000, 0x800000), 0);  // 2^-25 of 2^23: a quarter
  CHECK_EQ(made(0x33800000, 0x800000), 1);  // a half
}
