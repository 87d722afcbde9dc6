// TWI as a master (ATmega328P datasheet, section 22) on a bus with a slave chip and register chips.
// Both chips run in turns of at most 16 us, the master first; it stops its turn where it writes
// TWCR, so that what it does reaches the slave in time. What the slave does, an acknowledge or the
// end of a stretch, acts on the master nine bits later at the earliest, longer than a turn.
#include "bus.h"

#include <math.h>

#include "bench.h"
#include "twi.h"

enum { kTwint = 0x80, kTwea = 0x40, kTwsta = 0x20, kTwsto = 0x10, kTwen = 0x04 };
enum state { kFree, kWaitFree, kStart, kOwned, kClock, kByte, kStop, kWaitStop };
enum want { kWantByte, kWantStart, kWantStop };
enum phase { kAddress, kTransmit, kReceive };
enum { kSlice = 256 };  // cycles; a byte lasts 360 at 400 kHz

struct twi_bus {
  chip* master;
  chip* slave;  // or null
  bus_device* devices;
  // True time is the slave's cycles, or the master's where it is alone.
  double now, rate;  // master cycles per cycle of true time
  uint64_t master_zero, slave_zero;
  enum state state;
  enum want want;
  enum phase phase;
  double due;    // of the next step, or infinity
  double ready;  // the master lets SCL go
  double left;   // of a byte whose clock is held
  double stretch;
  bool start_wanted, acknowledge, owned;
  uint8_t value;
  bool sda_low, scl_low, sda_high, scl_high;
  uint32_t hung_clocks;  // SDA is let go after so many
  uint32_t acked;
  bool log_bytes;
};

static double true_of(const twi_bus* b, const chip* c, uint64_t cycle) {
  if (c == b->slave) return (double)(int64_t)(cycle - b->slave_zero);
  return (double)(int64_t)(cycle - b->master_zero) / b->rate;
}

static uint64_t cycle_of(const twi_bus* b, const chip* c, double at) {
  if (c == b->slave) return b->slave_zero + (uint64_t)llround(at);
  return b->master_zero + (uint64_t)llround(at * b->rate);
}

static double master_now(const twi_bus* b) {
  return true_of(b, b->master, chip_now(b->master));
}

static uint8_t* control(const twi_bus* b) {
  return &b->master->avr->data[REG_TWCR];
}

static double bit_time(const twi_bus* b) {
  const uint8_t* const data = b->master->avr->data;
  return (16.0 + 2.0 * data[REG_TWBR] * (double)(1u << (2 * (data[REG_TWSR] & 3)))) / b->rate;
}

static bool stuck_low(const twi_bus* b) {
  return b->sda_low || b->scl_low;
}

static void note(const twi_bus* b, uint32_t what, uint32_t value) {
  log_add_at(b->master, cycle_of(b, b->master, b->now), kLogTwi, what, value);
}

static void flag(twi_bus* b, uint8_t status) {
  uint8_t* const s = &b->master->avr->data[REG_TWSR];
  *s = (uint8_t)((*s & 0x03) | status);
  interrupt_flag(b->master, kVectorTwi, cycle_of(b, b->master, b->now));
}

static void step(twi_bus* b, enum state state, double at) {
  b->state = state;
  b->due = at > b->now ? at : b->now;
}

static void rest(twi_bus* b, enum state state) {
  b->state = state;
  b->due = INFINITY;
}

static void devices_idle(twi_bus* b) {
  for (bus_device* d = b->devices; d; d = d->following) {
    if (d->addressed && d->busy) d->busy(b->master, d->param, false);
    d->addressed = false;
  }
}

static void begin_start(twi_bus* b, double at) {
  b->start_wanted = false;
  if (stuck_low(b))
    rest(b, kWaitFree);
  else
    step(b, kStart, at + bit_time(b));
}

// ---- bytes ----

