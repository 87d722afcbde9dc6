// EEPROM: read at once, written in the background.
#pragma once

#include <stdint.h>

namespace hal {

constexpr uint16_t kEepromBytes = 4096;  // of the Mega; the IMU's chip has 1024

// Waits for a write just begun (3.4 ms); of a memory that stays busy, 0xFF, as of an erased one.
uint8_t read_eeprom(uint16_t address);

// `size` bytes from `address` on, as fast as the chip gives them. A memory that stays busy: 0xFF.
void read_eeprom_bytes(uint16_t address, void* to, uint8_t size);

// False while the last byte is still being written (3.4 ms). Main loop only.
bool eeprom_ready();

// Starts writing one byte; only when ready. A byte that has this value already is left alone.
void write_eeprom(uint16_t address, uint8_t value);

}  // namespace hal
