// USART 0 to 3, asynchronous (datasheet section 22). The receive line is a
// line: the sender's bits lie on it in the sender's bit time and are sampled in
// the chip's, so a wrong baud rate gives what it gives on the bench. Two bytes
// of buffer and the shift register; the next start bit overruns.
#include <stdlib.h>
#include <string.h>

#include "chip.h"

enum { kRxc = 0x80, kTxc = 0x40, kUdre = 0x20, kFe = 0x10, kDor = 0x08, kUpe = 0x04 };
enum { kA = 0, kB = 1, kC = 2, kBaud = 4, kData = 6 };
enum { kIdleFrame = 0, kStart = 1, kEnd = 2 };

static uint8_t* reg(const chip* c, const uart* u, uint16_t offset) {
  return &c->avr->data[u->base + offset];
}

static uint64_t bit_time(const chip* c, const uart* u) {
  const uint32_t rate = (uint32_t)((*reg(c, u, kBaud) | *reg(c, u, kBaud + 1) << 8) & 0xFFF);
  return (uint64_t)(rate + 1) * (*reg(c, u, kA) & 0x02 ? 8 : 16) * 256;
}

static uint32_t data_bits(const chip* c, const uart* u) {
  return 5 + ((*reg(c, u, kC) >> 1) & 3);
}

static uint32_t parity_bits(const chip* c, const uart* u) {
  return *reg(c, u, kC) & 0x20 ? 1 : 0;
}

static uint8_t vector(const uart* u, uint8_t which) {
  static const uint8_t kFirst[kUartCount] = {25, 36, 51, 54};
  return (uint8_t)(kFirst[u->number] + which);
}

static void refresh(chip* c, const uart* u) {
  for (uint8_t i = 0; i < 3; i++) interrupt_refresh(c, vector(u, i));
}

// ---- sending
// --------------------------------------------------------------------------------

static void shift_out(chip* c, uart* u, uint8_t value) {
  const uint32_t stops = *reg(c, u, kC) & 0x08 ? 2 : 1;
  const uint64_t bits = 1 + data_bits(c, u) + parity_bits(c, u) + stops;
  u->tx_shifting = true;
  u->tx_shift = value;
  event_at(c, &u->tx_due, chip_now(c) + bits * bit_time(c, u) / 256);
}

static void sent(chip* c, void* param, uint64_t argument) {
  (void)argument;
  uart* const u = param;
  log_add(c, kLogUartTx, u->number, u->tx_shift);
  if (u->notify && c->callback) c->callback(kLogUartTx, u->number, chip_now(c), u->tx_shift);
  u->tx_shifting = false;
  if (u->tx_full) {
    u->tx_full = false;
    shift_out(c, u, u->tx_buffer);
    interrupt_flag(c, vector(u, 1), chip_now(c));
  } else {
    interrupt_flag(c, vector(u, 2), chip_now(c));
  }
}

static void write_data(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)address;
  uart* const u = param;
  if (!(*reg(c, u, kB) & 0x08)) return;
  if (!u->tx_shifting) {
    shift_out(c, u, value);
    return;
  }
  if (u->tx_full) return;  // UDRE was clear: the chip ignores the write
  u->tx_full = true;
  u->tx_buffer = value;
  *reg(c, u, kA) &= (uint8_t)~kUdre;
  refresh(c, u);
}

// ---- receiving
// ------------------------------------------------------------------------------

static const uart_line_byte* line_byte(const uart* u, uint32_t i) {
  return &u->line[(u->line_head + i) % u->line_capacity];
}

static bool byte_level(const uart_line_byte* b, uint32_t bit) {
  return bit == 0 ? false : bit <= 8 ? (b->value >> (bit - 1)) & 1 : true;
}

static bool line_level(const uart* u, uint64_t at) {
  for (uint32_t i = 0; i < u->line_count; i++) {
    const uart_line_byte* const b = line_byte(u, i);
    if (at < b->start) return true;
    const uint64_t bit = (at - b->start) / b->bit;
    if (bit < 10) return byte_level(b, (uint32_t)bit);
  }
  return true;
}

