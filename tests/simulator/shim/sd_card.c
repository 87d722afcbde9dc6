// SD card in SPI mode (SD Physical Layer Simplified Specification 3.01, chapter
// 7): standard and high capacity, busy times and stalls, rejected blocks,
// removal. A block being programmed when power goes is left as garbage. After a
// rejected block of a multiple write the card takes nothing but CMD12 or the
// stop token, as the specification asks of the host.
#include <string.h>

#include "sd_card.h"
#include "sd_crc.h"

static uint32_t card_random(sd_card* s) {
  s->random = s->random * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
  return (uint32_t)(s->random >> 32);
}

void sd_put(sd_card* s, uint8_t byte) {
  if (s->out_count == sizeof s->out) return;
  s->out[(s->out_head + s->out_count++) % sizeof s->out] = byte;
}

static uint8_t next_out(sd_card* s) {
  if (s->out_count == 0) return s->busy ? 0x00 : 0xFF;
  const uint8_t byte = s->out[s->out_head];
  s->out_head = (s->out_head + 1) % (uint32_t)sizeof s->out;
  s->out_count--;
  return byte;
}

void sd_put_block(sd_card* s, const uint8_t* bytes, uint32_t count) {
  sd_put(s, 0xFF);
  sd_put(s, 0xFE);
  for (uint32_t i = 0; i < count; i++) sd_put(s, bytes[i]);
  const uint16_t crc = sd_crc16(bytes, count);
  sd_put(s, (uint8_t)(crc >> 8));
  sd_put(s, (uint8_t)crc);
}

static uint32_t stall_for_now(sd_card* s) {
  uint32_t cycles = s->set.busy_cycles;
  const uint64_t now = chip_now(s->c);
  while (s->stall_count && s->stall[s->stall_head].from <= now) {
    if (s->stall[s->stall_head].cycles > cycles) cycles = s->stall[s->stall_head].cycles;
    s->stall_head = (s->stall_head + 1) % kStallCount;
    s->stall_count--;
  }
  return cycles;
}

void sd_busy_for(sd_card* s, uint32_t cycles) {
  s->busy = cycles > 0;
  if (cycles) event_at(s->c, &s->done, chip_now(s->c) + cycles);
}

static void journal_begin(sd_card* s) {
  if (!s->journal || s->journal_count++ >= s->journal_capacity) return;
  sd_record* const r = &s->journal[s->journal_count - 1];
  r->begun = chip_now(s->c);
  r->ended = UINT64_MAX;
  r->block = s->programming_block;
  r->spoiled = 0;
  memcpy(r->data, s->pending, 512);
}

static void journal_end(sd_card* s, const uint8_t* spoiled) {
  if (!s->journal || s->journal_count == 0 || s->journal_count > s->journal_capacity) return;
  sd_record* const r = &s->journal[s->journal_count - 1];
  if (r->ended != UINT64_MAX) return;  // it began before the journal did
  r->ended = chip_now(s->c);
  if (!spoiled) return;
  r->spoiled = 1;
  memcpy(r->data, spoiled, 512);
}

static void programmed(chip* c, void* param, uint64_t argument) {
  (void)argument;
  sd_card* const s = param;
  s->busy = false;
  if (!s->programming) return;
  s->programming = false;
  journal_end(s, NULL);
  memcpy(s->memory + (uint64_t)s->programming_block * 512, s->pending, 512);
  s->counters.written++;
  log_add(c, kLogCard, kCardWritten, s->programming_block);
}

static bool rejects(sd_card* s) {
  if (s->reject_count == 0 || chip_now(s->c) < s->reject_from) return false;
  s->reject_count--;
  return true;
}

static void block_received(sd_card* s) {
  const uint16_t sent = (uint16_t)(s->data[512] << 8 | s->data[513]);
  uint8_t answer = 0x05;
  if (s->crc_on && sent != sd_crc16(s->data, 512)) answer = 0x0B;
  if (s->block >= s->set.blocks) answer = 0x0D;
  if (rejects(s)) answer = (uint8_t)s->reject_token;
  s->state = s->multiple ? kWaitToken : kCommand;
  sd_put(s, (uint8_t)(0xE0 | answer));
  if (answer != 0x05) {
    s->counters.rejected++;
    log_add(s->c, kLogCard, kCardRejected, s->block);
    if (s->multiple) s->state = kRefused;
    return;
  }
  memcpy(s->pending, s->data, 512);
  s->programming = true;
  s->programming_block = s->block++;
  s->well_written++;
  journal_begin(s);
  sd_busy_for(s, stall_for_now(s));
  if (!s->busy) programmed(s->c, s, 0);
}

static void stop_writing(sd_card* s) {
  s->state = kCommand;
  sd_put(s, 0xFF);
  sd_busy_for(s, s->set.busy_cycles);
}

static void continue_read(sd_card* s) {
  if (s->out_count || !s->read_waiting || chip_now(s->c) < s->read_ready) return;
  if (s->block >= s->set.blocks) {
    sd_put(s, 0x08);  // out of range
    s->state = kCommand;
    return;
  }
  if (s->reads_fail) {
    sd_put(s, 0x04);  // its own error correction failed
    s->read_waiting = false;
    s->state = kCommand;
    return;
  }
  sd_put_block(s, s->memory + (uint64_t)s->block * 512, 512);
  s->counters.read++;
  s->block++;
  if (s->multiple)
    s->read_ready = chip_now(s->c) + s->set.read_cycles;
  else
    s->read_waiting = false, s->state = kCommand;
}

