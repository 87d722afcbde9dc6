// Timers 0 to 5 (datasheet sections 16, 17, 20): normal, CTC and fast PWM.
// Compare registers are double buffered in fast PWM, the 16-bit timers share
// one TEMP byte each, outputs change one timer clock after the match (so a
// pulse lasts OCR + 1 clocks), input capture on ICP1, 3, 4, 5. Nothing is
// scheduled that nobody can see: flags without interrupt or output are worked
// out when the program looks at them.
#include "timers.h"

static const uint8_t kFirstVector[kTimerCount] = {21, 16, 13, 31, 41, 46};  // wide: the capture

uint8_t timer_first_vector(const timer* t) {
  return kFirstVector[t->number];
}

static uint8_t channels(const timer* t) {
  return t->wide ? 3 : 2;
}
static uint8_t compare_vector(const timer* t, uint8_t i) {
  return (uint8_t)(kFirstVector[t->number] + (t->wide ? 1 : 0) + i);
}
uint8_t timer_overflow_vector(const timer* t) {
  return compare_vector(t, channels(t));
}

uint64_t timer_aligned(const chip* c, const timer* t, uint64_t cycle) {
  if (t->number == 2) return cycle - cycle % t->divider;  // own prescaler, never reset here
  return cycle - (cycle - c->prescaler_base) % t->divider;
}

static uint32_t wrap_at(const timer* t) {
  return t->position <= t->top ? (uint32_t)t->top + 1 : (uint32_t)t->max + 1;
}

// Position at which a match takes effect, or 0 for never in this period.
static uint32_t match_at(const timer* t, uint8_t i) {
  const uint32_t at = (uint32_t)t->ocr[i] + 1;
  return t->ocr[i] <= t->top || t->position > t->top ? at : 0;
}

void timer_show_output(chip* c, timer* t, uint8_t i) {
  const uint8_t number = c->model->outputs[t->number][i];
  if (number != kNoPin) pin_oc(c, number, t->com[i] != 0, t->oc[i]);
}

static bool toggles(const timer* t, uint8_t i) {
  // In fast PWM only channel A toggles, and only where the mode does not take
  // 0xFF.. as TOP.
  return t->mode != kFast || (i == 0 && (t->icr_is_top || t->ocra_is_top));
}

static void match(chip* c, timer* t, uint8_t i, uint64_t cycle) {
  interrupt_flag(c, compare_vector(t, i), cycle);
  if (i == 0 && t->number == 0) adc_trigger(c, 3);
  if (i == 1 && t->number == 1) adc_trigger(c, 5);
  const bool before = t->oc[i];
  if (t->com[i] == 1 && toggles(t, i)) t->oc[i] = !t->oc[i];
  if (t->com[i] == 2) t->oc[i] = false;
  if (t->com[i] == 3) t->oc[i] = true;
  if (t->oc[i] != before) timer_show_output(c, t, i);
}

static void wrap(chip* c, timer* t, bool at_top, uint64_t cycle) {
  if (t->mode == kFast) {
    interrupt_flag(c, timer_overflow_vector(t), cycle);
    for (uint8_t i = 0; i < channels(t); i++) {
      t->ocr[i] = t->ocr_buffer[i];
      const bool before = t->oc[i];
      if (t->com[i] == 2) t->oc[i] = true;
      if (t->com[i] == 3) t->oc[i] = false;
      if (t->oc[i] != before) timer_show_output(c, t, i);
    }
    if (t->ocra_is_top) t->top = t->ocr[0];
  } else if (t->mode == kNormal || !at_top || t->top == t->max) {
    interrupt_flag(c, timer_overflow_vector(t), cycle);
  }
  if (t->icr_is_top && at_top) interrupt_flag(c, kFirstVector[t->number], cycle);
  if (t->number == 0) adc_trigger(c, 4);
  if (t->number == 1) adc_trigger(c, 6);
}

// Serves everything up to a cycle, in order.
void timer_serve(chip* c, timer* t, uint64_t cycle) {
  if (t->divider == 0) return;
  for (uint32_t turns = 0;; turns++) {
    const uint64_t ticks = (cycle - t->epoch) / t->divider;
    const uint32_t end = wrap_at(t);
    if (turns == 2 && ticks / end > 2) {
      // Two turns of an unobserved timer have raised every flag there is: skip
      // whole turns.
      t->epoch += (ticks / end - 1) * end * t->divider;
      continue;
    }
    const uint32_t limit = ticks < end ? (uint32_t)ticks : end;
    for (;;) {
      uint32_t next = UINT32_MAX;
      for (uint8_t i = 0; i < channels(t); i++) {
        const uint32_t at = match_at(t, i);
        if (at > t->position && at <= limit && at < next) next = at;
      }
      if (next == UINT32_MAX) break;
      const uint64_t when = t->epoch + (uint64_t)next * t->divider;
      for (uint8_t i = 0; i < channels(t); i++) {
        if (match_at(t, i) == next) match(c, t, i, when);
      }
      t->position = next;
      if (next == end) break;
    }
    if (ticks < end) {
      t->position = limit;
      return;
    }
    const bool at_top = end == (uint32_t)t->top + 1;
    t->epoch += (uint64_t)end * t->divider;
    t->position = 0;
    wrap(c, t, at_top, t->epoch);
  }
}