static bool next_fall(const uart* u, uint64_t from, uint64_t* at) {
  for (uint32_t i = 0; i < u->line_count; i++) {
    const uart_line_byte* const b = line_byte(u, i);
    if (b->start + 10 * b->bit <= from) continue;
    for (uint32_t k = 0; k < 10; k++) {
      const uint64_t edge = b->start + k * b->bit;
      if (edge >= from && !byte_level(b, k) && (k == 0 || byte_level(b, k - 1))) {
        *at = edge;
        return true;
      }
    }
  }
  return false;
}

static void look_for_start(chip* c, uart* u) {
  if (u->rx_busy || !(*reg(c, u, kB) & 0x10)) return;
  uint64_t at;
  if (!next_fall(u, u->rx_resume, &at)) return;
  u->rx_busy = true;
  u->rx_start = at;
  u->rx_due.argument = kStart;
  const uint64_t cycle = at / 256;
  event_at(c, &u->rx_due, cycle > chip_now(c) ? cycle : chip_now(c));
}

static void show_front(chip* c, uart* u) {
  uint8_t* const a = reg(c, u, kA);
  *a &= (uint8_t) ~(kRxc | kFe | kDor | kUpe);
  if (u->fifo_count) *a |= (uint8_t)(kRxc | u->fifo[0].flags);
  refresh(c, u);
}

static void received(chip* c, uart* u, uint64_t bit) {
  const uint32_t bits = data_bits(c, u), parity = parity_bits(c, u);
  uint32_t value = 0, ones = 0;
  for (uint32_t i = 0; i < bits; i++) {
    const uint32_t level = line_level(u, u->rx_start + bit * (2 * i + 3) / 2);
    value |= level << i;
    ones += level;
  }
  uint8_t flags = u->overrun ? kDor : 0;
  if (parity) {
    const uint32_t level = line_level(u, u->rx_start + bit * (2 * bits + 3) / 2);
    if (((ones + level) & 1) != ((*reg(c, u, kC) >> 4) & 1)) flags |= kUpe;
  }
  if (!line_level(u, u->rx_start + bit * (2 * (bits + parity) + 3) / 2)) flags |= kFe;
  u->overrun = false;
  if (u->fifo_count < 3) {
    u->fifo[u->fifo_count].value = (uint8_t)value;
    u->fifo[u->fifo_count].flags = flags;
    u->fifo_count++;
  }
  show_front(c, u);
}

static void line_event(chip* c, void* param, uint64_t phase) {
  uart* const u = param;
  const uint64_t bit = bit_time(c, u);
  if (phase == kStart) {
    if (line_level(u, u->rx_start + bit / 2)) {  // a spike, not a start bit
      u->rx_busy = false;
      u->rx_resume = u->rx_start + bit / 2;
      look_for_start(c, u);
      return;
    }
    if (u->fifo_count == 3) {
      // Two bytes unread and a third waiting in the shift register: the new
      // start bit takes it.
      log_add(c, kLogUartLost, u->number, u->fifo[2].value);
      u->fifo_count = 2;
      u->overrun = true;
      u->lost++;
    }
    const uint64_t halves = 2 * (data_bits(c, u) + parity_bits(c, u)) + 3;
    u->rx_resume = u->rx_start + bit * halves / 2;
    u->rx_due.argument = kEnd;
    event_at(c, &u->rx_due, u->rx_resume / 256);
    return;
  }
  received(c, u, bit);
  u->rx_busy = false;
  while (u->line_count && line_byte(u, 0)->start + 10 * line_byte(u, 0)->bit <= u->rx_resume) {
    u->line_head = (u->line_head + 1) % u->line_capacity;
    u->line_count--;
  }
  look_for_start(c, u);
}

