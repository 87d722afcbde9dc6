// The SD card model's commands (SD Physical Layer, chapter 7.3): what each is
// answered with.
#include <string.h>

#include "sd_card.h"
#include "sd_crc.h"

static void respond(sd_card* s, uint8_t r1) {
  for (uint32_t i = 0; i < s->set.response_bytes; i++) sd_put(s, 0xFF);
  sd_put(s, (uint8_t)(r1 | (s->idle ? kIdleBit : 0)));
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
    const uint8_t fixed[16] = {0x40,
                               0x0E,
                               0x00,
                               0x32,
                               0x5B,
                               0x59,
                               0x00,
                               (uint8_t)((size >> 16) & 0x3F),
                               (uint8_t)(size >> 8),
                               (uint8_t)size,
                               0x7F,
                               0x80,
                               0x0A,
                               0x40,
                               0x00,
                               0x00};
    memcpy(csd, fixed, 16);
  } else {
    // 1024-byte read blocks (10) and C_SIZE_MULT 7: 1024 * 512 bytes per unit
    // of C_SIZE + 1
    const uint32_t size = s->set.blocks / 1024 - 1;
    const uint8_t fixed[16] = {0x00,
                               0x26,
                               0x00,
                               0x32,
                               0x5F,
                               0x5A,
                               (uint8_t)(0x80 | ((size >> 10) & 3)),
                               (uint8_t)(size >> 2),
                               (uint8_t)(((size & 3) << 6) | 0x2D),
                               0xB7,
                               0xFF,
                               0x80,
                               0x16,
                               0x80,
                               0x00,
                               0x00};
    memcpy(csd, fixed, 16);
  }
  csd[15] = (uint8_t)(sd_crc7(csd, 15) << 1 | 1);
  sd_put_block(s, csd, 16);
}

static void send_cid(sd_card* s) {
  uint8_t cid[16] = {0x1B, 'B', 'E', 'B', 'E', 'N', 'C', 'H', 0x10, 0, 0, 0, 1, 0x01, 0x0B, 0};
  cid[15] = (uint8_t)(sd_crc7(cid, 15) << 1 | 1);
  sd_put_block(s, cid, 16);
}

static void application_command(sd_card* s, uint8_t number, uint32_t argument) {
  switch (number) {
    case 13: {
      const uint8_t status[64] = {0};
      respond(s, 0);
      sd_put(s, 0);
      sd_put_block(s, status, 64);
      return;
    }
    case 22: {
      uint8_t n[4] = {(uint8_t)(s->well_written >> 24),
                      (uint8_t)(s->well_written >> 16),
                      (uint8_t)(s->well_written >> 8),
                      (uint8_t)s->well_written};
      respond(s, 0);
      sd_put_block(s, n, 4);
      return;
    }
    case 23:
      respond(s, 0);
      return;
    case 41:
      if (s->init_until == 0) s->init_until = chip_now(s->c) + s->set.init_cycles;
      // A high-capacity card stays idle for ever when the host does not say it
      // knows them.
      if (chip_now(s->c) >= s->init_until && (!s->set.high_capacity || argument & 0x40000000)) {
        s->idle = false;
      }
      respond(s, 0);
      return;
    default:
      respond(s, kIllegal);
      return;
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
  sd_busy_for(s, s->set.erase_cycles);
}

void sd_command(sd_card* s) {
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
    sd_put(s, 0xFF);  // the stuff byte
    s->state = kCommand;
    respond(s, 0);
    if (writing) sd_busy_for(s, s->set.busy_cycles);
    return;
  }
  if (application) {
    application_command(s, number, argument);
    return;
  }
  const bool needs_ready =
      number >= 9 && number != 13 && number != 55 && number != 58 && number != 59;
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
      sd_put(s, 0), sd_put(s, 0), sd_put(s, (uint8_t)((argument >> 8) & 0x0F)),
          sd_put(s, (uint8_t)argument);
      return;
    case 9:
      respond(s, 0);
      send_csd(s);
      return;
    case 10:
      respond(s, 0);
      send_cid(s);
      return;
    case 13:
      respond(s, 0);
      sd_put(s, 0);
      return;
    case 16:
      respond(s, argument == 512 ? 0 : kParameterError);
      return;
    case 17:
      begin_read(s, argument, false);
      return;
    case 18:
      begin_read(s, argument, true);
      return;
    case 24:
      begin_write(s, argument, false);
      return;
    case 25:
      begin_write(s, argument, true);
      return;
    case 32:
    case 33: {
      uint32_t block;
      if (!address_of(s, argument, &block)) return;
      if (number == 32)
        s->erase_first = block, s->erase_marks = 1;
      else
        s->erase_last = block, s->erase_marks |= 2;
      respond(s, 0);
      return;
    }
    case 38:
      erase(s);
      return;
    case 55:
      s->application = true;
      respond(s, 0);
      return;
    case 58:
      respond(s, 0);
      sd_put(s, (uint8_t)((s->idle ? 0 : 0x80) | (s->set.high_capacity && !s->idle ? 0x40 : 0)));
      sd_put(s, 0xFF), sd_put(s, 0x80), sd_put(s, 0);
      return;
    case 59:
      s->crc_on = argument & 1;
      respond(s, 0);
      return;
    default:
      respond(s, kIllegal);
      return;
  }
}
