// What a suite may use: TEST_CASE, CHECK, CHECK_EQ, REQUIRE.
// doctest on the PC; on the AVR, where doctest does not compile, a printer over UART0.
#pragma once

#ifndef __AVR__

// An exception ends the case, not the check alone: a third less to compile.
#define DOCTEST_CONFIG_SUPER_FAST_ASSERTS

// The registry's library, else Debian's header.
#if __has_include(<doctest.h>)
#include <doctest.h>
#else
#include <doctest/doctest.h>
#endif

#else

#include <avr/pgmspace.h>
#include <stdint.h>

namespace check {

// One node per test case; constructors run before main() and chain them up.
class Case {
 public:
  Case(const char* name_flash, void (*body)());
  const char* name_flash;
  void (*body)();
  Case* next;
};

void fail(const char* text_flash, uint16_t line);
void fail_equal(const char* text_flash, uint16_t line, int32_t left, int32_t right);

// CHECK_EQ(count_u8, 3) compares a uint8_t with an int, as on the PC: the warning is not ours.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-compare"
template <typename Left, typename Right>
void equal(const Left& left, const Right& right, const char* text_flash, uint16_t line) {
  if (!(left == right)) {
    fail_equal(text_flash, line, (int32_t)(left), (int32_t)(right));
  }
}
#pragma GCC diagnostic pop

}  // namespace check

#define CHECK_JOIN_(a, b) a##b
#define CHECK_JOIN(a, b) CHECK_JOIN_(a, b)

#define CHECK_CASE(body, title)                                              \
  static void body();                                                        \
  static const char CHECK_JOIN(body, _name)[] PROGMEM = title;               \
  static check::Case CHECK_JOIN(body, _case)(CHECK_JOIN(body, _name), body); \
  static void body()

#define TEST_CASE(title) CHECK_CASE(CHECK_JOIN(check_body_, __LINE__), title)

#define CHECK(expression)                       \
  do {                                          \
    if (!(expression)) {                        \
      check::fail(PSTR(#expression), __LINE__); \
    }                                           \
  } while (false)

#define CHECK_EQ(left, right) check::equal(left, right, PSTR(#left " == " #right), __LINE__)

#define REQUIRE(expression)                     \
  do {                                          \
    if (!(expression)) {                        \
      check::fail(PSTR(#expression), __LINE__); \
      return;                                   \
    }                                           \
  } while (false)

#endif
