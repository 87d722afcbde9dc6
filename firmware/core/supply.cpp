#include "core/supply.h"

#include "core/bytes.h"
#include "core/crc.h"

namespace core {

uint16_t read_reference(const uint8_t* record) {
  const uint16_t reference_mv = get_le<uint16_t>(record);
  const bool whole = get_le<uint16_t>(record + 2) == crc16(kCrc16Start, record, 2);
  return whole && reference_mv >= kLeastReferenceMv && reference_mv <= kMostReferenceMv
             ? reference_mv
             : uint16_t{0};
}

void write_reference(uint8_t* record, uint16_t reference_mv) {
  put_le(record, reference_mv);
  put_le(record + 2, crc16(kCrc16Start, record, 2));
}

uint16_t supply_mv(uint16_t nominal_mv, uint16_t reference_mv) {
  const uint16_t reference = reference_mv == 0 ? kNominalReferenceMv : reference_mv;
  return static_cast<uint16_t>(static_cast<uint32_t>(nominal_mv) * reference / kNominalReferenceMv);
}

bool supply_good(uint16_t nominal_mv, uint16_t reference_mv) {
  const uint16_t at_most = reference_mv == 0 ? kMostReferenceMv : reference_mv;
  return supply_mv(nominal_mv, at_most) >= kLeastSupplyMv;
}

bool SupplyWatch::passes(uint16_t nominal_mv, uint16_t reference_mv) {
  good_ = supply_good(nominal_mv, reference_mv);
  low_ = 0;
  return good_;
}

bool SupplyWatch::measured(uint16_t nominal_mv, uint16_t reference_mv) {
  if (nominal_mv == 0) {
    return good_;
  }
  if (supply_good(nominal_mv, reference_mv)) {
    good_ = true;
    low_ = 0;
  } else if (low_ < kLowInARow) {
    ++low_;
    good_ = good_ && low_ < kLowInARow;
  }
  return good_;
}

}  // namespace core
