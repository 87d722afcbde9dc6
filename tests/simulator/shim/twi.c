// TWI as a slave receiver (datasheet section 24) with an external master on the
// bus. TWINT holds SCL low until the program clears it; the stretch is
// measured. The master's packets queue up, wait for a free bus, and may die in
// the middle of a byte with the lines released or one of them held.
#include <stdlib.h>
#include <string.h>

#include "bus.h"
#include "twi.h"

enum { kTwint = 0x80, kTwea = 0x40, kTwsta = 0x20, kTwsto = 0x10, kTwen = 0x04 };
enum phase {
  kBusIdle,
  kBusStart,
  kBusAddress,
  kBusHeldAfterAddress,
  kBusByte,
  kBusHeldAfterByte,
  kBusStop,
  kBusWaitStart,
  kBusDie,
};

static uint8_t control(const chip* c) {
  return c->avr->data[REG_TWCR];
}
static bool line_stuck(const chip* c) {
  return c->twi.sda_held || c->twi.scl_held;
}

static void raise(chip* c, uint8_t status) {
  uint8_t* const s = &c->avr->data[REG_TWSR];
  *s = (uint8_t)((*s & 0x03) | status);
  interrupt_flag(c, kVectorTwi, chip_now(c));
}

static void go(chip* c, enum phase phase, uint64_t cycles) {
  c->twi.phase = (uint8_t)phase;
  event_at(c, &c->twi.due, chip_now(c) + cycles);
}

static void hold(chip* c, enum phase phase) {
  c->twi.phase = (uint8_t)phase;
  c->twi.wait_from = chip_now(c);
}

static uint64_t released(chip* c) {
  const uint64_t waited = chip_now(c) - c->twi.wait_from;
  c->twi.stretch_cycles += waited;
  return waited;
}

// The packet at the head is over: report it and let the next one have the bus.
static void finish(chip* c, bool died) {
  twi_packet* const p = c->twi.queue;
  log_add(c, kLogTwi, died ? kTwiDied : kTwiDone, (p->id << 8) | c->twi.acked);
  log_add(c, kLogTwi, kTwiStretch, (uint32_t)c->twi.stretch_cycles);
  c->twi.queue = p->next;
  if (!c->twi.queue) c->twi.queue_end = NULL;
  const uint32_t scl = p->scl_cycles;
  free(p);
  c->twi.phase = kBusIdle;
  if (c->twi.queue) {
    const uint64_t free_at = chip_now(c) + scl;
    const uint64_t start = c->twi.queue->start;
    go(c, kBusStart, (start > free_at ? start : free_at) - chip_now(c));
  }
}

static bool addressed_by(const chip* c, uint8_t address) {
  const uint8_t own = c->avr->data[REG_TWAR], mask = c->avr->data[REG_TWAMR];
  return (((uint8_t)(address << 1) ^ own) & ~mask & 0xFE) == 0;
}

static void begin_byte(chip* c) {
  const twi_packet* const p = c->twi.queue;
  const bool dies = p->abort_kind != kTwiLives && c->twi.index == p->abort_after;
  go(c, dies ? kBusDie : kBusByte, (uint64_t)p->scl_cycles * (dies ? 4 : 9));
}

void twi_slave_start(chip* c) {
  if (!(control(c) & kTwen)) return;
  const bool broken = c->twi.mid_byte, was_addressed = c->twi.addressed;
  c->twi.mid_byte = c->twi.addressed = false;
  if (broken)
    raise(c, 0x00);  // START in the middle of a byte
  else if (was_addressed)
    raise(c, 0xA0);
}

// A slave that sends is not modelled: nobody answers a read.
bool twi_slave_address(chip* c, uint8_t address_and_direction) {
  const uint8_t address = address_and_direction >> 1;
  const bool general = address == 0 && (c->avr->data[REG_TWAR] & 1);
  if ((address_and_direction & 1) || (control(c) & (kTwen | kTwea)) != (kTwen | kTwea) ||
      !(general || addressed_by(c, address))) {
    return false;
  }
  c->twi.addressed = true;
  c->twi.general_call = general;
  c->avr->data[REG_TWDR] = address_and_direction;
  raise(c, general ? 0x70 : 0x60);
  return true;
}

