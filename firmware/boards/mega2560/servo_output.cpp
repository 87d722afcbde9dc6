// Servo pulses from timers 3 and 1 in mode 14: TOP in ICR, compare registers buffered to BOTTOM.
#include "hal/servo_output.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "boards/avr/interrupts_off.h"
#include "boards/mega2560/generated/pins.h"

namespace {

constexpr uint16_t kTop = uint16_t(hal::kServoPeriodUs * 2U - 1U);

// A pulse starts at BOTTOM and ends one step after the compare register. To stop, the pin is taken
// from the timer at the next compare match, when the line has just gone low: a pulse is never cut.
struct Output {
  volatile uint16_t& compare;
  volatile uint8_t& control;
  volatile uint8_t& interrupts;
  volatile uint8_t& flags;
  uint8_t connect;  // COMnx1
  uint8_t match;    // OCIEnx and OCFnx
};

Output output_of(const uint8_t output) {
  switch (output) {
    case 0:
      return {OCR3B, TCCR3A, TIMSK3, TIFR3, _BV(COM3B1), _BV(OCIE3B)};
    case 1:
      return {OCR3C, TCCR3A, TIMSK3, TIFR3, _BV(COM3C1), _BV(OCIE3C)};
    case 2:
      return {OCR1A, TCCR1A, TIMSK1, TIFR1, _BV(COM1A1), _BV(OCIE1A)};
    default:
      return {OCR3A, TCCR3A, TIMSK3, TIFR3, _BV(COM3A1), _BV(OCIE3A)};
  }
}

// The mode comes first: ICR cannot be written in a mode that does not use it as TOP.
void start_timers() {
  TCCR3A = _BV(WGM31);
  TCCR3B = _BV(WGM33) | _BV(WGM32);
  ICR3 = kTop;
  TCCR1A = _BV(WGM11);
  TCCR1B = _BV(WGM13) | _BV(WGM12);
  ICR1 = kTop;
  TCCR3B |= _BV(CS31);  // 16 MHz / 8
  TCCR1B |= _BV(CS11);
}

void make_outputs() {
  pins::ServoAileron::direction() |= pins::ServoAileron::kMask;
  pins::ServoElevator::direction() |= pins::ServoElevator::kMask;
  pins::ServoThrottle::direction() |= pins::ServoThrottle::kMask;
  pins::ServoRudder::direction() |= pins::ServoRudder::kMask;
}

}  // namespace

// Each 22 cycles: the line is low, give the pin back to its port, which is low too.
ISR(TIMER3_COMPB_vect) {
  TCCR3A &= uint8_t(~_BV(COM3B1));
  TIMSK3 &= uint8_t(~_BV(OCIE3B));
}
ISR(TIMER3_COMPC_vect) {
  TCCR3A &= uint8_t(~_BV(COM3C1));
  TIMSK3 &= uint8_t(~_BV(OCIE3C));
}
ISR(TIMER3_COMPA_vect) {
  TCCR3A &= uint8_t(~_BV(COM3A1));
  TIMSK3 &= uint8_t(~_BV(OCIE3A));
}
ISR(TIMER1_COMPA_vect) {
  TCCR1A &= uint8_t(~_BV(COM1A1));
  TIMSK1 &= uint8_t(~_BV(OCIE1A));
}

namespace hal {

void set_servo_pulse(const uint8_t output, const uint16_t width_ticks) {
  if (output >= kServoOutputs) {
    return;
  }
  if ((TCCR3B & _BV(CS31)) == 0) {
    start_timers();
    make_outputs();
  }
  const Output out = output_of(output);
  const bool connected = (out.control & out.connect) != 0;
  if (width_ticks == 0) {
    const avr::InterruptsOff guard;
    if (connected && (out.interrupts & out.match) == 0) {
      out.flags = out.match;
      out.interrupts = uint8_t(out.interrupts | out.match);
    }
    return;
  }
  out.compare = uint16_t(width_ticks - 1U);
  const avr::InterruptsOff guard;
  out.interrupts = uint8_t(out.interrupts & ~out.match);
  out.control = uint8_t(out.control | out.connect);
}

}  // namespace hal
