// The ADC in free-running mode, one channel ahead: while a conversion runs, the multiplexer is set
// for the one after the next, so conversions follow each other every 104 us whatever the CPU does.
// ATmega2560 datasheet (DS40002211A) section 26.5, "Changing Channel or Reference Selection".
#include "hal/analog_input.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/delay.h>

#include "boards/mega2560/generated/pins.h"
#include "boards/mega2560/interrupts.h"
#include "hal/clock.h"

namespace {

static_assert(pins::kAnalogSlots == hal::kAnalogSlots, "pin map and hal differ");
static_assert(pins::kAnalogRounds == hal::kAnalogRounds, "pin map and hal differ");

constexpr uint8_t kReference = _BV(REFS0);  // AVCC: the sensors are ratiometric
constexpr uint8_t kBandgapMux = 0x1E;
constexpr uint16_t kBandgapMv = 1100;
constexpr uint8_t kConversions = hal::kAnalogSlots * hal::kAnalogRounds;
constexpr uint8_t kScansPerSupply = 128;  // about once a second

constexpr uint8_t kIdle = _BV(ADEN) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);  // 125 kHz
constexpr uint8_t kFree = kIdle | _BV(ADATE) | _BV(ADIE);

uint16_t g_sums[hal::kAnalogSlots];
volatile uint8_t g_done = kConversions;  // conversions of this scan that are in
volatile uint8_t g_slot;                 // slot of the next result
volatile uint8_t g_mux_slot;             // slot the multiplexer is set for next
uint8_t g_scans;
volatile uint16_t g_bandgap_counts;

inline void select(const uint8_t channel) {
  ADCSRB = channel < 8 ? 0 : _BV(MUX5);
  ADMUX = uint8_t(kReference | (channel & 7U));
}

inline uint8_t after(const uint8_t slot) {
  return slot + 1 == hal::kAnalogSlots ? 0 : uint8_t(slot + 1);
}

}  // namespace

// Its flag is cleared on entry and comes again 104 us later, so it may nest at once.
ISR(ADC_vect, ISR_NOBLOCK) {
  const uint16_t counts = ADC;
  const uint8_t done = g_done;
  if (done >= kConversions) {
    g_bandgap_counts = counts;
    return;
  }
  const uint8_t slot = g_slot;
  g_sums[slot] = uint16_t(g_sums[slot] + counts);
  g_slot = after(slot);
  g_done = uint8_t(done + 1);
  if (done + 2 < kConversions) {
    const uint8_t next = after(g_mux_slot);
    select(pins::kAnalogChannel[next]);
    g_mux_slot = next;
  } else {
    ADCSRA = kIdle | _BV(ADIE);  // the conversion under way is the last
  }
}

namespace hal {

void start_analog() {
  DIDR0 = 0xFF;  // A0 to A7 are analogue only
  DIDR2 = _BV(ADC13D) | _BV(ADC14D) | _BV(ADC15D);
  ADCSRA = kIdle;
}

uint32_t start_scan() {
  while ((ADCSRA & _BV(ADSC)) != 0) {  // the supply's conversion, 104 us once a second
  }
  for (uint8_t slot = 0; slot < kAnalogSlots; ++slot) {
    g_sums[slot] = 0;
  }
  g_slot = 0;
  g_mux_slot = 1;
  g_done = 0;
  select(pins::kAnalogChannel[0]);
  const uint32_t started_us = now_us();
  ADCSRA = kFree | _BV(ADSC) | _BV(ADIF);
  _delay_us(17);  // two ADC clocks: the first conversion has taken its channel
  select(pins::kAnalogChannel[1]);
  ++g_scans;
  return started_us;
}

bool scan_done() {
  return g_done >= kConversions;
}

uint16_t scan_sum(const uint8_t slot) {
  if (slot == kAnalogRail && g_scans >= kScansPerSupply) {
    g_scans = 0;
    ADCSRB = 0;
    ADMUX = kReference | kBandgapMux;
    _delay_us(100);
    ADCSRA = kIdle | _BV(ADIE) | _BV(ADSC);
  }
  return g_sums[slot];
}

uint16_t avcc_mv() {
  uint16_t counts;
  {
    const mega::InterruptsOff guard;
    counts = g_bandgap_counts;
  }
  return counts == 0 ? 0 : uint16_t(uint32_t(kBandgapMv) * 1024U / counts);
}

}  // namespace hal