bool twi_slave_byte(chip* c, uint8_t value) {
  if (!c->twi.addressed || !(control(c) & kTwen)) return false;
  c->avr->data[REG_TWDR] = value;
  if (!c->twi.acknowledge) {
    c->twi.addressed = false;
    raise(c, c->twi.general_call ? 0x98 : 0x88);
    return false;
  }
  raise(c, c->twi.general_call ? 0x90 : 0x80);
  return true;
}

void twi_slave_stop(chip* c) {
  const bool tell = c->twi.addressed && (control(c) & kTwen);
  const bool broken = c->twi.mid_byte && (control(c) & kTwen);
  c->twi.addressed = c->twi.mid_byte = false;
  if (broken)
    raise(c, 0x00);
  else if (tell)
    raise(c, 0xA0);
}

void twi_slave_break(chip* c) {
  c->twi.mid_byte = c->twi.addressed;
}

bool twi_slave_holds(const chip* c) {
  return (control(c) & (kTwen | kTwint)) == (kTwen | kTwint);
}

static void after_address(chip* c) {
  const twi_packet* const p = c->twi.queue;
  if (twi_slave_address(c, (uint8_t)(p->address << 1))) {
    c->twi.acked = 0;
    hold(c, kBusHeldAfterAddress);
    return;
  }
  log_add(c, kLogTwi, kTwiRefused, p->id);
  go(c, kBusStop, p->scl_cycles);
}

static void after_byte(chip* c) {
  const twi_packet* const p = c->twi.queue;
  if (!c->twi.addressed || !(control(c) & kTwen)) {  // nobody answers any more
    go(c, kBusStop, p->scl_cycles);
    return;
  }
  if (twi_slave_byte(c, p->data[c->twi.index++])) c->twi.acked++;
  hold(c, kBusHeldAfterByte);
}

static void master_dies(chip* c) {
  const twi_packet* const p = c->twi.queue;
  c->twi.mid_byte = c->twi.addressed;
  const uint8_t kind = p->abort_kind;
  if (kind == kTwiHoldsSda) twi_hold(c, true, c->twi.scl_held);
  if (kind == kTwiHoldsScl) twi_hold(c, c->twi.sda_held, true);
  finish(c, true);
}

static void bus_event(chip* c, void* param, uint64_t argument) {
  (void)param, (void)argument;
  switch ((enum phase)c->twi.phase) {
    case kBusStart:
    case kBusWaitStart:
      if (line_stuck(c)) {
        c->twi.phase = kBusWaitStart;  // twi_hold wakes it
        return;
      }
      c->twi.stretch_cycles = 0;
      c->twi.acked = 0;
      c->twi.index = 0;
      twi_slave_start(c);
      if (twi_slave_holds(c)) {
        hold(c, kBusStart);  // the slave still holds SCL from its last event
        return;
      }
      go(c, kBusAddress, 10u * c->twi.queue->scl_cycles);
      return;
    case kBusAddress:
      after_address(c);
      return;
    case kBusByte:
      after_byte(c);
      return;
    case kBusDie:
      master_dies(c);
      return;
    case kBusStop:
      twi_slave_stop(c);
      finish(c, false);
      return;
    default:
      return;
  }
}

static void continue_bus(chip* c) {
  const twi_packet* const p = c->twi.queue;
  switch ((enum phase)c->twi.phase) {
    case kBusStart:
      released(c);
      go(c, kBusAddress, 10u * p->scl_cycles);
      return;
    case kBusHeldAfterAddress:
    case kBusHeldAfterByte:
      released(c);
      if (!c->twi.addressed || c->twi.index >= p->length) {
        if (p->abort_kind != kTwiLives && c->twi.addressed)
          begin_byte(c);
        else
          go(c, kBusStop, p->scl_cycles);
      } else {
        begin_byte(c);
      }
      return;
    default:
      return;
  }
}

