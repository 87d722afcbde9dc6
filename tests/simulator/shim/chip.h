// One simulated ATmega2560 or ATmega328P: Debian's libsimavr supplies the instruction core,
// everything around the core (interrupts, ports, timers, converters, buses,
// memories) is modelled in this folder.
#ifndef SIMAVR_BENCH_CHIP_H_
#define SIMAVR_BENCH_CHIP_H_

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>

#include "model.h"
#include "registers.h"

enum {
  kPortCount = 11,  // A B C D E F G H J K L
  kPinCount = kPortCount * 8,
  kTimerCount = 6,
  kUartCount = 4,
  kLatencyBins = 4096,
  kSpiDeviceCount = 4,
};

// Pins by port letter index (A 0 .. H 7, J 8, K 9, L 10) and bit.
#define PIN(port_index, bit) ((uint8_t)((port_index)*8 + (bit)))

typedef struct chip chip;
typedef void (*event_fn)(chip* c, void* param, uint64_t argument);

// A thing that happens at a cycle. Owned by its peripheral, or pooled when
// scheduled from outside.
typedef struct event {
  uint64_t cycle;
  uint64_t sequence;  // order among events of one cycle: first scheduled, first
                      // served
  event_fn run;
  void* param;
  uint64_t argument;
  uint32_t slot;  // position in the heap plus one, 0 when not queued
  bool pooled;
  struct event* next_free;
} event;

// What the log holds. The Python side names the same numbers.
enum log_kind {
  kLogPin = 0,          // source: pin, value: level
  kLogUartTx = 1,       // source: port, value: byte
  kLogReset = 2,        // source: 0 asserted / 1 running, value: cause
  kLogTwi = 3,          // source: enum twi_note, value: count
  kLogUartLost = 4,     // source: port, value: byte lost
  kLogFault = 5,        // source: enum fault, value: detail
  kLogSpi = 6,          // source: device, value: note
  kLogCard = 7,         // source: enum card_note, value: block
  kLogPower = 8,        // source: 0, value: 1 on 0 off
  kLogInterrupt = 9,    // source: vector, value: 1 entry 0 return
  kLogOutOfReset = 10,  // source: 0, value: cause: first instruction executes here
  kLogMark = 11,        // source: GPIOR number, value: byte the program wrote
  kLogPc = 12,          // source: number of the watched address: its instruction
                        // executes here
};

// Things the firmware did that the chip does not define or this model does not
// cover.
enum fault {
  kFaultBadAddress = 1,       // access outside the data space, or a push over the registers
  kFaultTimerMode = 2,        // waveform mode without a model (phase correct)
  kFaultTimerClock = 3,       // external timer clock
  kFaultTwiMaster = 4,        // START where no bus is, or TWCR written while a STOP is under way
  kFaultSleepMode = 5,        // a sleep mode deeper than idle
  kFaultContention = 6,       // chip and a strong external driver disagree on a pin
  kFaultSpiWithoutModel = 7,  // SPI enabled as a slave
  kFaultFlash = 8,            // SPM used in a way the model does not cover
  kFaultAdc = 9,              // differential channel
};

typedef struct log_record {
  uint64_t cycle;
  uint16_t kind;
  uint16_t source;
  uint32_t value;
} log_record;

enum reset_cause { kPowerOn = 0x01, kExternal = 0x02, kBrownOut = 0x04, kWatchdog = 0x08 };

enum drive { kDriveNone = 0, kDriveLow = 1, kDriveHigh = 2 };

typedef void (*pin_fn)(chip* c, void* param, uint8_t pin, bool level);

typedef struct pin_listener {
  pin_fn run;
  void* param;
  struct pin_listener* next;
} pin_listener;

typedef struct pin {
  uint8_t strong;  // external push-pull driver, enum drive
  uint8_t weak;    // external resistor, enum drive
  uint8_t pulled;  // number of open-drain devices holding the line low
  bool oc_connected;
  bool oc_level;
  bool level;
  bool watched;  // level changes go to the log
  bool notify;   // level changes go to the Python callback
  pin_listener* listeners;
} pin;

typedef struct vector_info {
  uint16_t enable_reg;
  uint16_t flag_reg;
  uint8_t enable_bit;
  uint8_t flag_bit;
  bool level;  // the flag stays set on entry (RXC, UDRE, TWINT, EE_READY,
               // SPM_READY)
} vector_info;

typedef struct vector_stats {
  uint64_t count;
  uint64_t latency_sum, latency_max;
  uint64_t length_sum, length_max;
  uint32_t nested_max;
  uint32_t latency[kLatencyBins];  // one cycle per bin, last bin collects the rest
  uint32_t length[kLatencyBins];
} vector_stats;

