// EEPROM (3.4 ms per byte, EEMPE window), watchdog (interrupt, reset, both) and
// self-programming of the flash: the three things that wait in milliseconds.
// Datasheet sections 8.6, 12.4, 29.
#include <string.h>

#include "chip.h"

enum { kEempe = 0x04, kEepe = 0x02, kEere = 0x01 };

// ---- EEPROM
// ---------------------------------------------------------------------------------

static void eeprom_done(chip* c, void* param, uint64_t argument) {
  (void)param, (void)argument;
  c->eeprom.programming = false;
  c->avr->data[REG_EECR] &= (uint8_t)~kEepe;
  uint8_t* const cell = &c->eeprom.memory[c->eeprom.address];
  if (c->eeprom.mode == 1)
    *cell = 0xFF;
  else if (c->eeprom.mode == 2)
    *cell &= c->eeprom.value;
  else
    *cell = c->eeprom.value;
  interrupt_refresh(c, kVectorEeReady);
}

static void eeprom_window_over(chip* c, void* param, uint64_t argument) {
  (void)param, (void)argument;
  c->avr->data[REG_EECR] &= (uint8_t)~kEempe;
}

static void write_eecr(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  uint8_t* const control = &c->avr->data[address];
  const uint16_t cell =
      (uint16_t)((c->avr->data[REG_EEARL] | c->avr->data[REG_EEARH] << 8) & c->model->eeprom_last);
  const bool armed = (*control & kEempe) != 0;
  const bool busy = c->eeprom.programming;
  *control = (uint8_t)((*control & (kEempe | kEepe)) | (value & (busy ? 0x08 : 0x38)));
  if ((value & kEepe) && armed && !busy) {
    static const uint32_t kCycles[4] = {54400, 28800, 28800, 54400};  // 3.4, 1.8, 1.8 ms
    c->eeprom.mode = (value >> 4) & 3;
    c->eeprom.programming = true;
    c->eeprom.address = cell;
    c->eeprom.value = c->avr->data[REG_EEDR];
    *control = (uint8_t)((*control & ~kEempe) | kEepe);
    event_cancel(c, &c->eeprom.window);
    event_at(c, &c->eeprom.due, chip_now(c) + kCycles[c->eeprom.mode]);
    c->halt_cycles += 2;
  } else if ((value & kEempe) && !armed) {
    *control |= kEempe;
    event_at(c, &c->eeprom.window,
             chip_now(c) + 2 + 4);  // SBI takes two, then four cycles
  }
  if ((value & kEere) && !busy) {
    c->avr->data[REG_EEDR] = c->eeprom.memory[cell];
    c->halt_cycles += 4;
    c->avr->run_cycle_count = 0;  // at once: many reads in one burst would hold interrupts up
  }
  interrupt_refresh(c, kVectorEeReady);
}

void eeprom_init(chip* c) {
  memset(c->eeprom.memory, 0xFF, sizeof c->eeprom.memory);
  c->eeprom.due.run = eeprom_done;
  c->eeprom.window.run = eeprom_window_over;
  hook_write(c, REG_EECR, write_eecr, NULL);
}

void eeprom_reset(chip* c) {
  // A write that has begun finishes through a reset (datasheet 8.6.3).
  if (c->eeprom.programming) c->avr->data[REG_EECR] |= kEepe;
  event_cancel(c, &c->eeprom.window);
}

void eeprom_power_lost(chip* c) {
  if (!c->eeprom.programming) return;
  c->eeprom.programming = false;
  event_cancel(c, &c->eeprom.due);
  c->eeprom.memory[c->eeprom.address] = (uint8_t)chip_random(c);
}

// ---- Watchdog
// -------------------------------------------------------------------------------

static uint64_t watchdog_cycles(const chip* c) {
  const uint8_t r = c->avr->data[REG_WDTCSR];
  const uint8_t select = (uint8_t)((r & 7) | ((r >> 2) & 8));
  return (UINT64_C(2048) << (select > 9 ? 9 : select)) * 125;  // 128 kHz against 16 MHz
}

void watchdog_feed(chip* c) {
  if (c->avr->data[REG_WDTCSR] & 0x48) {
    event_at(c, &c->watchdog.due, chip_now(c) + watchdog_cycles(c));
  } else {
    event_cancel(c, &c->watchdog.due);
  }
}

static void watchdog_due(chip* c, void* param, uint64_t argument) {
  (void)param, (void)argument;
  const uint8_t r = c->avr->data[REG_WDTCSR];
  // In interrupt and reset mode an interrupt not served before the next
  // time-out resets (DS 12.4).
  const bool unserved = (r & 0xC8) == 0xC8;
  if ((r & 0x40) && !unserved) {
    interrupt_flag(c, kVectorWdt, chip_now(c));
    watchdog_feed(c);
  } else if (r & 0x08) {
    chip_pulse_reset(c, kWatchdog);
  }
}

