// The interface of bench.h on the modules: conversions and look-ups, nothing
// else.
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "twi.h"

void bench_on_event(chip* c, bench_callback callback) {
  c->callback = callback;
}

void bench_set_startup(chip* c, uint32_t cycles, uint32_t reset_pc) {
  c->startup_cycles = cycles;
  c->reset_pc = reset_pc;
}

uint64_t bench_cycle(const chip* c) {
  return chip_now(c);
}

static void timer_due(chip* c, void* param, uint64_t id) {
  (void)param;
  if (c->callback) c->callback(kCallbackTimer, (uint32_t)id, chip_now(c), 0);
}

void bench_timer(chip* c, uint64_t cycle, uint32_t id) {
  event_post(c, cycle, timer_due, NULL, id);
}

enum { kAssert, kRelease, kOn, kOff };

static void change_power(chip* c, void* param, uint64_t request) {
  (void)param;
  const uint8_t cause = (uint8_t)(request >> 8);
  switch (request & 0xFF) {
    case kAssert:
      if (c->powered) chip_assert_reset(c, cause);
      return;
    case kRelease:
      if (c->powered) chip_release_reset(c, cause);
      return;
    case kOn:
      chip_power_on(c);
      return;
    default:
      chip_power_off(c);
      return;
  }
}

// A listener may ask in the middle of the instruction that moved its pin.
static void request_power(chip* c, uint64_t request) {
  if (c->executing) {
    event_post(c, c->avr->cycle, change_power, NULL, request);
  } else {
    change_power(c, NULL, request);
  }
}

void bench_assert_reset(chip* c, uint32_t cause) {
  request_power(c, cause << 8 | kAssert);
}
void bench_release_reset(chip* c, uint32_t cause) {
  request_power(c, cause << 8 | kRelease);
}
void bench_power_on(chip* c) {
  request_power(c, kOn);
}
void bench_power_off(chip* c) {
  request_power(c, kOff);
}

int bench_state(const chip* c) {
  if (!c->powered) return 0;
  if (c->held) return 1;
  return c->avr->state == cpu_Sleeping ? 3 : 2;
}

uint8_t* bench_flash(chip* c) {
  return c->avr->flash;
}
uint8_t* bench_data(chip* c) {
  return c->avr->data;
}
uint8_t* bench_eeprom(chip* c) {
  return c->eeprom.memory;
}
uint32_t bench_pc(const chip* c) {
  return c->avr->pc;
}
uint32_t bench_sp(const chip* c) {
  return _avr_sp_get(c->avr);
}
uint32_t bench_lowest_sp(const chip* c) {
  return c->lowest_sp;
}
void bench_poke_pc(chip* c, uint32_t pc) {
  c->avr->pc = pc;
}

void bench_load(const chip* c, uint64_t cycles[3]) {
  cycles[0] = c->running_cycles;
  cycles[1] = c->sleeping_cycles;
  cycles[2] = c->held_cycles;
}

// By the chip's own number; null where it has none.
const vector_stats* bench_vector(const chip* c, uint32_t number) {
  for (uint8_t vector = 0; vector < kVectorCount; vector++) {
    if (interrupt_number(c, vector) == number) return &c->stats[vector];
  }
  return NULL;
}

void bench_clear_statistics(chip* c) {
  memset(c->stats, 0, sizeof c->stats);
  c->running_cycles = c->sleeping_cycles = c->held_cycles = 0;
  c->lowest_sp = _avr_sp_get(c->avr);
}

void bench_log_interrupts(chip* c, bool on) {
  c->log_interrupts = on;
}

void bench_log_marks(chip* c, bool on) {
  c->log_marks = on;
}

void bench_watch_pc(chip* c, uint32_t address, uint32_t number) {
  if (!c->watched_pc) c->watched_pc = calloc((c->avr->flashend + 1) / 2, sizeof *c->watched_pc);
  if (!c->watched_pc) abort();
  c->watched_pc[(address & c->avr->flashend) >> 1] = (uint16_t)number;
}

void bench_count_cycles(chip* c) {
  const size_t words = (c->avr->flashend + 1) / 2;
  if (!c->spent) c->spent = malloc(words * sizeof *c->spent);
  if (!c->spent) abort();
  memset(c->spent, 0, words * sizeof *c->spent);
}