typedef struct timer {
  uint8_t number;
  bool wide;  // 16 bit
  uint16_t base;
  event due;
  uint32_t divider;   // 0 while stopped
  uint64_t epoch;     // cycle at which the counter was 0
  uint32_t position;  // every point up to and including this one is processed
  uint16_t top, max;
  uint8_t mode;  // enum timer_kind
  bool icr_is_top, ocra_is_top, buffered;
  uint16_t ocr[3], ocr_buffer[3];
  uint16_t icr;
  uint8_t temp;  // one byte for the whole timer, as on the chip
  uint8_t com[3];
  bool oc[3];
} timer;

typedef struct uart_line_byte {
  uint64_t start;  // cycle of the falling edge, in 1/256 cycles
  uint64_t bit;    // 1/256 cycles
  uint8_t value;
} uart_line_byte;

typedef struct uart {
  uint8_t number;
  uint16_t base;
  event tx_due, rx_due;
  bool tx_shifting, tx_full;
  uint8_t tx_shift, tx_buffer;
  uart_line_byte* line;  // ring of bytes on the receive line
  uint32_t line_capacity, line_head, line_count;
  uint64_t line_free;  // when the sender may start its next byte, 1/256 cycles
  uint64_t rx_resume;  // the receiver looks for a start bit from here, 1/256 cycles
  uint64_t rx_start;
  bool rx_busy;
  struct {
    uint8_t value, flags;
  } fifo[3];  // two buffer places and the shift register
  uint8_t fifo_count;
  bool overrun;
  bool notify;
  uint64_t lost;
} uart;

typedef struct spi_device {
  uint8_t cs_pin;
  uint8_t (*exchange)(chip* c, void* param, uint8_t mosi, bool selected);
  void* param;
} spi_device;

typedef struct adc_point {
  uint64_t cycle;
  double volt;
} adc_point;

typedef struct adc_channel {
  adc_point* point;
  uint32_t count, capacity, first;
  double noise_lsb;
} adc_channel;

typedef struct twi_packet {
  uint64_t start;
  uint32_t id;
  uint32_t scl_cycles;
  uint8_t address;
  uint8_t abort_kind;
  uint8_t length;
  uint8_t abort_after;  // whole data bytes before the master dies
  uint8_t data[128];
  struct twi_packet* next;
} twi_packet;

struct chip {
  avr_t* avr;
  const chip_model* model;
  avr_io_t hooks;  // receives WDR and SPM from the core

  // events
  event** heap;
  uint32_t heap_count, heap_capacity;
  uint64_t event_sequence;
  event* free_events;
  bool dispatching;
  uint64_t event_cycle;

  // run loop
  bool stop_requested;
  bool yield;  // ends the turn on a shared bus
  struct twi_bus* bus;
  bool executing;  // inside an instruction: resets wait for its end
  bool held;       // reset asserted or start-up delay running
  bool powered;
  uint8_t reset_sources;  // causes that still hold the chip in reset
  uint8_t last_cause;
  event startup;
  uint32_t startup_cycles;
  uint32_t reset_pc;
  uint32_t halt_cycles;  // the CPU waits (EEPROM, flash)
  bool log_interrupts, log_marks;
  uint16_t* watched_pc;  // per flash word, 0 or a number; null until one is watched
  uint64_t* spent;       // cycles per flash word; null until they are counted
  struct owned* owned;
  struct owned_array* owned_arrays;
  uint64_t running_cycles, sleeping_cycles, held_cycles;
  uint16_t lowest_sp;
  uint64_t fault_count;
  uint64_t random_state;

  // interrupts
  vector_info vectors[kVectorCount];
  uint64_t pending;
  uint64_t pending_since[kVectorCount];
  uint8_t external_low;  // INTn lines in level mode that request now
  vector_stats stats[kVectorCount];
  struct {
    uint8_t vector;
    uint64_t entered;
  } active[128];
  uint32_t active_count;

  pin pins[kPinCount];

  timer timers[kTimerCount];
  uint64_t prescaler_base;
  bool prescaler_held;

  struct {
    event due;
    uint64_t enabled_at;
    bool busy, first, locked;
    uint8_t mux;
    uint8_t admux;
    uint64_t reference_from;  // the conversion that began to look at the bandgap
    double held_volt;         // by the last conversion
    uint16_t result;
    adc_channel channel[16];
    double avcc_volt, aref_volt, bandgap_volt;
    uint64_t conversions;
    uint64_t stuck;  // bit per multiplexer setting: its conversions never end
  } adc;

  struct {
    event due;
    bool busy, flag_read;
    uint8_t out;
    uint8_t received;
    spi_device device[kSpiDeviceCount];
    uint32_t device_count;
    uint64_t bytes;
  } spi;

  uart uarts[kUartCount];

