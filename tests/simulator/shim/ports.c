// Ports: level of every pin from chip, external drivers, open-drain
// devices and pull-ups; pin change and external interrupts; edges to the log
// and to whoever listens.
#include "chip.h"

static uint16_t pin_register(uint8_t port) {
  return port < 7 ? (uint16_t)(0x20 + 3 * port) : (uint16_t)(0x100 + 3 * (port - 7));
}

// Where a port is missing, the other chip's registers may be SRAM.
static bool has_port(const chip* c, uint8_t port) {
  return (c->model->ports >> port) & 1;
}

static uint8_t port_of_register(uint16_t address) {
  return address < 0x100 ? (uint8_t)((address - 0x20) / 3) : (uint8_t)(7 + (address - 0x100) / 3);
}

// Pin change bank and bit, or -1. Bank 1 of the ATmega2560 is PE0 and PJ0..6 (datasheet 15.2.5).
static int pcint_of(const chip* c, uint8_t number) {
  const uint8_t port = number / 8, bit = number % 8;
  for (int bank = 0; bank < 3; bank++) {
    if (c->model->pin_change_port[bank] == port) return 8 * bank + bit;
  }
  if (c->model->pin_change_port[1] != kNoPin) return -1;
  if (number == PIN(4, 0)) return 8;
  return port == 8 && bit < 7 ? 9 + bit : -1;
}

static int external_of(const chip* c, uint8_t number) {
  for (int line = 0; line < 8; line++) {
    if (c->model->external[line] == number) return line;
  }
  return -1;
}

static uint8_t sense_mode(const chip* c, int line) {
  const uint8_t reg = c->avr->data[line < 4 ? REG_EICRA : REG_EICRB];
  return (reg >> (2 * (line & 3))) & 3;
}

static void external_level(chip* c, int line, bool level) {
  const uint8_t bit = (uint8_t)(1u << line);
  const bool low = sense_mode(c, line) == 0 && !level;
  c->external_low = (uint8_t)(low ? c->external_low | bit : c->external_low & ~bit);
  interrupt_refresh(c, (uint8_t)(kVectorInt0 + line));
}

static void pin_changed(chip* c, uint8_t number, bool level) {
  const int change = pcint_of(c, number);
  if (change >= 0 && ((c->avr->data[REG_PCMSK0 + change / 8] >> (change % 8)) & 1)) {
    interrupt_flag(c, (uint8_t)(kVectorPcint0 + change / 8), chip_now(c));
  }
  const int line = external_of(c, number);
  if (line >= 0) {
    const uint8_t mode = sense_mode(c, line);
    if (mode == 0)
      external_level(c, line, level);
    else if (mode == 1 || (mode == 2 && !level) || (mode == 3 && level)) {
      interrupt_flag(c, (uint8_t)(kVectorInt0 + line), chip_now(c));
    }
  }
  timer_capture(c, number, level);
}

static bool resolve(chip* c, uint8_t number) {
  const pin* const p = &c->pins[number];
  const uint16_t base = pin_register(number / 8);
  const uint8_t mask = (uint8_t)(1u << (number % 8));
  const bool port = (c->avr->data[base + 2] & mask) != 0;
  const bool driven = c->powered && (c->avr->data[base + 1] & mask) != 0;
  if (driven) {
    const bool level = p->oc_connected ? p->oc_level : port;
    if ((p->strong == kDriveLow && level) || (p->strong == kDriveHigh && !level) ||
        (p->pulled && level)) {
      fault_add(c, kFaultContention, number);
    }
    return level && !p->pulled;
  }
  if (p->pulled) return false;
  if (p->strong) return p->strong == kDriveHigh;
  if (p->weak) return p->weak == kDriveHigh;
  return c->powered && port && !(c->avr->data[REG_MCUCR] & 0x10);  // own pull-up, PUD
}

void pin_refresh(chip* c, uint8_t number) {
  if (!has_port(c, number / 8)) return;
  pin* const p = &c->pins[number];
  const bool level = resolve(c, number);
  if (level == p->level) return;
  p->level = level;
  if (p->watched) log_add(c, kLogPin, number, level);
  if (c->powered) pin_changed(c, number, level);
  for (pin_listener* l = p->listeners; l; l = l->next) l->run(c, l->param, number, level);
  if (p->notify && c->callback) c->callback(kLogPin, number, chip_now(c), level);
}