// Returns whether the byte belongs to the data of a write.
static bool write_byte(sd_card* s, uint8_t mosi) {
  if (s->state == kReceiving) {
    s->data[s->data_count++] = mosi;
    if (s->data_count == sizeof s->data) block_received(s);
    return true;
  }
  if (s->state != kWaitToken && s->state != kRefused) return false;
  if (s->busy || s->out_count) return mosi == 0xFF || !(mosi & 0x80);
  if (mosi == 0xFD && s->multiple) {
    stop_writing(s);
    return true;
  }
  if (mosi == (s->multiple ? 0xFC : 0xFE)) {
    if (s->state == kRefused) {
      s->counters.bytes_ignored++;
      log_add(s->c, kLogCard, kCardIgnored, s->block);
      return true;
    }
    s->state = kReceiving;
    s->data_count = 0;
    return true;
  }
  return false;
}

static uint8_t answer(sd_card* s, uint8_t mosi, bool selected) {
  if (!s->present) return 0xFF;
  if (!selected) {
    s->clocks_deselected += 8;
    s->selected = false;
    s->frame_count = 0;
    return 0xFF;
  }
  s->selected = true;
  if (s->state == kReading) continue_read(s);
  const uint8_t miso = next_out(s);
  if (s->frame_count == 0) {
    if (write_byte(s, mosi)) return miso;
    if ((mosi & 0xC0) != 0x40) return miso;
    if (s->busy && (mosi & 0x3F) != 13 && (mosi & 0x3F) != 0) return miso;
  }
  s->frame[s->frame_count++] = mosi;
  if (s->frame_count == 6) {
    s->frame_count = 0;
    s->out_count = 0;
    sd_command(s);
  }
  return miso;
}

static uint8_t exchange(chip* c, void* param, uint8_t mosi, bool selected) {
  (void)c;
  sd_card* const s = param;
  const uint8_t miso = answer(s, mosi, selected);
  return s->line_low ? 0 : miso;
}

static void forget(sd_card* s) {
  s->spi_mode = s->application = s->crc_on = s->busy = s->read_waiting = false;
  s->idle = true;
  s->init_until = 0;
  s->clocks_deselected = s->frame_count = s->out_count = s->data_count = 0;
  s->erase_marks = 0;
  s->state = kCommand;
}

// Power goes away, by battery or by hand: what was being programmed is garbage.
void bench_sd_power_cut(sd_card* s) {
  if (s->programming) {
    uint8_t* const block = s->memory + (uint64_t)s->programming_block * 512;
    for (int i = 0; i < 512; i++) block[i] = (uint8_t)card_random(s);
    s->programming = false;
    journal_end(s, block);
    s->counters.lost++;
    log_add(s->c, kLogCard, kCardLost, s->programming_block);
  }
  event_cancel(s->c, &s->done);
  forget(s);
}

void bench_sd_insert(sd_card* s, bool present) {
  if (present == s->present) return;
  bench_sd_power_cut(s);
  s->present = present;
}

void bench_sd_stall(sd_card* s, uint64_t from_cycle, uint32_t cycles) {
  if (s->stall_count == kStallCount) return;
  const uint32_t slot = (s->stall_head + s->stall_count++) % kStallCount;
  s->stall[slot].from = from_cycle;
  s->stall[slot].cycles = cycles;
}

void bench_sd_reject(sd_card* s, uint64_t from_cycle, uint32_t count, uint32_t token) {
  s->reject_from = from_cycle;
  s->reject_count = count;
  s->reject_token = token;
}

bool bench_sd_busy(const sd_card* s) {
  return s->busy;
}
void bench_sd_fail_reads(sd_card* s, bool fail) {
  s->reads_fail = fail;
}
void bench_sd_delays(sd_card* s, uint32_t read_cycles, uint32_t init_cycles) {
  s->set.read_cycles = read_cycles;
  s->set.init_cycles = init_cycles;
}
void bench_sd_hold_line(sd_card* s, bool low) {
  s->line_low = low;
}
void bench_sd_journal(sd_card* s, sd_record* records, uint64_t capacity) {
  s->journal = records;
  s->journal_capacity = capacity;
  s->journal_count = 0;
}
uint64_t bench_sd_journal_count(const sd_card* s) {
  return s->journal_count;
}
void bench_sd_counters(const sd_card* s, sd_counters* out) {
  *out = s->counters;
}

sd_card* bench_sd_card(
    chip* c, uint32_t cs_pin, uint8_t* memory, const sd_settings* settings, uint64_t seed) {
  if (c->spi.device_count == kSpiDeviceCount) return NULL;
  sd_card* const s = chip_allocate(c, sizeof *s);
  s->c = c;
  s->memory = memory;
  s->set = *settings;
  s->random = seed;
  s->present = true;
  s->done.run = programmed;
  s->done.param = s;
  forget(s);
  spi_device* const d = &c->spi.device[c->spi.device_count++];
  d->cs_pin = (uint8_t)cs_pin;
  d->exchange = exchange;
  d->param = s;
  c->pins[cs_pin].weak = kDriveHigh;  // the card has a pull-up on DAT3/CS
  pin_refresh(c, (uint8_t)cs_pin);
  return s;
}
