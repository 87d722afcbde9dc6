// What a target reads its numbers from, and how it says that something must not be.
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// The fuzzer's bytes, one after the other; zeros behind their end.
class Feed {
 public:
  Feed(const uint8_t* bytes, size_t size) : at_(bytes), end_(bytes + size) {}

  bool more() const { return at_ != end_; }
  uint8_t u8() { return more() ? *at_++ : uint8_t{0}; }
  uint16_t u16() {
    const uint8_t low = u8();
    return static_cast<uint16_t>(low | u8() << 8);
  }
  uint32_t u32() {
    const uint32_t low = u16();
    return low | static_cast<uint32_t>(u16()) << 16;
  }
  void fill(uint8_t* to, size_t size) {
    while (size-- != 0) {
      *to++ = u8();
    }
  }

 private:
  const uint8_t* at_;
  const uint8_t* end_;
};

// A rule that holds whatever comes in. libFuzzer keeps the input that breaks it.
#define ALWAYS(rule)                                                     \
  do {                                                                   \
    if (!(rule)) {                                                       \
      fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #rule); \
      abort();                                                           \
    }                                                                    \
  } while (false)

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size);