static bool address_everyone(twi_bus* b, uint8_t value) {
  bool ack = b->slave && twi_slave_address(b->slave, value);
  for (bus_device* d = b->devices; d; d = d->following) {
    if (!d->present || d->address != value >> 1) continue;
    d->addressed = true;
    d->pointing = (value & 1) == 0;
    if (d->busy) d->busy(b->master, d->param, true);
    ack = true;
  }
  return ack;
}

static void advance(bus_device* d) {
  d->pointer = d->next ? d->next(d->pointer) : (uint8_t)(d->pointer + 1);
}

static bool write_everyone(twi_bus* b, uint8_t value) {
  bool ack = b->slave && twi_slave_byte(b->slave, value);
  for (bus_device* d = b->devices; d; d = d->following) {
    if (!d->addressed) continue;
    ack = true;
    if (d->pointing) {
      d->pointer = value;
      d->pointing = false;
    } else {
      d->write(b->master, d->param, d->pointer, value);
      advance(d);
    }
  }
  return ack;
}

static uint8_t read_everyone(twi_bus* b) {
  uint8_t value = 0xFF;
  for (bus_device* d = b->devices; d; d = d->following) {
    if (!d->addressed) continue;
    value &= d->read(b->master, d->param, d->pointer);
    advance(d);
  }
  return value;
}

static void lose_arbitration(twi_bus* b) {
  b->owned = false;
  if (b->slave) twi_slave_break(b->slave);
  devices_idle(b);
  rest(b, kFree);
  flag(b, 0x38);
}

static void byte_done(twi_bus* b) {
  if (b->phase == kReceive) {
    uint8_t value = read_everyone(b);
    if (b->sda_low) value = 0;
    if (b->sda_high) value = 0xFF;
    b->master->avr->data[REG_TWDR] = value;
    rest(b, kOwned);
    flag(b, b->acknowledge ? 0x50 : 0x58);
    return;
  }
  if (b->sda_low && b->value != 0) {  // a one was sent and a zero read
    lose_arbitration(b);
    return;
  }
  const uint8_t value = b->sda_high ? 0xFF : b->value;
  const bool address = b->phase == kAddress;
  bool ack = address ? address_everyone(b, value) : write_everyone(b, value);
  ack = (ack && !b->sda_high) || b->sda_low;
  rest(b, kOwned);
  if (!address) {
    b->acked += ack;
    if (b->log_bytes) note(b, kTwiByte, value);
    flag(b, ack ? 0x28 : 0x30);
    return;
  }
  note(b, ack ? kTwiAddressed : kTwiRefused, value);
  b->acked = 0;
  b->phase = b->value & 1 ? kReceive : kTransmit;
  if (b->phase == kReceive)
    flag(b, ack ? 0x40 : 0x48);
  else
    flag(b, ack ? 0x18 : 0x20);
}

static void start_done(twi_bus* b) {
  if (!b->sda_high) {
    if (b->slave) twi_slave_start(b->slave);
    devices_idle(b);
  }
  note(b, kTwiStart, 0);
  const bool repeated = b->owned;
  b->owned = true;
  b->phase = kAddress;
  rest(b, kOwned);
  flag(b, repeated ? 0x10 : 0x08);
}

static void stop_done(twi_bus* b) {
  if (stuck_low(b)) {
    rest(b, kWaitStop);
    return;
  }
  if (!b->sda_high) {
    if (b->slave) twi_slave_stop(b->slave);
    devices_idle(b);
  }
  note(b, kTwiDone, b->acked);
  *control(b) &= (uint8_t)~kTwsto;
  b->owned = false;
  rest(b, kFree);
  if (b->start_wanted) begin_start(b, b->now);
}

static void serve(twi_bus* b) {
  b->due = INFINITY;
  switch (b->state) {
    case kStart:
      start_done(b);
      return;
    case kByte:
      byte_done(b);
      return;
    case kStop:
      stop_done(b);
      return;
    default:
      return;
  }
}

