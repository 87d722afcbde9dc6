// The analogue supply, measured against the chip's own reference: 1.1 V, 1.0 to 1.2 V by part
// (ATmega2560 datasheet, ADC characteristics, VINT1). A meter once gives the true one, which a
// record in EEPROM keeps: hw/calibration/procedure-supply.md.
#pragma once

#include <stdint.h>

namespace core {

constexpr uint16_t kNominalReferenceMv = 1100;
constexpr uint16_t kLeastReferenceMv = 1000;
constexpr uint16_t kMostReferenceMv = 1200;
constexpr uint16_t kLeastSupplyMv = 4500;    // 16 MHz wants it (ATmega2560 datasheet, 31.4)
constexpr uint8_t kReferenceRecordSize = 4;  // mV and CRC-16, both little-endian

// 0: no record, or a reference that no chip has.
uint16_t read_reference(const uint8_t* record);
void write_reference(uint8_t* record, uint16_t reference_mv);

// `nominal_mv` is what the supply would be with a reference of 1.1 V, 0 if not measured;
// `reference_mv` is 0 if not calibrated.
uint16_t supply_mv(uint16_t nominal_mv, uint16_t reference_mv);
// False when the supply is below 4.5 V for sure: without a calibration, even by a part of 1.2 V.
// False while it is not measured: nothing is proven yet.
bool supply_good(uint16_t nominal_mv, uint16_t reference_mv);
// The same in flight, once per measurement. One odd conversion releases no relay: it is too low
// only when three in a row say so. A supply that is no longer measured (its converter failed) is as
// good as it was: a sensor never releases the relay, and the brown-out detector still does.
class SupplyWatch {
 public:
  static constexpr uint8_t kLowInARow = 3;

  // At boot, until it is good: the first measurement decides.
  bool passes(uint16_t nominal_mv, uint16_t reference_mv);
  bool measured(uint16_t nominal_mv, uint16_t reference_mv);
  bool good() const { return good_; }

 private:
  uint8_t low_ = 0;
  bool good_ = false;
};

}  // namespace core
