// Power, reset and start-up: registers cleared, pins let go (every edge is seen
// outside), MCUSR tells the cause, SRAM survives all but a loss of power.
#include <string.h>

#include "chip.h"

static void clear_registers(chip* c) {
  avr_t* const avr = c->avr;
  const uint8_t mcusr = avr->data[REG_MCUSR];
  const uint8_t eecr = avr->data[REG_EECR];
  memset(avr->data + 32, 0, c->model->last_io + 1u - 32u);
  avr->data[REG_MCUSR] = mcusr;
  avr->data[REG_EECR] = eecr & 0x30;
  for (int i = 0; i < 8; i++) avr->sreg[i] = 0;
  avr->interrupt_state = 0;
  avr->data[R_SPL] = (uint8_t)avr->ramend;
  avr->data[R_SPH] = (uint8_t)(avr->ramend >> 8);
  avr->pc = c->reset_pc;
  avr->state = cpu_Running;
  c->halt_cycles = 0;
}

static void reset_everything(chip* c) {
  clear_registers(c);
  interrupts_reset(c);
  timers_reset(c);
  adc_reset(c);
  spi_reset(c);
  uarts_reset(c);
  twi_reset(c);
  eeprom_reset(c);
  flash_reset(c);
  watchdog_reset_registers(c);
  ports_reset(c);
}

void chip_assert_reset(chip* c, uint8_t cause) {
  c->last_cause = cause;
  c->avr->data[REG_MCUSR] =
      cause == kPowerOn ? kPowerOn : (uint8_t)(c->avr->data[REG_MCUSR] | cause);
  c->reset_sources |= cause;
  c->held = true;
  event_cancel(c, &c->startup);
  log_add(c, kLogReset, 0, cause);
  reset_everything(c);
  c->avr->run_cycle_count = 0;
}

static void started(chip* c, void* param, uint64_t argument) {
  (void)param, (void)argument;
  c->held = false;
  log_add(c, kLogOutOfReset, 0, c->last_cause);
  if (c->callback) c->callback(kLogOutOfReset, 0, chip_now(c), c->last_cause);
  watchdog_feed(c);
}

void chip_release_reset(chip* c, uint8_t cause) {
  c->reset_sources &= (uint8_t)~cause;
  if (c->reset_sources || !c->powered) return;
  c->startup.run = started;
  event_at(c, &c->startup, chip_now(c) + c->startup_cycles);
}

void chip_pulse_reset(chip* c, uint8_t cause) {
  chip_assert_reset(c, cause);
  chip_release_reset(c, cause);
}

static void forget_memory(chip* c) {
  // What SRAM holds at power-on is undefined; a seed makes it repeatable.
  for (uint32_t i = c->model->last_io + 1u; i <= c->avr->ramend; i++) {
    c->avr->data[i] = (uint8_t)chip_random(c);
  }
  for (uint32_t i = 0; i < 32; i++) c->avr->data[i] = (uint8_t)chip_random(c);
}

void chip_power_on(chip* c) {
  if (c->powered) return;
  c->powered = true;
  log_add(c, kLogPower, 0, 1);
  forget_memory(c);
  c->lowest_sp = c->avr->ramend;
  c->reset_sources = 0;
  chip_pulse_reset(c, kPowerOn);
}

void chip_power_off(chip* c) {
  if (!c->powered) return;
  c->powered = false;
  log_add(c, kLogPower, 0, 0);
  eeprom_power_lost(c);
  event_cancel(c, &c->startup);
  c->held = true;
  reset_everything(c);
  c->avr->data[REG_MCUSR] = 0;
  if (c->callback) c->callback(kLogPower, 0, chip_now(c), 0);
}
