// Interrupt controller: flags and enables per vector, lowest vector first, 4
// cycles to enter (one more for a 22-bit program counter; datasheet 7.8.1),
// 4 more out of sleep, latency statistics.
#include <string.h>

#include "chip.h"

static void define(chip* c,
                   uint8_t vector,
                   uint16_t enable_reg,
                   uint8_t enable_bit,
                   uint16_t flag_reg,
                   uint8_t flag_bit,
                   bool level) {
  c->vectors[vector] = (vector_info){enable_reg, flag_reg, enable_bit, flag_bit, level};
}

static void timer_vectors(chip* c, uint8_t number, uint8_t first, bool wide) {
  const uint16_t enable = (uint16_t)(REG_TIMSK0 + number);
  const uint16_t flag = (uint16_t)(REG_TIFR0 + number);
  uint8_t vector = first;
  if (wide) define(c, vector++, enable, 5, flag, 5, false);  // capture
  const uint8_t channels = wide ? 3 : 2;
  for (uint8_t i = 0; i < channels; i++) {
    define(c, vector++, enable, (uint8_t)(i + 1), flag, (uint8_t)(i + 1), false);
  }
  define(c, vector, enable, 0, flag, 0, false);  // overflow
}

static void uart_vectors(chip* c, uint16_t base, uint8_t first) {
  const uint16_t b = (uint16_t)(base + 1);
  define(c, first, b, 7, base, 7, true);                  // RXC
  define(c, (uint8_t)(first + 1), b, 5, base, 5, true);   // UDRE
  define(c, (uint8_t)(first + 2), b, 6, base, 6, false);  // TXC
}

void interrupts_init(chip* c) {
  for (uint8_t i = 0; i < 8; i++) {
    define(c, (uint8_t)(kVectorInt0 + i), REG_EIMSK, i, REG_EIFR, i, false);
  }
  for (uint8_t i = 0; i < 3; i++) {
    define(c, (uint8_t)(kVectorPcint0 + i), REG_PCICR, i, REG_PCIFR, i, false);
  }
  define(c, kVectorWdt, REG_WDTCSR, 6, REG_WDTCSR, 7, false);
  timer_vectors(c, 2, 13, false);
  timer_vectors(c, 1, 16, true);
  timer_vectors(c, 0, 21, false);
  define(c, kVectorSpi, REG_SPCR, 7, REG_SPSR, 7, false);
  uart_vectors(c, REG_UCSR0A, 25);
  define(c, kVectorAdc, REG_ADCSRA, 3, REG_ADCSRA, 4, false);
  define(c, kVectorEeReady, REG_EECR, 3, REG_EECR, 1,
         true);  // requests while EEPE is clear
  timer_vectors(c, 3, 31, true);
  uart_vectors(c, REG_UCSR1A, 36);
  define(c, kVectorTwi, REG_TWCR, 0, REG_TWCR, 7, true);
  define(c, kVectorSpmReady, REG_SPMCSR, 7, REG_SPMCSR, 0,
         true);  // while SPMEN is clear
  timer_vectors(c, 4, 41, true);
  timer_vectors(c, 5, 46, true);
  uart_vectors(c, REG_UCSR2A, 51);
  uart_vectors(c, REG_UCSR3A, 54);
  for (uint8_t vector = 0; vector < kVectorCount; vector++) {
    if (interrupt_number(c, vector) == kNoVector) c->vectors[vector] = (vector_info){0};
  }
}

// The chip's own number of a vector, or kNoVector.
uint8_t interrupt_number(const chip* c, uint8_t vector) {
  return c->model->vectors ? c->model->vectors[vector] : vector;
}

void interrupts_reset(chip* c) {
  c->pending = 0;
  c->external_low = 0;
  c->active_count = 0;
}

