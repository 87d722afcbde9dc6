// Register access of the timers: the TEMP byte, buffered compare registers,
// flags, prescaler.
#include "timers.h"

static const uint16_t kBases[kTimerCount] = {
    REG_TCCR0A, REG_TCCR1A, REG_TCCR2A, REG_TCCR3A, REG_TCCR4A, REG_TCCR5A};

static void write_control(chip* c, uint16_t address, uint8_t value, void* param) {
  timer* const t = param;
  timer_serve(c, t, chip_now(c));
  c->avr->data[address] = value;
  timer_configure(c, t);
}

static void write_force(chip* c, uint16_t address, uint8_t value, void* param) {
  timer* const t = param;
  (void)address;
  if (t->mode == kFast) return;
  for (uint8_t i = 0; i < 3; i++) {
    if (!((value >> (7 - i)) & 1)) continue;
    if (t->com[i] == 1) t->oc[i] = !t->oc[i];
    if (t->com[i] == 2) t->oc[i] = false;
    if (t->com[i] == 3) t->oc[i] = true;
    timer_show_output(c, t, i);
  }
}

static void write_mask(chip* c, uint16_t address, uint8_t value, void* param) {
  timer* const t = param;
  timer_serve(c, t, chip_now(c));
  c->avr->data[address] = value;
  const uint8_t first = timer_first_vector(t);
  for (uint8_t v = first; v <= timer_overflow_vector(t); v++) interrupt_refresh(c, v);
  timer_schedule(c, t);
}

static uint8_t read_flags(chip* c, uint16_t address, void* param) {
  timer_serve(c, param, chip_now(c));
  return c->avr->data[address];
}

static void write_flags(chip* c, uint16_t address, uint8_t value, void* param) {
  timer* const t = param;
  timer_serve(c, t, chip_now(c));
  c->avr->data[address] &= (uint8_t)~written_ones(c, value);
  for (uint8_t v = timer_first_vector(t); v <= timer_overflow_vector(t); v++)
    interrupt_refresh(c, v);
}

static void set_count(chip* c, timer* t, uint16_t value) {
  timer_serve(c, t, chip_now(c));
  t->position = value;
  if (t->divider) t->epoch = timer_aligned(c, t, chip_now(c)) - (uint64_t)value * t->divider;
  timer_schedule(c, t);
}

static void set_compare(chip* c, timer* t, uint8_t i, uint16_t value) {
  timer_serve(c, t, chip_now(c));
  t->ocr_buffer[i] = value;
  if (!t->buffered) timer_configure(c, t);
}

static uint16_t count_now(chip* c, timer* t) {
  timer_serve(c, t, chip_now(c));
  return (uint16_t)t->position;
}

// 8-bit registers: TCNT at base + 2, OCRA + 3, OCRB + 4.
static uint8_t read_narrow(chip* c, uint16_t address, void* param) {
  timer* const t = param;
  return address == t->base + 2 ? (uint8_t)count_now(c, t)
                                : (uint8_t)t->ocr_buffer[address - t->base - 3];
}

static void write_narrow(chip* c, uint16_t address, uint8_t value, void* param) {
  timer* const t = param;
  if (address == t->base + 2)
    set_count(c, t, value);
  else
    set_compare(c, t, (uint8_t)(address - t->base - 3), value);
}

// 16-bit registers: TCNT at base + 4, ICR + 6, OCRA + 8, OCRB + 10, OCRC + 12;
// low byte first.
static uint8_t read_wide(chip* c, uint16_t address, void* param) {
  timer* const t = param;
  const uint16_t offset = (uint16_t)(address - t->base);
  if (offset >= 8) {  // compare registers are read without TEMP (datasheet 17.3)
    const uint16_t value = t->ocr_buffer[(offset - 8) / 2];
    return (uint8_t)(offset & 1 ? value >> 8 : value);
  }
  if (offset & 1) return t->temp;
  const uint16_t value = offset == 4 ? count_now(c, t) : t->icr;
  t->temp = (uint8_t)(value >> 8);
  return (uint8_t)value;
}

static void write_wide(chip* c, uint16_t address, uint8_t value, void* param) {
  timer* const t = param;
  const uint16_t offset = (uint16_t)(address - t->base);
  if (offset & 1) {
    t->temp = value;
    return;
  }
  const uint16_t both = (uint16_t)(t->temp << 8 | value);
  if (offset == 4) {
    set_count(c, t, both);
  } else if (offset == 6) {
    timer_serve(c, t, chip_now(c));
    if (!t->icr_is_top) return;  // writable only where it defines TOP
    t->icr = both;
    timer_configure(c, t);
  } else {
    set_compare(c, t, (uint8_t)((offset - 8) / 2), both);
  }
}

static void write_prescaler(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  for (uint8_t i = 0; i < c->model->timers; i++) timer_serve(c, &c->timers[i], chip_now(c));
  c->prescaler_held = (value & 0x81) == 0x81;
  if (value & 1) c->prescaler_base = chip_now(c);
  c->avr->data[address] = value & 0x80 ? value & 0x83 : 0;
  for (uint8_t i = 0; i < c->model->timers; i++) {
    timer* const t = &c->timers[i];
    if (i == 2) continue;
    if (t->divider && (value & 1)) {
      t->epoch = chip_now(c) - (uint64_t)t->position * t->divider;
    }
    timer_configure(c, t);
  }
}

void timers_init(chip* c) {
  for (uint8_t n = 0; n < c->model->timers; n++) {
    timer* const t = &c->timers[n];
    t->number = n;
    t->wide = n != 0 && n != 2;
    t->base = kBases[n];
    t->due.run = timer_due;
    t->due.param = t;
    hook_write(c, t->base, write_control, t);
    hook_write(c, (uint16_t)(t->base + 1), write_control, t);
    hook_write(c, (uint16_t)(REG_TIMSK0 + n), write_mask, t);
    hook_read(c, (uint16_t)(REG_TIFR0 + n), read_flags, t);
    hook_write(c, (uint16_t)(REG_TIFR0 + n), write_flags, t);
    if (t->wide) hook_write(c, (uint16_t)(t->base + 2), write_force, t);
    const uint16_t first = t->wide ? 4 : 2, last = t->wide ? 13 : 4;
    for (uint16_t offset = first; offset <= last; offset++) {
      hook_read(c, (uint16_t)(t->base + offset), t->wide ? read_wide : read_narrow, t);
      hook_write(c, (uint16_t)(t->base + offset), t->wide ? write_wide : write_narrow, t);
    }
  }
  hook_write(c, REG_GTCCR, write_prescaler, NULL);
}