  struct {
    event due;
    twi_packet* queue;
    twi_packet* queue_end;
    uint8_t phase;
    uint8_t index;
    bool addressed, general_call, acknowledge, mid_byte;
    bool sda_held, scl_held;  // by a dead master or a fault
    uint64_t wait_from;
    uint64_t stretch_cycles;
    uint64_t released_at;  // the program cleared TWINT
    uint8_t acked;
  } twi;

  struct {
    event due;
    event window;
    uint8_t memory[4096];
    bool programming;
    uint16_t address;
    uint8_t value;
    uint8_t mode;
  } eeprom;

  struct {
    event due;
    uint64_t change_until;
  } watchdog;

  struct {
    event due;
    uint8_t buffer[256];
    bool filled[256];
    uint64_t armed_until;
    bool busy;
  } flash;

  // everything observable from outside, in time order
  log_record* log;
  size_t log_count, log_capacity;
  void (*callback)(uint32_t kind, uint32_t source, uint64_t cycle, uint32_t value);
};

// events.c
void event_at(chip* c, event* e, uint64_t cycle);
void event_cancel(chip* c, event* e);
void event_post(chip* c, uint64_t cycle, event_fn run, void* param, uint64_t argument);
void event_dispatch(chip* c);
void events_free(chip* c);

// Time of what happens now: an event's own stamp, else the start of the current
// instruction.
static inline uint64_t chip_now(const chip* c) {
  return c->dispatching ? c->event_cycle : c->avr->cycle;
}

// log.c
void log_add(chip* c, uint16_t kind, uint32_t source, uint32_t value);
void log_add_at(chip* c, uint64_t cycle, uint16_t kind, uint32_t source, uint32_t value);
void fault_add(chip* c, enum fault what, uint32_t detail);
uint32_t chip_random(chip* c);
// Memory of a device, zeroed, that goes with the chip.
void* chip_allocate(chip* c, size_t size);
// What `*pointer` points to at the end is freed too: for arrays of a device that grow.
void chip_own(chip* c, void** pointer);
void chip_free_owned(chip* c);

// interrupts.c
void interrupts_init(chip* c);
void interrupts_reset(chip* c);
void interrupt_refresh(chip* c, uint8_t vector);
void interrupt_flag(chip* c, uint8_t vector, uint64_t cycle);
void interrupt_service(chip* c, bool from_sleep);
uint8_t interrupt_number(const chip* c, uint8_t vector);

// Registers: every module hooks its own.
typedef uint8_t (*read_fn)(chip* c, uint16_t address, void* param);
typedef void (*write_fn)(chip* c, uint16_t address, uint8_t value, void* param);
void hook_read(chip* c, uint16_t address, read_fn run, void* param);
void hook_write(chip* c, uint16_t address, write_fn run, void* param);
// The bits an instruction means to write as one: SBI and CBI touch a single bit
// on this chip (datasheet 7.4.1) while the core presents a read-modify-write of
// the whole byte.
uint8_t written_ones(const chip* c, uint8_t value);

// one init and one reset per peripheral
void ports_init(chip* c);
void ports_reset(chip* c);
void pin_refresh(chip* c, uint8_t number);
void pin_strong(chip* c, uint8_t number, enum drive drive);
void pin_pull_low(chip* c, uint8_t number, bool low);
void pin_listen(chip* c, uint8_t number, pin_fn run, void* param);
void pin_oc(chip* c, uint8_t number, bool connected, bool level);
void external_edge(chip* c, uint8_t number, bool level);

void timers_init(chip* c);
void timers_reset(chip* c);
void timer_capture(chip* c, uint8_t number, bool level);

void adc_init(chip* c);
void adc_reset(chip* c);
void adc_trigger(chip* c, uint8_t source);
void spi_init(chip* c);
void spi_reset(chip* c);
uint32_t spi_divider(const chip* c);
void uarts_init(chip* c);
void uarts_reset(chip* c);
void uarts_free(chip* c);
void twi_init(chip* c);
void twi_reset(chip* c);
void twi_free(chip* c);
void eeprom_init(chip* c);
void eeprom_reset(chip* c);
void eeprom_power_lost(chip* c);
void watchdog_init(chip* c);
void watchdog_reset_registers(chip* c);
void watchdog_feed(chip* c);
void flash_init(chip* c);
void flash_reset(chip* c);
void flash_store(chip* c);

// run.c
void chip_run(chip* c, uint64_t until);

// reset.c
void chip_assert_reset(chip* c, uint8_t cause);
void chip_release_reset(chip* c, uint8_t cause);
void chip_pulse_reset(chip* c, uint8_t cause);
void chip_power_on(chip* c);
void chip_power_off(chip* c);

#endif  // SIMAVR_BENCH_CHIP_H_
