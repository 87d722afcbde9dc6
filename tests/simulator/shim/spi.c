// SPI master (datasheet section 21): eight bits at the clock set in SPCR and
// SPSR, then SPIF; WCOL on a write during a transfer; a low SS input takes the
// master role away. Bytes go to the device whose chip select pin is low.
#include "chip.h"

uint32_t spi_divider(const chip* c) {
  static const uint32_t kDividers[4] = {4, 16, 64, 128};
  const uint32_t d = kDividers[c->avr->data[REG_SPCR] & 3];
  return c->avr->data[REG_SPSR] & 1 ? d / 2 : d;
}

static void done(chip* c, void* param, uint64_t argument) {
  (void)param, (void)argument;
  uint8_t in = 0xFF;  // MISO has a pull-up
  for (uint32_t i = 0; i < c->spi.device_count; i++) {
    spi_device* const d = &c->spi.device[i];
    const bool selected = !c->pins[d->cs_pin].level;
    in &= d->exchange(c, d->param, c->spi.out, selected);
  }
  c->spi.received = in;
  c->spi.busy = false;
  c->spi.flag_read = false;
  c->spi.bytes++;
  interrupt_flag(c, kVectorSpi, chip_now(c));
}

static void clear_after_access(chip* c) {
  // SPIF and WCOL go when SPSR was read with the flag set and SPDR is touched
  // afterwards.
  if (!c->spi.flag_read) return;
  c->spi.flag_read = false;
  c->avr->data[REG_SPSR] &= (uint8_t)~0xC0u;
  interrupt_refresh(c, kVectorSpi);
}

static void lose_master(chip* c) {
  const uint8_t control = c->avr->data[REG_SPCR];
  const uint8_t ss = c->model->ss_pin;
  const bool ss_is_input = !((c->avr->data[0x24] >> (ss % 8)) & 1);  // PORTB on both chips
  if ((control & 0x50) == 0x50 && ss_is_input && !c->pins[ss].level) {
    c->avr->data[REG_SPCR] &= (uint8_t)~0x10u;
    event_cancel(c, &c->spi.due);
    c->spi.busy = false;
    interrupt_flag(c, kVectorSpi, chip_now(c));
  }
}

static void write_data(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)address, (void)param;
  clear_after_access(c);
  lose_master(c);
  const uint8_t control = c->avr->data[REG_SPCR];
  if (!(control & 0x40)) return;
  if (!(control & 0x10)) {
    fault_add(c, kFaultSpiWithoutModel, value);
    return;
  }
  if (c->spi.busy) {
    c->avr->data[REG_SPSR] |= 0x40;
    return;
  }
  c->spi.out = value;
  c->spi.busy = true;
  event_at(c, &c->spi.due, chip_now(c) + 8u * spi_divider(c));
}

static uint8_t read_data(chip* c, uint16_t address, void* param) {
  (void)address, (void)param;
  clear_after_access(c);
  return c->spi.received;
}

static uint8_t read_status(chip* c, uint16_t address, void* param) {
  (void)param;
  const uint8_t value = c->avr->data[address];
  if (value & 0xC0) c->spi.flag_read = true;
  return value;
}

static void write_status(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  c->avr->data[address] = (uint8_t)((c->avr->data[address] & 0xC0) | (value & 1));
}

static void write_control(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  c->avr->data[address] = value;
  if (!(value & 0x40)) {
    event_cancel(c, &c->spi.due);
    c->spi.busy = false;
  }
  lose_master(c);
  interrupt_refresh(c, kVectorSpi);
}

static void ss_changed(chip* c, void* param, uint8_t number, bool level) {
  (void)param, (void)number, (void)level;
  lose_master(c);
}

void spi_init(chip* c) {
  c->spi.due.run = done;
  hook_write(c, REG_SPDR, write_data, NULL);
  hook_read(c, REG_SPDR, read_data, NULL);
  hook_read(c, REG_SPSR, read_status, NULL);
  hook_write(c, REG_SPSR, write_status, NULL);
  hook_write(c, REG_SPCR, write_control, NULL);
  pin_listen(c, c->model->ss_pin, ss_changed, NULL);
}

void spi_reset(chip* c) {
  event_cancel(c, &c->spi.due);
  c->spi.busy = c->spi.flag_read = false;
  c->spi.received = 0;
}