const uint64_t* bench_spent(const chip* c) {
  return c->spent;
}

size_t bench_log_count(const chip* c) {
  return c->log_count;
}
const log_record* bench_log(const chip* c) {
  return c->log;
}
void bench_clear_log(chip* c) {
  c->log_count = 0;
}

void bench_pin_watch(chip* c, uint32_t number, bool log, bool notify) {
  c->pins[number].watched = log;
  c->pins[number].notify = notify;
}

bool bench_pin_level(const chip* c, uint32_t number) {
  return c->pins[number].level;
}

bool bench_pin_driven(const chip* c, uint32_t number) {
  const uint32_t port = number / 8;
  const uint32_t ddr = port < 7 ? 0x21 + 3 * port : 0x101 + 3 * (port - 7);
  return c->powered && ((c->avr->data[ddr] >> (number % 8)) & 1);
}

void bench_pin_strong(chip* c, uint32_t number, uint32_t drive) {
  pin_strong(c, (uint8_t)number, (enum drive)drive);
}

void bench_pin_weak(chip* c, uint32_t number, uint32_t drive) {
  c->pins[number].weak = (uint8_t)drive;
  pin_refresh(c, (uint8_t)number);
}

static void strong_due(chip* c, void* param, uint64_t argument) {
  (void)param;
  pin_strong(c, (uint8_t)(argument >> 8), (enum drive)(argument & 0xFF));
}

void bench_pin_strong_at(chip* c, uint64_t cycle, uint32_t number, uint32_t drive) {
  event_post(c, cycle, strong_due, NULL, (uint64_t)number << 8 | drive);
}

void bench_pin_pull_low(chip* c, uint32_t number, bool low) {
  pin_pull_low(c, (uint8_t)number, low);
}

void bench_analog_set(
    chip* c, uint32_t channel, const double* cycles, const double* volts, uint32_t count) {
  adc_channel* const ch = &c->adc.channel[channel];
  ch->first = 0;
  if (count > ch->capacity) {
    ch->point = realloc(ch->point, count * sizeof *ch->point);
    if (!ch->point) abort();
    ch->capacity = count;
  }
  ch->count = count;
  for (uint32_t i = 0; i < count; i++) {
    ch->point[i] = (adc_point){(uint64_t)cycles[i], volts[i]};
  }
}

void bench_analog_noise(chip* c, uint32_t channel, double lsb) {
  c->adc.channel[channel].noise_lsb = lsb;
}

void bench_analog_stick(chip* c, uint64_t settings) {
  c->adc.stuck = settings;
}

void bench_analog_supply(chip* c, double avcc, double aref, double bandgap) {
  c->adc.avcc_volt = avcc;
  c->adc.aref_volt = aref;
  c->adc.bandgap_volt = bandgap;
}

uint64_t bench_adc_conversions(const chip* c) {
  return c->adc.conversions;
}

void bench_uart_send(chip* c,
                     uint32_t port,
                     const uint8_t* bytes,
                     uint32_t count,
                     double bit_cycles,
                     uint64_t from_cycle) {
  uart_send(c, (uint8_t)port, bytes, count, (uint64_t)(bit_cycles * 256.0 + 0.5), from_cycle);
}

void bench_uart_notify(chip* c, uint32_t port, bool on) {
  c->uarts[port].notify = on;
}
uint64_t bench_uart_lost(const chip* c, uint32_t port) {
  return c->uarts[port].lost;
}

void bench_twi_send(chip* c,
                    uint64_t start,
                    uint32_t id,
                    uint32_t address,
                    const uint8_t* bytes,
                    uint32_t count,
                    uint32_t scl_cycles,
                    uint32_t abort_kind,
                    uint32_t abort_after) {
  twi_packet p = {0};
  p.start = start;
  p.id = id;
  p.address = (uint8_t)address;
  p.length = (uint8_t)count;
  p.scl_cycles = scl_cycles;
  p.abort_kind = (uint8_t)abort_kind;
  p.abort_after = (uint8_t)abort_after;
  memcpy(p.data, bytes, count);
  twi_queue(c, &p);
}

void bench_twi_hold(chip* c, bool sda, bool scl) {
  twi_hold(c, sda, scl);
}
