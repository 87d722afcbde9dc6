// Reset cause, watchdog with a crash record, stack high-water.
#include "hal/system.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/wdt.h>

#include "boards/avr/interrupts_off.h"
#include "boards/mega2560/board.h"

namespace {

constexpr uint8_t kPaint = 0xC5;
constexpr uint32_t kFlightMark = 0x464C5921;  // a power cut does not leave this
constexpr uint32_t kCrashMark = 0x43525348;
constexpr uint32_t kAliveMark = 0x414C4956;

// Kept over a reset, lost with the supply; the marks tell which.
__attribute__((section(".noinit"))) uint32_t g_flight_mark;
__attribute__((section(".noinit"))) uint32_t g_crash_mark;
__attribute__((section(".noinit"))) uint32_t g_alive_mark;
__attribute__((section(".noinit"))) uint32_t g_crash_address;
__attribute__((section(".noinit"))) uint8_t g_mcusr;

uint32_t g_last_crash;

}  // namespace

extern "C" {

extern uint8_t _end;
extern uint8_t __stack;

// Before anything else: the watchdog that reset us still runs, with its shortest time-out. Then
// paint what will be stack. No stack, no zero register yet: plain instructions only.
void mega_init3(void) __attribute__((naked, used, section(".init3")));
void mega_init3(void) {
  // After a reset all of these are zero, whatever a bootloader did. If not, a runaway program came
  // here without one, its watchdog about to be switched off and pins in any state: it held receiver
  // lines as outputs for good. Let go of them and reset.
  if ((TCCR5B | PCMSK2 | DDRK) != 0) {
    DDRB = 0;
    DDRE = 0;
    DDRH = 0;
    DDRK = 0;
    WDTCSR = _BV(WDCE) | _BV(WDE);
    WDTCSR = _BV(WDE);
    for (;;) {
    }
  }
  g_mcusr = MCUSR;
  MCUSR = 0;
  WDTCSR = _BV(WDCE) | _BV(WDE);
  WDTCSR = 0;
  for (uint8_t* at = &_end; at <= &__stack; ++at) {
    *at = kPaint;
  }
}

// The watchdog's first time-out, or a stack that grew into the data. The return address is on top
// of the stack, high byte first: note it, then wait for the reset. Nothing here may rely on the
// state of the program.
void mega_watchdog(const uint8_t* stack) __attribute__((used, noreturn));
void mega_watchdog(const uint8_t* const stack) {
  const uint32_t words = (uint32_t(stack[1]) << 16) | (uint32_t(stack[2]) << 8) | stack[3];
  g_crash_address = words << 1;
  g_crash_mark = kCrashMark;
  wdt_enable(WDTO_15MS);
  for (;;) {
  }
}

}  // extern "C"

// Jumped to with interrupts off, two bytes above the return address.
extern "C" void mega_stack_gone(void) __attribute__((naked, used));
void mega_stack_gone(void) {
  __asm__ __volatile__(
      "pop r24 \n\t"
      "pop r24 \n\t"
      "clr __zero_reg__ \n\t"
      "in r24, __SP_L__ \n\t"
      "in r25, __SP_H__ \n\t"
      "jmp mega_watchdog \n\t");
}

ISR(WDT_vect, ISR_NAKED) {
  __asm__ __volatile__(
      "clr __zero_reg__ \n\t"
      "in r24, __SP_L__ \n\t"
      "in r25, __SP_H__ \n\t"
      "jmp mega_watchdog \n\t");
}

namespace mega {

volatile bool g_packet_taken = false;

}  // namespace mega

namespace hal {

ResetSource reset_source() {
  // A bootloader may have cleared the register: then the cause is unknown, unless memory was lost.
  if (g_alive_mark != kAliveMark) {
    g_alive_mark = kAliveMark;
    if (g_mcusr == 0) {
      g_mcusr = _BV(PORF);
    }
  }
  if (g_crash_mark == kCrashMark) {
    g_crash_mark = 0;
    g_last_crash = g_crash_address;
  }
  if (g_last_crash != 0) {
    return ResetSource::kCrash;
  }
  if ((g_mcusr & _BV(PORF)) != 0) {
    return ResetSource::kPowerOn;
  }
  if ((g_mcusr & _BV(BORF)) != 0) {
    return ResetSource::kBrownOut;
  }
  if ((g_mcusr & _BV(WDRF)) != 0) {
    return ResetSource::kWatchdog;
  }
  return (g_mcusr & _BV(EXTRF)) != 0 ? ResetSource::kExternal : ResetSource::kUnknown;
}

uint32_t crash_address() {
  return g_last_crash;
}

void set_flight_mark(const bool flying) {
  g_flight_mark = flying ? kFlightMark : 0;
}

bool flight_mark() {
  return g_flight_mark == kFlightMark;
}

void start_watchdog() {
  const avr::InterruptsOff guard;
  wdt_reset();
  WDTCSR = _BV(WDCE) | _BV(WDE);
  // 32 ms to the interrupt, which notes the address and resets; as much again if it cannot run. A
  // runaway stack may have turned receiver lines into outputs and interrupts off: no pulse passes
  // until that reset, and with a frame before and behind it 110 ms must do.
  WDTCSR = _BV(WDE) | _BV(WDIE) | _BV(WDP0);
}

uint16_t stack_free_bytes() {
  // Four at a time: 0.25 ms of a turn of the main loop instead of 0.75.
  const uint8_t* at = &_end;
  while (at + 4 <= &__stack && at[0] == kPaint && at[1] == kPaint && at[2] == kPaint &&
         at[3] == kPaint) {
    at += 4;
  }
  while (at < &__stack && *at == kPaint) {
    ++at;
  }
  return uint16_t(at - &_end);
}

const char* board_name() {
  static const char name[] PROGMEM = "mega2560";
  return name;
}

}  // namespace hal