void timer_schedule(chip* c, timer* t) {
  event_cancel(c, &t->due);
  if (t->divider == 0) return;
  const uint8_t mask = c->avr->data[REG_TIMSK0 + t->number];
  const bool trigger = (c->avr->data[REG_ADCSRA] & 0x20) && t->number < 2;
  const uint32_t end = wrap_at(t);
  uint32_t next = UINT32_MAX;
  bool outputs = false;
  for (uint8_t i = 0; i < channels(t); i++) {
    outputs = outputs || t->com[i] != 0;
    if (t->com[i] == 0 && !(mask & (2u << i)) && !trigger) continue;
    const uint32_t at = match_at(t, i);
    if (at > t->position && at < next) next = at;
  }
  if ((mask || outputs || trigger) && end < next) next = end;
  if (next == UINT32_MAX) return;
  event_at(c, &t->due, t->epoch + (uint64_t)next * t->divider);
}

void timer_due(chip* c, void* param, uint64_t argument) {
  (void)argument;
  timer* const t = param;
  timer_serve(c, t, chip_now(c));
  timer_schedule(c, t);
}

static uint16_t wide_top(const timer* t, uint8_t wgm) {
  switch (wgm) {
    case 5:
      return 0xFF;
    case 6:
      return 0x1FF;
    case 7:
      return 0x3FF;
    case 4:
    case 15:
      return t->ocr[0];
    case 12:
    case 14:
      return t->icr;
    default:
      return 0xFFFF;
  }
}

static uint32_t clock_of(chip* c, const timer* t, uint8_t select) {
  static const uint32_t kShared[8] = {0, 1, 8, 64, 256, 1024, 0, 0};
  static const uint32_t kOwn[8] = {0, 1, 8, 32, 64, 128, 256, 1024};
  if (t->number == 2) return kOwn[select];
  if (select > 5) fault_add(c, kFaultTimerClock, t->number);
  return c->prescaler_held ? 0 : kShared[select];
}

// Reads mode, TOP, outputs and clock from the control registers again.
void timer_configure(chip* c, timer* t) {
  const uint8_t a = c->avr->data[t->base], b = c->avr->data[t->base + 1];
  for (uint8_t i = 0; i < channels(t); i++) t->com[i] = (a >> (6 - 2 * i)) & 3;
  t->icr_is_top = false;
  if (t->wide) {
    const uint8_t wgm = (uint8_t)((a & 3) | ((b >> 1) & 0x0C));
    static const uint8_t kKinds[16] = {kNormal,
                                       kUnmodelled,
                                       kUnmodelled,
                                       kUnmodelled,
                                       kClear,
                                       kFast,
                                       kFast,
                                       kFast,
                                       kUnmodelled,
                                       kUnmodelled,
                                       kUnmodelled,
                                       kUnmodelled,
                                       kClear,
                                       kUnmodelled,
                                       kFast,
                                       kFast};
    t->mode = kKinds[wgm];
    t->icr_is_top = wgm == 12 || wgm == 14;
    t->ocra_is_top = wgm == 4 || wgm == 15;
    t->max = 0xFFFF;
    t->top = wide_top(t, wgm);
  } else {
    const uint8_t wgm = (uint8_t)((a & 3) | ((b >> 1) & 4));
    static const uint8_t kKinds[8] = {
        kNormal, kUnmodelled, kClear, kFast, kUnmodelled, kUnmodelled, kUnmodelled, kFast};
    t->mode = kKinds[wgm];
    t->max = 0xFF;
    t->ocra_is_top = wgm == 2 || wgm == 7;
    t->top = t->ocra_is_top ? t->ocr[0] : 0xFF;
  }
  t->buffered = t->mode == kFast;
  const uint32_t divider = clock_of(c, t, b & 7);
  if (t->mode == kUnmodelled && divider) fault_add(c, kFaultTimerMode, t->number);
  if (divider != t->divider) {
    const uint32_t position = t->position;
    t->divider = divider;
    if (divider) {
      t->epoch = timer_aligned(c, t, chip_now(c)) - (uint64_t)position * divider;
    }
  }
  for (uint8_t i = 0; i < channels(t); i++) {
    if (!t->buffered) t->ocr[i] = t->ocr_buffer[i];
    timer_show_output(c, t, i);
  }
  if (!t->buffered && t->ocra_is_top) t->top = t->ocr[0];
  timer_schedule(c, t);
}

static void captured(chip* c, void* param, uint64_t argument) {
  (void)argument;
  timer* const t = param;
  timer_serve(c, t, chip_now(c));
  t->icr = (uint16_t)t->position;
  interrupt_flag(c, kFirstVector[t->number], chip_now(c));
}

void timer_capture(chip* c, uint8_t number, bool level) {
  for (uint8_t i = 1; i < c->model->timers; i++) {
    timer* const t = &c->timers[i];
    if (c->model->captures[i] != number || t->icr_is_top) continue;
    const uint8_t b = c->avr->data[t->base + 1];
    if (((b & 0x40) != 0) != level) continue;
    // The noise canceler delays by four system clocks (datasheet 17.6.2).
    if (b & 0x80)
      event_post(c, chip_now(c) + 4, captured, t, 0);
    else
      captured(c, t, 0);
  }
}

void timers_reset(chip* c) {
  c->prescaler_base = chip_now(c);
  c->prescaler_held = false;
  for (uint8_t n = 0; n < c->model->timers; n++) {
    timer* const t = &c->timers[n];
    event_cancel(c, &t->due);
    t->divider = 0;
    t->position = 0;
    t->icr = 0;
    t->temp = 0;
    for (uint8_t i = 0; i < 3; i++) {
      t->ocr[i] = t->ocr_buffer[i] = 0;
      t->oc[i] = false;
      t->com[i] = 0;
    }
    timer_configure(c, t);
  }
}
