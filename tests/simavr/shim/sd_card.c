// SD card in SPI mode (SD Physical Layer Simplified Specification 3.01, chapter 7): standard and high
// capacity, busy times and stalls, rejected blocks, removal. A block being programmed when power
// goes is left as garbage. After a rejected block of a multiple write the card takes nothing but
// CMD12 or the stop token, as the specification asks of the host.
#include <string.h>

#include "bench.h"
#include "sd_crc.h"

enum { kIdleBit = 0x01, kEraseReset = 0x02, kIllegal = 0x04, kCrcError = 0x08, kEraseOrder = 0x10,
       kAddressError = 0x20, kParameterError = 0x40 };
enum state { kCommand, kReading, kWaitToken, kReceiving, kRefused };
enum card_note { kCardWritten = 0, kCardRejected = 1, kCardLost = 2, kCardIgnored = 3 };
enum { kStallCount = 4096 };

struct sd_card {
  chip* c;
  uint8_t* memory;
  sd_settings set;
  sd_counters counters;
  uint64_t random;
  bool present, spi_mode, idle, application, crc_on, selected;
  uint32_t clocks_deselected;
  uint64_t init_until;
  uint8_t frame[6];
  uint32_t frame_count;
  uint8_t out[2048];
  uint32_t out_head, out_count;
  uint8_t state;
  bool multiple;
  uint64_t read_ready;
  bool read_waiting;
  uint32_t block;
  uint8_t data[514];
  uint32_t data_count;
  uint8_t pending[512];
  bool programming;
  uint32_t programming_block;
  event done;
  bool busy;
  uint32_t erase_first, erase_last;
  uint8_t erase_marks;
  uint32_t well_written;
  struct {
    uint64_t from;
    uint32_t cycles;
  } stall[kStallCount];
  uint32_t stall_head, stall_count;
  uint64_t reject_from;
  uint32_t reject_count, reject_token;
};

static uint32_t card_random(sd_card* s) {
  s->random = s->random * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
  return (uint32_t)(s->random >> 32);
}