// The master wants to go on: it may as soon as nobody holds SCL.
static void poll(twi_bus* b) {
  if (b->state != kClock || b->scl_low || b->scl_high) return;
  double from = b->ready;
  if (b->slave) {
    if (twi_slave_holds(b->slave)) return;
    const double released = true_of(b, b->slave, b->slave->twi.released_at);
    if (released > from && b->slave->twi.released_at > b->slave_zero) from = released;
  }
  if (b->phase != kAddress) from += b->stretch;
  if (b->want == kWantStart)
    step(b, kStart, from + bit_time(b));
  else if (b->want == kWantStop)
    step(b, kStop, from + bit_time(b));
  else
    step(b, kByte, from + 9 * bit_time(b));
}

// ---- the master's registers ----

void bus_abandon(twi_bus* b) {
  if (b->owned) {
    if (b->slave) twi_slave_break(b->slave);
    devices_idle(b);
  }
  b->owned = b->start_wanted = false;
  *control(b) &= (uint8_t)~kTwsto;
  rest(b, kFree);
}

void bus_control(twi_bus* b, uint8_t value) {
  chip* const c = b->master;
  uint8_t* const r = control(b);
  const bool stopping = (*r & kTwsto) != 0;
  if (stopping && !(value & kTwsto)) fault_add(c, kFaultTwiMaster, value);
  *r = (uint8_t)((*r & (kTwint | kTwsto)) | (value & ~kTwint));
  c->yield = true;
  c->avr->run_cycle_count = 0;
  if (!(value & kTwen)) {
    *r &= (uint8_t)~kTwint;
    c->avr->data[REG_TWSR] |= 0xF8;
    bus_abandon(b);
    interrupt_refresh(c, kVectorTwi);
    return;
  }
  if (value & kTwint) {
    *r &= (uint8_t)~kTwint;
    c->avr->data[REG_TWSR] |= 0xF8;
    b->acknowledge = (value & kTwea) != 0;
    if (b->state == kOwned) {
      b->start_wanted = (value & (kTwsto | kTwsta)) == (kTwsto | kTwsta);
      b->want = value & kTwsto ? kWantStop : value & kTwsta ? kWantStart : kWantByte;
      b->value = c->avr->data[REG_TWDR];
      b->ready = master_now(b);
      rest(b, kClock);
    } else if (value & kTwsta) {
      if (b->state == kFree)
        begin_start(b, master_now(b));
      else
        b->start_wanted = true;
    } else if (b->state == kFree) {
      *r &= (uint8_t)~kTwsto;
    }
  }
  interrupt_refresh(c, kVectorTwi);
}

// ---- lines ----

static void hold_lines(chip* c, bool sda_low, bool scl_low, bool sda_high, bool scl_high) {
  twi_hold(c, sda_low, scl_low);
  pin_strong(c, c->model->sda_pin, sda_high ? kDriveHigh : kDriveNone);
  pin_strong(c, c->model->scl_pin, scl_high ? kDriveHigh : kDriveNone);
}

void bench_bus_hold(twi_bus* b, bool sda_low, bool scl_low, bool sda_high, bool scl_high) {
  const bool clock_was = !b->scl_low && !b->scl_high, clock_is = !scl_low && !scl_high;
  b->sda_low = sda_low;
  b->scl_low = scl_low;
  b->sda_high = sda_high;
  b->scl_high = scl_high;
  hold_lines(b->master, sda_low, scl_low, sda_high, scl_high);
  if (b->slave) hold_lines(b->slave, sda_low, scl_low, sda_high, scl_high);
  if (b->state == kByte && clock_was && !clock_is) {
    b->left = b->due - b->now;
    b->due = INFINITY;
  } else if (b->state == kByte && !clock_was && clock_is) {
    b->due = b->now + b->left;
  }
  if (!stuck_low(b) && b->state == kWaitFree) begin_start(b, b->now);
  if (!stuck_low(b) && b->state == kWaitStop) step(b, kStop, b->now + bit_time(b));
}