static bool waiting_for_program(const chip* c) {
  return c->twi.phase == kBusHeldAfterAddress || c->twi.phase == kBusHeldAfterByte ||
         (c->twi.phase == kBusStart && c->twi.due.slot == 0);
}

static void write_control(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  if (c->bus && bus_master(c->bus) == c) {
    bus_control(c->bus, value);
    return;
  }
  uint8_t* const r = &c->avr->data[address];
  const bool clears = (value & kTwint) != 0;
  if (clears || !(value & kTwen)) c->twi.released_at = chip_now(c);
  if (value & kTwsta) fault_add(c, kFaultTwiMaster, value);
  *r = (uint8_t)((*r & kTwint) | (value & ~(kTwint | kTwsta | kTwsto)));
  if (!(value & kTwen)) {
    *r &= (uint8_t)~kTwint;
    c->twi.addressed = c->twi.mid_byte = false;
    c->avr->data[REG_TWSR] |= 0xF8;
    if (waiting_for_program(c)) continue_bus(c);  // the lines are released
  } else if (clears && (*r & kTwint)) {
    *r &= (uint8_t)~kTwint;
    c->avr->data[REG_TWSR] |= 0xF8;
    c->twi.acknowledge = (value & kTwea) != 0;
    if (waiting_for_program(c)) continue_bus(c);
  } else if (clears) {
    c->twi.acknowledge = (value & kTwea) != 0;
  }
  interrupt_refresh(c, kVectorTwi);
}

static void write_status(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  c->avr->data[address] = (uint8_t)((c->avr->data[address] & 0xF8) | (value & 0x03));
}

void twi_hold(chip* c, bool sda, bool scl) {
  if (sda != c->twi.sda_held) pin_pull_low(c, c->model->sda_pin, sda);
  if (scl != c->twi.scl_held) pin_pull_low(c, c->model->scl_pin, scl);
  const bool sda_let_go = c->twi.sda_held && !sda;
  c->twi.sda_held = sda;
  c->twi.scl_held = scl;
  if (sda_let_go && !scl && c->twi.mid_byte && (control(c) & kTwen)) {
    c->twi.mid_byte = false;  // SDA rises while SCL is high: a STOP in the middle of a byte
    c->twi.addressed = false;
    raise(c, 0x00);
  }
  if (!line_stuck(c) && c->twi.queue && c->twi.phase == kBusWaitStart) go(c, kBusStart, 0);
}

void twi_queue(chip* c, const twi_packet* packet) {
  twi_packet* const p = malloc(sizeof *p);
  if (!p) abort();
  *p = *packet;
  p->next = NULL;
  if (c->twi.queue_end)
    c->twi.queue_end->next = p;
  else
    c->twi.queue = p;
  c->twi.queue_end = p;
  if (c->twi.queue != p) return;
  go(c, kBusStart, p->start > chip_now(c) ? p->start - chip_now(c) : 0);
}

void twi_init(chip* c) {
  c->twi.due.run = bus_event;
  hook_write(c, REG_TWCR, write_control, NULL);
  hook_write(c, REG_TWSR, write_status, NULL);
  c->pins[c->model->scl_pin].weak = c->pins[c->model->sda_pin].weak = kDriveHigh;
}

// The master outside goes on: a reset slave lets the lines go and answers
// nothing.
void twi_reset(chip* c) {
  c->avr->data[REG_TWSR] = 0xF8;
  c->avr->data[REG_TWDR] = 0xFF;
  c->avr->data[REG_TWAR] = 0xFE;
  c->twi.addressed = c->twi.mid_byte = c->twi.acknowledge = false;
  c->twi.released_at = chip_now(c);
  if (waiting_for_program(c)) continue_bus(c);
  if (c->bus && bus_master(c->bus) == c) bus_abandon(c->bus);
}

void twi_free(chip* c) {
  while (c->twi.queue) {
    twi_packet* const p = c->twi.queue;
    c->twi.queue = p->next;
    free(p);
  }
}
