// The ADC in free-running mode, one channel ahead: while a conversion runs, the multiplexer is set
// for the one after the next, so conversions follow each other every 104 us whatever the CPU does.
// ATmega2560 datasheet (DS40002211A) section 26.5, "Changing Channel or Reference Selection".
#include "hal/analog_input.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/delay.h>

#include "boards/avr/awake.h"
#include "boards/avr/interrupts_off.h"
#include "boards/mega2560/board.h"
#include "boards/mega2560/generated/pins.h"
#include "core/progmem.h"
#include "hal/clock.h"

namespace {

static_assert(pins::kAnalogSlots == hal::kAnalogSlots, "pin map and hal differ");
static_assert(pins::kAnalogRounds == hal::kAnalogRounds, "pin map and hal differ");

constexpr uint8_t kReference = _BV(REFS0);  // AVCC: the sensors are ratiometric
constexpr uint8_t kBandgapMux = 0x1E;
constexpr uint16_t kBandgapMv = 1100;
constexpr uint8_t kConversions = hal::kAnalogSlots * hal::kAnalogRounds;
// Of the supply, behind a scan: the first only settles the reference, which wants 70 us.
constexpr uint8_t kSupplyConversions = 2;
constexpr uint32_t kSupplyUs = 300;  // of those, with all that interrupts add
constexpr uint8_t kSumBytes = 2 * hal::kAnalogSlots;

constexpr uint8_t kIdle = _BV(ADEN) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);  // 125 kHz
constexpr uint8_t kFree = kIdle | _BV(ADATE) | _BV(ADIE);
constexpr uint8_t kOnce = kIdle | _BV(ADIE);

uint8_t g_reading;  // 0 or 1: half of adc_sums that scan_sum() reads

// The converter's registers for a channel.
struct Selection {
  uint8_t control_b;
  uint8_t mux;
};
constexpr Selection selection(const uint8_t slot) {
  return {uint8_t(pins::kAnalogChannel[slot] < 8 ? 0 : _BV(MUX5)),
          uint8_t(kReference | (pins::kAnalogChannel[slot] & 7U))};
}

inline void select(const Selection chosen) {
  ADCSRB = chosen.control_b;
  ADMUX = chosen.mux;
}

// Of the slot behind each slot, for both halves of the sums: two bytes each, as a sum has.
struct Selections {
  Selection slot[2 * hal::kAnalogSlots];
};
constexpr Selections make_selections() {
  Selections all = {};
  for (uint8_t slot = 0; slot < 2 * hal::kAnalogSlots; ++slot) {
    all.slot[slot] = selection(uint8_t((slot + 1) % hal::kAnalogSlots));
  }
  return all;
}
constexpr Selections kBehind CORE_FLASH = make_selections();

// Two bytes of the interrupt stand where one cycle reaches them: conversions of this scan still to
// come, and the next sum's offset in bytes.
#define ADC_LEFT GPIOR2
#define ADC_OFFSET GPIOR1

}  // namespace

#define FOR_THE_INTERRUPT __attribute__((used, externally_visible))

// Shared with the assembly below, hence C names, kept by the linker.
extern "C" {

// Two scans: one is taken while the other waits to be read.
volatile uint16_t adc_sums[2 * hal::kAnalogSlots] FOR_THE_INTERRUPT;
volatile uint8_t adc_end FOR_THE_INTERRUPT;     // offset behind the sums of this scan
volatile uint8_t adc_supply FOR_THE_INTERRUPT;  // conversions of the supply still to come
volatile uint8_t adc_wanted FOR_THE_INTERRUPT;  // of those, behind this scan
volatile uint16_t adc_bandgap FOR_THE_INTERRUPT;

}  // extern "C"