void bench_bus_hang(twi_bus* b, uint32_t clocks) {
  bench_bus_hold(b, true, false, false, false);
  b->hung_clocks = clocks;
}

void bench_bus_log_bytes(twi_bus* b, bool on) {
  b->log_bytes = on;
}

void bench_bus_stretch(twi_bus* b, double cycles) {
  b->stretch = cycles;
}

// The program moves the lines as port pins while its TWI is off.
static void pin_moves(chip* c, void* param, uint8_t number, bool level) {
  twi_bus* const b = param;
  if (*control(b) & kTwen) return;
  if (number == c->model->scl_pin) {
    if (!level && b->hung_clocks && --b->hung_clocks == 0) {
      bench_bus_hold(b, false, b->scl_low, b->sda_high, b->scl_high);
    }
  } else if (c->pins[c->model->scl_pin].level && b->slave) {
    if (level)
      twi_slave_stop(b->slave);
    else
      twi_slave_start(b->slave);
  }
}

// ---- time ----

static void run_turn(twi_bus* b, double next) {
  chip* const c = b->master;
  chip_run(c, cycle_of(b, c, next));
  if (c->yield) {
    c->yield = false;
    const double at = true_of(b, c, c->avr->cycle);
    if (at < next) next = at > b->now ? at : b->now;
  }
  if (b->slave) chip_run(b->slave, cycle_of(b, b->slave, next));
  b->now = next;
}

void bus_run(twi_bus* b, chip* lead, uint64_t until) {
  const double end = true_of(b, lead, until);
  bool stopped = false;
  while (b->now < end && !stopped) {
    double next = b->now + kSlice < end ? b->now + kSlice : end;
    if (b->due < next) next = b->due;
    run_turn(b, next);
    stopped = b->master->stop_requested || (b->slave && b->slave->stop_requested);
    if (b->due <= b->now) serve(b);
    poll(b);
  }
  if (!stopped) chip_run(lead, until);
}

static uint8_t read_nothing(chip* c, void* param, uint8_t number) {
  (void)c, (void)param, (void)number;
  return 0xFF;
}

static void write_nothing(chip* c, void* param, uint8_t number, uint8_t value) {
  (void)c, (void)param, (void)number, (void)value;
}

void bench_bus_listen(twi_bus* b, uint32_t address) {
  bus_device* const d = chip_allocate(b->master, sizeof *d);
  d->address = (uint8_t)address;
  d->present = true;
  d->read = read_nothing;
  d->write = write_nothing;
  bus_add(b, d);
}

void bus_add(twi_bus* b, bus_device* d) {
  d->following = b->devices;
  b->devices = d;
}

chip* bus_master(const twi_bus* b) {
  return b->master;
}

twi_bus* bench_bus(chip* master, chip* slave, double rate) {
  if (master->bus || (slave && slave->bus)) return NULL;
  twi_bus* const b = chip_allocate(master, sizeof *b);
  b->master = master;
  b->slave = slave;
  b->rate = rate;
  b->master_zero = master->avr->cycle;
  if (slave) b->slave_zero = slave->avr->cycle;
  rest(b, kFree);
  master->bus = b;
  if (slave) slave->bus = b;
  pin_listen(master, master->model->sda_pin, pin_moves, b);
  pin_listen(master, master->model->scl_pin, pin_moves, b);
  return b;
}

// A chip is about to be freed: the other goes on alone.
void bus_leave(chip* c) {
  twi_bus* const b = c->bus;
  if (!b) return;
  b->master->bus = NULL;
  if (b->slave) b->slave->bus = NULL;
}

double bench_bus_time(const twi_bus* b, const chip* c, uint64_t cycle) {
  return true_of(b, c, cycle);
}