static uint8_t read_data(chip* c, uint16_t address, void* param) {
  (void)address;
  uart* const u = param;
  if (u->fifo_count == 0) return 0;
  const uint8_t value = u->fifo[0].value;
  memmove(&u->fifo[0], &u->fifo[1], 2 * sizeof u->fifo[0]);
  u->fifo_count--;
  show_front(c, u);
  return value;
}

static void write_a(chip* c, uint16_t address, uint8_t value, void* param) {
  uart* const u = param;
  uint8_t a = c->avr->data[address];
  if (written_ones(c, value) & kTxc) a &= (uint8_t)~kTxc;
  c->avr->data[address] = (uint8_t)((a & ~0x03) | (value & 0x03));
  refresh(c, u);
}

static void write_b(chip* c, uint16_t address, uint8_t value, void* param) {
  uart* const u = param;
  const uint8_t before = c->avr->data[address];
  c->avr->data[address] = value;
  if ((before & 0x10) && !(value & 0x10)) {  // receiver off: buffer flushed
    event_cancel(c, &u->rx_due);
    u->rx_busy = u->overrun = false;
    u->fifo_count = 0;
    show_front(c, u);
  }
  if (!(before & 0x10) && (value & 0x10)) {
    u->rx_resume = chip_now(c) * 256;
    look_for_start(c, u);
  }
  refresh(c, u);
}

void uart_send(chip* c,
               uint8_t number,
               const uint8_t* bytes,
               uint32_t count,
               uint64_t bit_256,
               uint64_t from_cycle) {
  uart* const u = &c->uarts[number];
  const uint64_t earliest = (from_cycle > chip_now(c) ? from_cycle : chip_now(c)) * 256;
  while (u->line_count && !u->rx_busy &&
         line_byte(u, 0)->start + 10 * line_byte(u, 0)->bit < chip_now(c) * 256) {
    u->line_head = (u->line_head + 1) % u->line_capacity;  // nobody listened
    u->line_count--;
  }
  for (uint32_t i = 0; i < count; i++) {
    if (u->line_count == u->line_capacity) {
      const uint32_t capacity = u->line_capacity ? 2 * u->line_capacity : 256;
      uart_line_byte* const line = calloc(capacity, sizeof *line);
      if (!line) abort();
      for (uint32_t k = 0; k < u->line_count; k++) line[k] = *line_byte(u, k);
      free(u->line);
      u->line = line;
      u->line_capacity = capacity;
      u->line_head = 0;
    }
    const uint64_t start = u->line_free > earliest ? u->line_free : earliest;
    u->line[(u->line_head + u->line_count++) % u->line_capacity] =
        (uart_line_byte){start, bit_256, bytes[i]};
    u->line_free = start + 10 * bit_256;
  }
  look_for_start(c, u);
}

void uarts_init(chip* c) {
  static const uint16_t kBases[kUartCount] = {REG_UCSR0A, REG_UCSR1A, REG_UCSR2A, REG_UCSR3A};
  for (uint8_t n = 0; n < c->model->uarts; n++) {
    uart* const u = &c->uarts[n];
    u->number = n;
    u->base = kBases[n];
    u->tx_due.run = sent;
    u->tx_due.param = u;
    u->rx_due.run = line_event;
    u->rx_due.param = u;
    hook_write(c, u->base, write_a, u);
    hook_write(c, (uint16_t)(u->base + kB), write_b, u);
    hook_write(c, (uint16_t)(u->base + kData), write_data, u);
    hook_read(c, (uint16_t)(u->base + kData), read_data, u);
  }
}

void uarts_reset(chip* c) {
  for (uint8_t n = 0; n < c->model->uarts; n++) {
    uart* const u = &c->uarts[n];
    event_cancel(c, &u->tx_due);
    event_cancel(c, &u->rx_due);
    u->tx_shifting = u->tx_full = u->rx_busy = u->overrun = false;
    u->fifo_count = 0;
    *reg(c, u, kA) = kUdre;
    *reg(c, u, kC) = 0x06;
  }
}

void uarts_free(chip* c) {
  for (uint8_t n = 0; n < kUartCount; n++) free(c->uarts[n].line);
}