// Its flag is cleared on entry and comes again 104 us later, so it may nest at once. In assembly:
// 76 cycles instead of 128, 4400 or 8800 times a second.
ISR(ADC_vect, ISR_NAKED) {
  __asm__ __volatile__(
      "sei \n\t"
      "push r24 \n\t"
      "in r24, __SREG__ \n\t"
      "push r24 \n\t"
      "push r25 \n\t"
      "push r30 \n\t"
      "push r31 \n\t"
      "in r25, %[left] \n\t"
      "tst r25 \n\t"
      "brne 10f \n\t"
      "rjmp 3f \n\t"
      "10: in r30, %[offset] \n\t"
      "ldi r31, 0 \n\t"
      "subi r30, lo8(-(adc_sums)) \n\t"
      "sbci r31, hi8(-(adc_sums)) \n\t"
      "lds r24, %[result] \n\t"
      "ld r25, Z \n\t"
      "add r25, r24 \n\t"
      "st Z, r25 \n\t"
      "lds r24, %[result]+1 \n\t"
      "ldd r25, Z+1 \n\t"
      "adc r25, r24 \n\t"
      "std Z+1, r25 \n\t"
      "in r30, %[offset] \n\t"
      "subi r30, -2 \n\t"
      "lds r25, adc_end \n\t"
      "cp r30, r25 \n\t"
      "brne 1f \n\t"
      "subi r30, %[size] \n\t"
      "1: out %[offset], r30 \n\t"
      "in r25, %[left] \n\t"
      "subi r25, 1 \n\t"
      "cpi r25, 2 \n\t"
      "brlo 2f \n\t"
      "out %[left], r25 \n\t"
      // That slot converts already; the multiplexer is set for the one behind it.
      "ldi r31, 0 \n\t"
      "subi r30, lo8(-(%[behind])) \n\t"
      "sbci r31, hi8(-(%[behind])) \n\t"
      "lpm r24, Z+ \n\t"
      "sts %[control_b], r24 \n\t"
      "lpm r24, Z \n\t"
      "sts %[admux], r24 \n\t"
      "4: pop r31 \n\t"
      "pop r30 \n\t"
      "pop r25 \n\t"
      "pop r24 \n\t"
      "out __SREG__, r24 \n\t"
      "pop r24 \n\t"
      "reti \n\t"
      "2: tst r25 \n\t"
      "breq 5f \n\t"
      // the conversion under way is the last
      "ldi r24, %[once] \n\t"
      "sts %[control_a], r24 \n\t"
      "rjmp 9f \n\t"
      // The scan is done: the supply, where it was asked for.
      "5: lds r24, %[taken] \n\t"
      "tst r24 \n\t"
      "breq 8f \n\t"
      "sbi %[awake], %[awake_bit] \n\t"
      "8: lds r24, adc_wanted \n\t"
      "tst r24 \n\t"
      "breq 9f \n\t"
      "sts adc_supply, r24 \n\t"
      "sts adc_wanted, r25 \n\t"
      "sts %[control_b], r25 \n\t"
      "ldi r24, %[bandgap] \n\t"
      "sts %[admux], r24 \n\t"
      "ldi r24, %[again] \n\t"
      "sts %[control_a], r24 \n\t"
      // With a zero here, or in adc_supply, the bus's interrupt may start the next scan at once,
      // even inside this one: no register of the converter is written behind it.
      "9: out %[left], r25 \n\t"
      "rjmp 4b \n\t"
      // Of the supply only the last is kept: one before it is of a reference that had not settled.
      "3: lds r24, %[result] \n\t"
      "lds r25, %[result]+1 \n\t"
      "lds r30, adc_supply \n\t"
      "subi r30, 1 \n\t"
      "brcs 4b \n\t"
      "breq 6f \n\t"
      "ldi r31, %[again] \n\t"
      "sts %[control_a], r31 \n\t"
      "rjmp 7f \n\t"
      "6: sts adc_bandgap, r24 \n\t"
      "sts adc_bandgap+1, r25 \n\t"
      "7: sts adc_supply, r30 \n\t"
      "rjmp 4b \n\t" ::[result] "n"(_SFR_MEM_ADDR(ADC)),
      [left] "I"(_SFR_IO_ADDR(ADC_LEFT)),
      [offset] "I"(_SFR_IO_ADDR(ADC_OFFSET)),
      [size] "M"(kSumBytes),
      [behind] "i"(&kBehind),
      [control_a] "n"(_SFR_MEM_ADDR(ADCSRA)),
      [control_b] "n"(_SFR_MEM_ADDR(ADCSRB)),
      [admux] "n"(_SFR_MEM_ADDR(ADMUX)),
      [once] "M"(int(kOnce)),
      [again] "M"(kOnce | _BV(ADSC)),
      [bandgap] "M"(kReference | kBandgapMux),
      [taken] "i"(&mega::g_packet_taken),
      [awake] "I"(_SFR_IO_ADDR(GPIOR0)),
      [awake_bit] "I"(avr::kAwakeBit));
}

