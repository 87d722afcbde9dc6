// Converter (datasheet section 26): 16 channels and the bandgap, channel and
// reference latched when the conversion starts, sample held 1.5 clocks later,
// 13 clocks per conversion (25 for the first), result locked between the reads
// of ADCL and ADCH, ADIF cleared by writing one. The bandgap wants 70 us before
// it is there (electrical characteristics, tBG); until then the sampling
// capacitor keeps what the last conversion left.
#include <math.h>
#include <stdlib.h>

#include "chip.h"

enum { kReferenceMux = 0x1E, kReferenceCycles = 70 * 16 };
enum { kEnable = 0x80, kStart = 0x40, kAuto = 0x20, kFlag = 0x10 };

static uint32_t divider(const chip* c) {
  const uint8_t select = c->avr->data[REG_ADCSRA] & 7;
  return select < 2 ? 2u : 1u << select;
}

static double reference_volt(const chip* c) {
  switch (c->adc.admux >> 6) {
    case 1:
      return c->adc.avcc_volt;
    case 2:
      return c->adc.bandgap_volt;
    case 3:
      return 2.56;
    default:
      return c->adc.aref_volt;
  }
}

double adc_channel_volt(chip* c, uint8_t number, uint64_t cycle) {
  adc_channel* const ch = &c->adc.channel[number];
  if (ch->count == 0) return 0.0;
  while (ch->first + 1 < ch->count && ch->point[ch->first + 1].cycle <= cycle) ch->first++;
  const adc_point* const a = &ch->point[ch->first];
  if (ch->first + 1 == ch->count || cycle <= a->cycle) return a->volt;
  const adc_point* const b = a + 1;
  const double part = (double)(cycle - a->cycle) / (double)(b->cycle - a->cycle);
  return a->volt + part * (b->volt - a->volt);
}

static uint16_t convert(chip* c, uint64_t cycle) {
  const uint8_t mux = c->adc.mux;
  double volt = 0.0, noise = 0.0;
  if (mux < 8 || (mux >= 0x20 && mux < 0x28)) {
    const uint8_t number = (uint8_t)(mux < 8 ? mux : mux - 0x20 + 8);
    volt = adc_channel_volt(c, number, cycle);
    noise = c->adc.channel[number].noise_lsb;
  } else if (mux == kReferenceMux) {
    const bool settled = cycle - c->adc.reference_from >= kReferenceCycles;
    volt = settled ? c->adc.bandgap_volt : c->adc.held_volt;
  } else if (mux != 0x1F) {
    fault_add(c, kFaultAdc, mux);
  }
  c->adc.held_volt = volt;
  double code = volt * 1024.0 / reference_volt(c);
  if (noise > 0.0) {
    double sum = -6.0;  // twelve uniforms: standard deviation one
    for (int i = 0; i < 12; i++) sum += (double)chip_random(c) / 4294967296.0;
    code += noise * sum;
  }
  code = floor(code);
  return (uint16_t)(code < 0.0 ? 0.0 : code > 1023.0 ? 1023.0 : code);
}

static void begin(chip* c, uint64_t clock_edge, bool triggered) {
  const uint32_t d = divider(c);
  c->adc.busy = true;
  c->adc.admux = c->avr->data[REG_ADMUX];
  const uint8_t mux = (uint8_t)((c->adc.admux & 0x1F) | ((c->avr->data[REG_ADCSRB] & 0x08) << 2));
  if (mux == kReferenceMux && c->adc.mux != mux) c->adc.reference_from = clock_edge;
  c->adc.mux = mux;
  const uint32_t half_clocks = c->adc.first ? 50 : triggered ? 27 : 26;
  const uint32_t hold = c->adc.first ? 27 : triggered ? 4 : 3;
  c->adc.first = false;
  c->adc.due.argument = clock_edge + (uint64_t)hold * d / 2;
  event_at(c, &c->adc.due, clock_edge + (uint64_t)half_clocks * d / 2);
}

static uint64_t next_edge(const chip* c) {
  const uint32_t d = divider(c);
  const uint64_t passed = (chip_now(c) - c->adc.enabled_at) % d;
  return chip_now(c) + (d - passed);
}

static void done(chip* c, void* param, uint64_t sampled_at) {
  (void)param;
  if (c->adc.stuck >> c->adc.mux & 1) return;  // until the converter is switched off
  const uint16_t result = convert(c, sampled_at);
  if (!c->adc.locked) c->adc.result = result;
  c->adc.conversions++;
  c->adc.busy = false;
  uint8_t* const a = &c->avr->data[REG_ADCSRA];
  const bool free_running = (*a & kAuto) && (c->avr->data[REG_ADCSRB] & 7) == 0;
  if (free_running)
    begin(c, chip_now(c), false);
  else
    *a &= (uint8_t)~kStart;
  interrupt_flag(c, kVectorAdc, chip_now(c));
}

void adc_trigger(chip* c, uint8_t source) {
  const uint8_t a = c->avr->data[REG_ADCSRA];
  if ((a & (kEnable | kAuto)) != (kEnable | kAuto)) return;
  if ((c->avr->data[REG_ADCSRB] & 7) != source || c->adc.busy) return;
  c->avr->data[REG_ADCSRA] |= kStart;
  begin(c, chip_now(c),
        true);  // a trigger resets the prescaler: no wait for the next clock
}

static void write_control(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  const uint8_t before = c->avr->data[address];
  uint8_t flag = before & kFlag;
  if (written_ones(c, value) & kFlag) flag = 0;
  c->avr->data[address] = (uint8_t)((value & ~(kFlag | kStart)) | flag | (before & kStart));
  if (!(value & kEnable)) {
    event_cancel(c, &c->adc.due);
    c->adc.busy = false;
    c->avr->data[address] &= (uint8_t)~kStart;
  } else {
    if (!(before & kEnable)) {
      c->adc.enabled_at = chip_now(c);
      c->adc.first = true;
    }
    if ((value & kStart) && !c->adc.busy) {
      c->avr->data[address] |= kStart;
      begin(c, next_edge(c), false);
    }
  }
  interrupt_refresh(c, kVectorAdc);
}

static uint8_t read_result(chip* c, uint16_t address, void* param) {
  (void)param;
  const uint16_t value =
      c->avr->data[REG_ADMUX] & 0x20 ? (uint16_t)(c->adc.result << 6) : c->adc.result;
  c->adc.locked = address == REG_ADCL;
  return (uint8_t)(address == REG_ADCL ? value : value >> 8);
}

static void write_nothing(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)c, (void)address, (void)value, (void)param;
}

void adc_init(chip* c) {
  c->adc.due.run = done;
  c->adc.avcc_volt = c->adc.aref_volt = 5.0;
  c->adc.bandgap_volt = 1.1;
  hook_write(c, REG_ADCSRA, write_control, NULL);
  for (uint16_t a = REG_ADCL; a <= REG_ADCH; a++) {
    hook_read(c, a, read_result, NULL);
    hook_write(c, a, write_nothing, NULL);
  }
}

void adc_reset(chip* c) {
  event_cancel(c, &c->adc.due);
  c->adc.busy = c->adc.locked = false;
  c->adc.first = true;
  c->adc.result = 0;
}
