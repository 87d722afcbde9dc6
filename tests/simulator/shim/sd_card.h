// The SD card model's state, shared by its data phases (sd_card.c) and its
// commands (sd_commands.c).
#ifndef SIMAVR_BENCH_SD_CARD_H_
#define SIMAVR_BENCH_SD_CARD_H_

#include "bench.h"

enum {
  kIdleBit = 0x01,
  kEraseReset = 0x02,
  kIllegal = 0x04,
  kCrcError = 0x08,
  kEraseOrder = 0x10,
  kAddressError = 0x20,
  kParameterError = 0x40
};
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
  bool reads_fail, line_low;
  sd_record* journal;
  uint64_t journal_count, journal_capacity;
};

void sd_put(sd_card* s, uint8_t byte);
void sd_put_block(sd_card* s, const uint8_t* bytes, uint32_t count);
void sd_busy_for(sd_card* s, uint32_t cycles);

// A command frame is complete: answer it.
void sd_command(sd_card* s);

#endif  // SIMAVR_BENCH_SD_CARD_H_