void pin_strong(chip* c, uint8_t number, enum drive drive) {
  c->pins[number].strong = (uint8_t)drive;
  pin_refresh(c, number);
}

void pin_pull_low(chip* c, uint8_t number, bool low) {
  pin* const p = &c->pins[number];
  p->pulled = (uint8_t)(low ? p->pulled + 1 : p->pulled - 1);
  pin_refresh(c, number);
}

void pin_oc(chip* c, uint8_t number, bool connected, bool level) {
  c->pins[number].oc_connected = connected;
  c->pins[number].oc_level = level;
  pin_refresh(c, number);
}

void pin_listen(chip* c, uint8_t number, pin_fn run, void* param) {
  pin_listener* const l = chip_allocate(c, sizeof *l);
  l->run = run;
  l->param = param;
  l->next = c->pins[number].listeners;
  c->pins[number].listeners = l;
}

static uint8_t read_pins(chip* c, uint16_t address, void* param) {
  (void)param;
  const uint8_t first = PIN(port_of_register(address), 0);
  uint8_t value = 0;
  for (uint8_t i = 0; i < 8; i++) value = (uint8_t)(value | c->pins[first + i].level << i);
  return value;
}

static void write_port(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  const uint8_t port = port_of_register(address);
  const uint16_t base = pin_register(port);
  if (address == base) {  // writing ones to PINx toggles PORTx
    address = (uint16_t)(base + 2);
    value = c->avr->data[address] ^ written_ones(c, value);
  }
  const uint8_t changed = c->avr->data[address] ^ value;
  c->avr->data[address] = value;
  for (uint8_t i = 0; i < 8; i++) {
    if ((changed >> i) & 1) pin_refresh(c, PIN(port, i));
  }
}

static void write_flags(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  c->avr->data[address] &= (uint8_t)~written_ones(c, value);
  const uint8_t first = address == REG_PCIFR ? kVectorPcint0 : kVectorInt0;
  const uint8_t count = address == REG_PCIFR ? 3 : 8;
  for (uint8_t i = 0; i < count; i++) interrupt_refresh(c, (uint8_t)(first + i));
}

static void write_enable(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  c->avr->data[address] = value;
  if (address == REG_PCICR) {
    for (uint8_t i = 0; i < 3; i++) interrupt_refresh(c, (uint8_t)(kVectorPcint0 + i));
    return;
  }
  // EIMSK and both sense registers: a line in level mode requests as long as it
  // is low
  for (int line = 0; line < 8; line++) {
    const uint8_t number = c->model->external[line];
    if (number != kNoPin) external_level(c, line, c->pins[number].level);
  }
}

static void write_mcucr(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  // IVSEL changes only in the four cycles after IVCE; the bootloaders in use
  // write both at once
  c->avr->data[address] = value & 0xF3;
  for (uint8_t i = 0; i < kPinCount; i++) pin_refresh(c, i);
}

void ports_init(chip* c) {
  for (uint8_t port = 0; port < kPortCount; port++) {
    if (!has_port(c, port)) continue;
    const uint16_t base = pin_register(port);
    hook_read(c, base, read_pins, NULL);
    for (uint16_t i = 0; i < 3; i++) hook_write(c, (uint16_t)(base + i), write_port, NULL);
  }
  hook_write(c, REG_PCIFR, write_flags, NULL);
  hook_write(c, REG_EIFR, write_flags, NULL);
  hook_write(c, REG_PCICR, write_enable, NULL);
  hook_write(c, REG_EIMSK, write_enable, NULL);
  hook_write(c, REG_EICRA, write_enable, NULL);
  hook_write(c, REG_EICRB, write_enable, NULL);
  hook_write(c, REG_MCUCR, write_mcucr, NULL);
}

// The registers are zero already: every output that falls here is an edge the
// world sees.
void ports_reset(chip* c) {
  for (uint8_t i = 0; i < kPinCount; i++) {
    c->pins[i].oc_connected = false;
    pin_refresh(c, i);
  }
}