static void refresh_at(chip* c, uint8_t vector, uint64_t cycle) {
  const vector_info* const v = &c->vectors[vector];
  if (v->enable_reg == 0) return;
  const uint8_t* const data = c->avr->data;
  bool flag = (data[v->flag_reg] >> v->flag_bit) & 1;
  if (vector == kVectorEeReady || vector == kVectorSpmReady) flag = !flag;
  if (vector >= kVectorInt0 && vector < kVectorInt0 + 8) {
    flag = flag || ((c->external_low >> (vector - kVectorInt0)) & 1);
  }
  const bool wanted = flag && ((data[v->enable_reg] >> v->enable_bit) & 1);
  const uint64_t bit = UINT64_C(1) << vector;
  if (wanted == ((c->pending & bit) != 0)) return;
  if (wanted) {
    c->pending |= bit;
    c->pending_since[vector] = cycle;
    c->avr->run_cycle_count = 0;  // ends the burst after this instruction
  } else {
    c->pending &= ~bit;
  }
}

void interrupt_refresh(chip* c, uint8_t vector) {
  refresh_at(c, vector, chip_now(c));
}

void interrupt_flag(chip* c, uint8_t vector, uint64_t cycle) {
  const vector_info* const v = &c->vectors[vector];
  if (v->enable_reg == 0) return;  // this chip has no such source
  c->avr->data[v->flag_reg] |= (uint8_t)(1u << v->flag_bit);
  refresh_at(c, vector, cycle);
}

static void count(uint32_t* bins, uint64_t* sum, uint64_t* max, uint64_t cycles) {
  bins[cycles < kLatencyBins ? cycles : kLatencyBins - 1]++;
  *sum += cycles;
  if (cycles > *max) *max = cycles;
}

void interrupt_service(chip* c, bool from_sleep) {
  avr_t* const avr = c->avr;
  const uint8_t vector = (uint8_t)__builtin_ctzll(c->pending);
  const uint64_t begun = avr->cycle;
  _avr_push_addr(avr, avr->pc);
  avr_sreg_set(avr, S_I, 0);
  avr->pc = (avr_flashaddr_t)interrupt_number(c, vector) * 4;
  if (avr->data[REG_MCUCR] & 0x02)
    avr->pc += c->model->boot_start;  // IVSEL: vectors of the boot section
  avr->cycle += c->model->entry_cycles + (from_sleep ? 4u : 0u);
  c->running_cycles += avr->cycle - begun;
  if (c->spent) c->spent[avr->pc >> 1] += avr->cycle - begun;

  vector_stats* const s = &c->stats[vector];
  s->count++;
  const uint64_t since = c->pending_since[vector];
  count(s->latency, &s->latency_sum, &s->latency_max, avr->cycle > since ? avr->cycle - since : 0);
  if (c->active_count < 128) {
    c->active[c->active_count].vector = vector;
    c->active[c->active_count].entered = avr->cycle;
    c->active_count++;
    if (c->active_count > s->nested_max) s->nested_max = c->active_count;
  }
  const uint16_t sp = _avr_sp_get(avr);
  if (sp < c->lowest_sp) c->lowest_sp = sp;
  if (c->log_interrupts) {
    log_add_at(c, avr->cycle, kLogInterrupt, interrupt_number(c, vector), 1);
  }

  const vector_info* const v = &c->vectors[vector];
  if (v->level) {
    c->pending_since[vector] = avr->cycle;  // still asked for: a second entry counts from here
    return;
  }
  avr->data[v->flag_reg] &= (uint8_t) ~(1u << v->flag_bit);
  if (vector == kVectorWdt && (avr->data[REG_WDTCSR] & 0x08)) {
    // Interrupt and system reset mode: the hardware clears WDIE, the next
    // time-out resets.
    avr->data[REG_WDTCSR] &= (uint8_t)~0x40u;
  }
  interrupt_refresh(c, vector);
}

// The core reports RETI through its own "running" line; the length runs to the
// end of RETI, which takes as long as the entry.
void interrupt_returned(struct avr_irq_t* irq, uint32_t value, void* param) {
  (void)irq;
  (void)value;
  chip* const c = param;
  if (c->active_count == 0) return;
  c->active_count--;
  const uint8_t vector = c->active[c->active_count].vector;
  vector_stats* const s = &c->stats[vector];
  const uint64_t end = c->avr->cycle + c->model->entry_cycles;
  count(s->length, &s->length_sum, &s->length_max, end - c->active[c->active_count].entered);
  if (c->log_interrupts) log_add_at(c, end, kLogInterrupt, interrupt_number(c, vector), 0);
}