static void write_wdtcsr(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  uint8_t r = c->avr->data[address];
  const bool open = chip_now(c) < c->watchdog.change_until;
  if (written_ones(c, value) & 0x80) r &= 0x7F;  // WDIF
  r = (uint8_t)((r & ~0x40) | (value & 0x40));
  if ((value & 0x18) == 0x18) {
    c->watchdog.change_until = chip_now(c) + 2 + 4;  // STS takes two, then four cycles
    r |= 0x08;
  } else if (open) {
    r = (uint8_t)((r & 0xC0) | (value & 0x2F));
    c->watchdog.change_until = 0;
  } else if (value & 0x08) {
    r |= 0x08;  // setting WDE needs no sequence
  }
  if (c->avr->data[REG_MCUSR] & kWatchdog) r |= 0x08;  // WDRF overrides WDE
  const uint8_t before = c->avr->data[address];
  c->avr->data[address] = r;
  interrupt_refresh(c, kVectorWdt);
  // Only WDR and a new time-out start the count again; arming an interrupt does
  // not.
  const bool was_on = (before & 0x48) != 0, is_on = (r & 0x48) != 0;
  if (was_on != is_on || ((before ^ r) & 0x27)) watchdog_feed(c);
}

static void write_mcusr(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  c->avr->data[address] &= value;  // flags are cleared by writing zero
}

void watchdog_init(chip* c) {
  c->watchdog.due.run = watchdog_due;
  hook_write(c, REG_WDTCSR, write_wdtcsr, NULL);
  hook_write(c, REG_MCUSR, write_mcusr, NULL);
}

// After a watchdog reset WDE stays set with the shortest time-out: 16 ms to
// clear it or reset again.
void watchdog_reset_registers(chip* c) {
  c->watchdog.change_until = 0;
  c->avr->data[REG_WDTCSR] = c->avr->data[REG_MCUSR] & kWatchdog ? 0x08 : 0;
  event_cancel(c, &c->watchdog.due);
}

// ---- Flash
// ----------------------------------------------------------------------------------

enum { kSpmen = 0x01, kPgers = 0x02, kPgwrt = 0x04, kRwwsre = 0x10, kRwwsb = 0x40 };

static void flash_done(chip* c, void* param, uint64_t argument) {
  (void)param, (void)argument;
  c->flash.busy = false;
  c->avr->data[REG_SPMCSR] &= (uint8_t)~0x2Fu;
  interrupt_refresh(c, kVectorSpmReady);
}

static void write_spmcsr(chip* c, uint16_t address, uint8_t value, void* param) {
  (void)param;
  if (c->flash.busy) return;
  c->avr->data[address] = (uint8_t)((c->avr->data[address] & kRwwsb) | (value & 0xBF));
  if (value & kSpmen) {
    c->flash.armed_until = chip_now(c) + 2 + 4;
    event_at(c, &c->flash.due,
             c->flash.armed_until);  // the bits fall by themselves
  }
  interrupt_refresh(c, kVectorSpmReady);
}

static void program(chip* c, uint32_t page, bool erase) {
  uint8_t* const flash = c->avr->flash + page;
  for (uint32_t i = 0; i < c->model->page_bytes; i++) {
    if (erase)
      flash[i] = 0xFF;
    else if (c->flash.filled[i])
      flash[i] &= c->flash.buffer[i];
  }
  if (!erase) memset(c->flash.filled, 0, sizeof c->flash.filled);
  c->flash.busy = true;
  event_at(c, &c->flash.due,
           chip_now(c) + 68000);  // 4.25 ms, between 3.7 and 4.5
  if (page < c->model->boot_start)
    c->avr->data[REG_SPMCSR] |= kRwwsb;
  else
    c->halt_cycles += 68000;  // the boot section itself: the CPU stops
}

// SPM, as the core reports it. Executed from the boot section only.
void flash_store(chip* c) {
  const uint8_t r = c->avr->data[REG_SPMCSR];
  if (!(r & kSpmen) || chip_now(c) > c->flash.armed_until || c->flash.busy) return;
  if (c->avr->pc < c->model->boot_start) return;
  const uint32_t z =
      (uint32_t)(c->avr->data[R_ZL] | c->avr->data[R_ZH] << 8 | c->avr->data[REG_RAMPZ] << 16) &
      c->avr->flashend;
  const uint32_t in_page = c->model->page_bytes - 1;
  event_cancel(c, &c->flash.due);
  if (r & kPgers) {
    program(c, z & ~in_page, true);
  } else if (r & kPgwrt) {
    program(c, z & ~in_page, false);
  } else if (r & kRwwsre) {
    c->avr->data[REG_SPMCSR] &= (uint8_t) ~(kRwwsb | 0x3Fu);
  } else if (r & 0x08) {
    fault_add(c, kFaultFlash, r);  // lock bits
    c->avr->data[REG_SPMCSR] &= (uint8_t)~0x3Fu;
  } else {
    const uint32_t at = z & in_page & ~1u;
    c->flash.buffer[at] = c->avr->data[0];
    c->flash.buffer[at + 1] = c->avr->data[1];
    c->flash.filled[at] = c->flash.filled[at + 1] = true;
    c->avr->data[REG_SPMCSR] &= (uint8_t)~0x3Fu;
  }
  interrupt_refresh(c, kVectorSpmReady);
}

void flash_init(chip* c) {
  c->flash.due.run = flash_done;
  hook_write(c, REG_SPMCSR, write_spmcsr, NULL);
}

void flash_reset(chip* c) {
  event_cancel(c, &c->flash.due);
  c->flash.busy = false;
  memset(c->flash.filled, 0, sizeof c->flash.filled);
}
