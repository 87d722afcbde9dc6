// ATmega2560: DS40002211A; ATmega328P: DS40002061B (pins 1.1, vectors 12.4, register summary 31).
#include "model.h"

#include <stddef.h>

#include "registers.h"

#define PIN_OF(port_index, bit) ((uint8_t)((port_index)*8 + (bit)))
enum { kB = 1, kC = 2, kD = 3, kE = 4, kG = 6, kH = 7, kJ = 8, kK = 9, kL = 10 };

static const uint8_t kVectors328p[kVectorCount] = {
    [0] = 0,          [1] = 1,          [2] = 2,  // reset, INT0, INT1
    [3] = kNoVector,  [4] = kNoVector,  [5] = kNoVector,  [6] = kNoVector,  [7] = kNoVector,
    [8] = kNoVector,  [9] = 3,          [10] = 4,
    [11] = 5,                                      // pin change
    [12] = 6,                                      // watchdog
    [13] = 7,         [14] = 8,         [15] = 9,  // timer 2
    [16] = 10,        [17] = 11,        [18] = 12,        [19] = kNoVector,
    [20] = 13,                                      // timer 1, no channel C
    [21] = 14,        [22] = 15,        [23] = 16,  // timer 0
    [24] = 17,                                      // SPI
    [25] = 18,        [26] = 19,        [27] = 20,  // USART
    [28] = 23,        [29] = 21,        [30] = 22,  // comparator, ADC, EEPROM
    [31] = kNoVector, [32] = kNoVector, [33] = kNoVector, [34] = kNoVector, [35] = kNoVector,
    [36] = kNoVector, [37] = kNoVector, [38] = kNoVector, [39] = 24,        [40] = 25,  // TWI, SPM
    [41] = kNoVector, [42] = kNoVector, [43] = kNoVector, [44] = kNoVector, [45] = kNoVector,
    [46] = kNoVector, [47] = kNoVector, [48] = kNoVector, [49] = kNoVector, [50] = kNoVector,
    [51] = kNoVector, [52] = kNoVector, [53] = kNoVector, [54] = kNoVector, [55] = kNoVector,
    [56] = kNoVector,
};

static const chip_model kModels[kChipKinds] = {
    {
        .name = "atmega2560",
        .last_io = REG_LAST_IO,
        .ports = 0x7FF,
        .timers = 6,
        .uarts = 4,
        .entry_cycles = 5,
        .eeprom_last = 0xFFF,
        .boot_start = 0x3E000,
        .page_bytes = 256,
        .ss_pin = PIN_OF(kB, 0),
        .scl_pin = PIN_OF(kD, 0),
        .sda_pin = PIN_OF(kD, 1),
        .pin_change_port = {kB, kNoPin, kK},  // bank 1 is PE0 and PJ0..6
        .external = {PIN_OF(kD, 0),
                     PIN_OF(kD, 1),
                     PIN_OF(kD, 2),
                     PIN_OF(kD, 3),
                     PIN_OF(kE, 4),
                     PIN_OF(kE, 5),
                     PIN_OF(kE, 6),
                     PIN_OF(kE, 7)},
        .outputs = {{PIN_OF(kB, 7), PIN_OF(kG, 5), kNoPin},
                    {PIN_OF(kB, 5), PIN_OF(kB, 6), PIN_OF(kB, 7)},
                    {PIN_OF(kB, 4), PIN_OF(kH, 6), kNoPin},
                    {PIN_OF(kE, 3), PIN_OF(kE, 4), PIN_OF(kE, 5)},
                    {PIN_OF(kH, 3), PIN_OF(kH, 4), PIN_OF(kH, 5)},
                    {PIN_OF(kL, 3), PIN_OF(kL, 4), PIN_OF(kL, 5)}},
        .captures = {kNoPin, PIN_OF(kD, 4), kNoPin, PIN_OF(kE, 7), PIN_OF(kL, 0), PIN_OF(kL, 1)},
        .vectors = NULL,
    },
    {
        .name = "atmega328p",
        .last_io = 0xFF,
        .ports = 1U << kB | 1U << kC | 1U << kD,
        .timers = 3,
        .uarts = 1,
        .entry_cycles = 4,
        .eeprom_last = 0x3FF,
        .boot_start = 0x7800,  // the board's fuses: 2 KiB
        .page_bytes = 128,
        .ss_pin = PIN_OF(kB, 2),
        .scl_pin = PIN_OF(kC, 5),
        .sda_pin = PIN_OF(kC, 4),
        .pin_change_port = {kB, kC, kD},
        .external = {PIN_OF(kD, 2), PIN_OF(kD, 3), kNoPin, kNoPin, kNoPin, kNoPin, kNoPin, kNoPin},
        .outputs = {{PIN_OF(kD, 6), PIN_OF(kD, 5), kNoPin},
                    {PIN_OF(kB, 1), PIN_OF(kB, 2), kNoPin},
                    {PIN_OF(kB, 3), PIN_OF(kD, 3), kNoPin}},
        .captures = {kNoPin, PIN_OF(kB, 0), kNoPin, kNoPin, kNoPin, kNoPin},
        .vectors = kVectors328p,
    },
};

const chip_model* model_of(enum chip_kind kind) {
  return kind < kChipKinds ? &kModels[kind] : NULL;
}