static void put(sd_card* s, uint8_t byte) {
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

static void respond(sd_card* s, uint8_t r1) {
  for (uint32_t i = 0; i < s->set.response_bytes; i++) put(s, 0xFF);
  put(s, (uint8_t)(r1 | (s->idle ? kIdleBit : 0)));
}

static void put_block(sd_card* s, const uint8_t* bytes, uint32_t count) {
  put(s, 0xFF);
  put(s, 0xFE);
  for (uint32_t i = 0; i < count; i++) put(s, bytes[i]);
  const uint16_t crc = sd_crc16(bytes, count);
  put(s, (uint8_t)(crc >> 8));
  put(s, (uint8_t)crc);
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

static void busy_for(sd_card* s, uint32_t cycles) {
  s->busy = cycles > 0;
  if (cycles) event_at(s->c, &s->done, chip_now(s->c) + cycles);
}

static void programmed(chip* c, void* param, uint64_t argument) {
  (void)argument;
  sd_card* const s = param;
  s->busy = false;
  if (!s->programming) return;
  s->programming = false;
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
  put(s, (uint8_t)(0xE0 | answer));
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
  busy_for(s, stall_for_now(s));
  if (!s->busy) programmed(s->c, s, 0);
}

static void stop_writing(sd_card* s) {
  s->state = kCommand;
  put(s, 0xFF);
  busy_for(s, s->set.busy_cycles);
}

static bool address_of(sd_card* s, uint32_t argument, uint32_t* block) {
  *block = s->set.high_capacity ? argument : argument / 512;
  if (!s->set.high_capacity && argument % 512) {
    respond(s, kAddressError);
    return false;
  }
  if (*block >= s->set.blocks) {
    respond(s, s->set.high_capacity ? kAddressError : kParameterError);
    return false;
  }
  return true;
}

static void send_csd(sd_card* s) {
  uint8_t csd[16] = {0};
  if (s->set.high_capacity) {
    const uint32_t size = s->set.blocks / 1024 - 1;
    const uint8_t fixed[16] = {0x40, 0x0E, 0x00, 0x32, 0x5B, 0x59, 0x00,
                               (uint8_t)((size >> 16) & 0x3F), (uint8_t)(size >> 8), (uint8_t)size,
                               0x7F, 0x80, 0x0A, 0x40, 0x00, 0x00};
    memcpy(csd, fixed, 16);
  } else {
    // 1024-byte read blocks (10) and C_SIZE_MULT 7: 1024 * 512 bytes per unit of C_SIZE + 1
    const uint32_t size = s->set.blocks / 1024 - 1;
    const uint8_t fixed[16] = {0x00, 0x26, 0x00, 0x32, 0x5F, 0x5A,
                               (uint8_t)(0x80 | ((size >> 10) & 3)), (uint8_t)(size >> 2),
                               (uint8_t)(((size & 3) << 6) | 0x2D), 0xB7, 0xFF, 0x80,
                               0x16, 0x80, 0x00, 0x00};
    memcpy(csd, fixed, 16);
  }
  csd[15] = (uint8_t)(sd_crc7(csd, 15) << 1 | 1);
  put_block(s, csd, 16);
}

static void send_cid(sd_card* s) {
  uint8_t cid[16] = {0x1B, 'B', 'E', 'B', 'E', 'N', 'C', 'H', 0x10, 0, 0, 0, 1, 0x01, 0x0B, 0};
  cid[15] = (uint8_t)(sd_crc7(cid, 15) << 1 | 1);
  put_block(s, cid, 16);
}

static void application_command(sd_card* s, uint8_t number, uint32_t argument) {
  switch (number) {
    case 13: {
      const uint8_t status[64] = {0};
      respond(s, 0);
      put(s, 0);
      put_block(s, status, 64);
      return;
    }
    case 22: {
      uint8_t n[4] = {(uint8_t)(s->well_written >> 24), (uint8_t)(s->well_written >> 16),
                      (uint8_t)(s->well_written >> 8), (uint8_t)s->well_written};
      respond(s, 0);
      put_block(s, n, 4);
      return;
    }
    case 23: respond(s, 0); return;
    case 41:
      if (s->init_until == 0) s->init_until = chip_now(s->c) + s->set.init_cycles;
      // A high-capacity card stays idle for ever when the host does not say it knows them.
      if (chip_now(s->c) >= s->init_until && (!s->set.high_capacity || argument & 0x40000000)) {
        s->idle = false;
      }
      respond(s, 0);
      return;
    default: respond(s, kIllegal); return;
  }
}

static void begin_read(sd_card* s, uint32_t argument, bool multiple) {
  uint32_t block;
  if (!address_of(s, argument, &block)) return;
  respond(s, 0);
  s->block = block;
  s->multiple = multiple;
  s->state = kReading;
  s->read_waiting = true;
  s->read_ready = chip_now(s->c) + s->set.read_cycles;
}

static void begin_write(sd_card* s, uint32_t argument, bool multiple) {
  uint32_t block;
  if (!address_of(s, argument, &block)) return;
  respond(s, 0);
  s->block = block;
  s->multiple = multiple;
  s->well_written = 0;
  s->state = kWaitToken;
}

static void erase(sd_card* s) {
  if (s->erase_marks != 3) {
    respond(s, kEraseOrder);
    return;
  }
  s->erase_marks = 0;
  for (uint32_t b = s->erase_first; b <= s->erase_last && b < s->set.blocks; b++) {
    memset(s->memory + (uint64_t)b * 512, 0, 512);
    s->counters.erased++;
  }
  respond(s, 0);
  busy_for(s, s->set.erase_cycles);
}

static void command(sd_card* s) {
  const uint8_t number = s->frame[0] & 0x3F;
  const uint32_t argument = (uint32_t)s->frame[1] << 24 | (uint32_t)s->frame[2] << 16 |
                            (uint32_t)s->frame[3] << 8 | s->frame[4];
  const bool crc_right = s->frame[5] == (sd_crc7(s->frame, 5) << 1 | 1);
  const bool application = s->application;
  s->application = false;
  s->counters.commands++;
  if (!s->spi_mode) {
    if (number != 0 || !crc_right || s->clocks_deselected < 74) return;
    s->spi_mode = true;
  }
  if (!crc_right && (s->crc_on || number == 0 || number == 8)) {
    respond(s, kCrcError);
    return;
  }
  if (number == 12) {
    const bool writing = s->state == kWaitToken || s->state == kRefused;
    s->out_count = 0;
    put(s, 0xFF);  // the stuff byte
    s->state = kCommand;
    respond(s, 0);
    if (writing) busy_for(s, s->set.busy_cycles);
    return;
  }
  if (application) {
    application_command(s, number, argument);
    return;
  }
  const bool needs_ready = number >= 9 && number != 13 && number != 55 && number != 58 && number != 59;
  if (s->idle && needs_ready) {
    respond(s, kIllegal);
    return;
  }
  switch (number) {
    case 0:
      s->idle = true;
      s->init_until = 0;
      s->crc_on = false;
      s->state = kCommand;
      respond(s, 0);
      return;
    case 8:
      if (s->set.version_1) {
        respond(s, kIllegal);
        return;
      }
      respond(s, 0);
      put(s, 0), put(s, 0), put(s, (uint8_t)((argument >> 8) & 0x0F)), put(s, (uint8_t)argument);
      return;
    case 9: respond(s, 0); send_csd(s); return;
    case 10: respond(s, 0); send_cid(s); return;
    case 13: respond(s, 0); put(s, 0); return;
    case 16: respond(s, argument == 512 ? 0 : kParameterError); return;
    case 17: begin_read(s, argument, false); return;
    case 18: begin_read(s, argument, true); return;
    case 24: begin_write(s, argument, false); return;
    case 25: begin_write(s, argument, true); return;
    case 32: case 33: {
      uint32_t block;
      if (!address_of(s, argument, &block)) return;
      if (number == 32) s->erase_first = block, s->erase_marks = 1;
      else s->erase_last = block, s->erase_marks |= 2;
      respond(s, 0);
      return;
    }
    case 38: erase(s); return;
    case 55: s->application = true; respond(s, 0); return;
    case 58:
      respond(s, 0);
      put(s, (uint8_t)((s->idle ? 0 : 0x80) | (s->set.high_capacity && !s->idle ? 0x40 : 0)));
      put(s, 0xFF), put(s, 0x80), put(s, 0);
      return;
    case 59: s->crc_on = argument & 1; respond(s, 0); return;
    default: respond(s, kIllegal); return;
  }
}

static void continue_read(sd_card* s) {
  if (s->out_count || !s->read_waiting || chip_now(s->c) < s->read_ready) return;
  if (s->block >= s->set.blocks) {
    put(s, 0x08);  // out of range
    s->state = kCommand;
    return;
  }
  put_block(s, s->memory + (uint64_t)s->block * 512, 512);
  s->counters.read++;
  s->block++;
  if (s->multiple) s->read_ready = chip_now(s->c) + s->set.read_cycles;
  else s->read_waiting = false, s->state = kCommand;
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

static uint8_t exchange(chip* c, void* param, uint8_t mosi, bool selected) {
  (void)c;
  sd_card* const s = param;
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
    command(s);
  }
  return miso;
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

bool bench_sd_busy(const sd_card* s) { return s->busy; }
void bench_sd_counters(const sd_card* s, sd_counters* out) { *out = s->counters; }

sd_card* bench_sd_card(chip* c, uint32_t cs_pin, uint8_t* memory, const sd_settings* settings,
                       uint64_t seed) {
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