namespace mega {

volatile uint8_t g_scan_mask = kScanUnarmed;
volatile bool g_scan_waits = false;

bool adc_busy() {
  return ADC_LEFT != 0 || adc_supply != 0;
}

uint16_t begin_scan() {
  const uint8_t begin = adc_end == kSumBytes ? kSumBytes : 0;
  ADC_OFFSET = begin;
  adc_end = uint8_t(begin + kSumBytes);
  ADC_LEFT = kConversions;
  g_packet_taken = false;
  select(selection(0));
  uint16_t started_ticks;
  {
    const avr::InterruptsOff guard;
    started_ticks = TCNT5;
  }
  ADCSRA = kFree | _BV(ADSC) | _BV(ADIF);
  _delay_us(17);  // two ADC clocks: the first conversion has taken its channel
  select(selection(1));
  return started_ticks;
}

void take_scan() {
  g_reading ^= 1U;
  g_scan_waits = false;
}

}  // namespace mega

namespace {

void clear_next_sums() {
  const uint8_t first = adc_end == kSumBytes ? hal::kAnalogSlots : 0;
  for (uint8_t slot = 0; slot < hal::kAnalogSlots; ++slot) {
    adc_sums[first + slot] = 0;
  }
}

}  // namespace

namespace hal {

void start_analog() {
  DIDR0 = 0xFF;  // A0 to A7 are analogue only
  DIDR2 = _BV(ADC13D) | _BV(ADC14D) | _BV(ADC15D);
  ADCSRA = 0;  // ends the conversion under way, and its interrupt
  ADCSRA = kIdle;
  if (adc_end == 0) {
    adc_end = kSumBytes;
  }
  for (volatile uint16_t& sum : adc_sums) {
    sum = 0;
  }
  adc_bandgap = 0;
  adc_wanted = 0;
  adc_supply = 0;
  ADC_LEFT = 0;
}

void arm_scan(const uint8_t mask) {
  mega::g_scan_mask = mega::kScanUnarmed;
  if (mega::g_scan_waits) {
    return;
  }
  clear_next_sums();
  mega::g_scan_mask = mask;
}

bool start_scan(uint32_t* const started_us) {
  mega::g_scan_mask = mega::kScanUnarmed;
  if (mega::g_scan_waits) {
    return false;
  }
  for (const uint32_t from_us = now_us(); mega::adc_busy();) {
    if (now_us() - from_us > kSupplyUs) {
      start_analog();
    }
  }
  clear_next_sums();
  const uint16_t started_ticks = mega::begin_scan();
  mega::take_scan();
  const uint32_t at_us = now_us();
  const uint16_t since_ticks = uint16_t(uint16_t(at_us << 1) - started_ticks);
  *started_us = at_us - (since_ticks >> 1);
  return true;
}

bool scan_done() {
  // In this order: a packet may start a scan in between, and that is not the one asked for.
  if (ADC_LEFT == 0) {
    return true;
  }
  const uint8_t writing = adc_end == kSumBytes ? 0 : 1;
  return writing != g_reading;
}

uint16_t scan_sum(const uint8_t slot) {
  return adc_sums[g_reading == 0 ? slot : uint8_t(slot + kAnalogSlots)];
}

void measure_supply() {
  adc_wanted = kSupplyConversions;
}

uint16_t avcc_mv() {
  uint16_t counts;
  {
    const avr::InterruptsOff guard;
    counts = adc_bandgap;
  }
  return counts == 0 ? 0 : uint16_t(uint32_t(kBandgapMv) * 1024U / counts);
}

}  // namespace hal
