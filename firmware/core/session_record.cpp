#include "core/session_record.h"

#include "core/bytes.h"
#include "core/crc.h"

namespace core {
namespace {

constexpr uint8_t kCrcOffset = kSessionSlotSize - 2;

}  // namespace

void SessionStore::slot(uint8_t index, const uint8_t* bytes) {
  if (crc16(kCrc16Start, bytes, kCrcOffset) != get_le<uint16_t>(bytes + kCrcOffset)) {
    return;
  }
  const uint32_t writes = get_le<uint32_t>(bytes);
  if (writes > kMostWrites || (found_ && writes <= writes_)) {
    return;
  }
  found_ = true;
  writes_ = writes;
  index_ = index;
  latest_.session = get_le<uint32_t>(bytes + 4);
  latest_.boots = get_le<uint32_t>(bytes + 8);
}

uint8_t SessionStore::next(const SessionRecord& record, uint8_t* bytes) {
  ++writes_;
  index_ = static_cast<uint8_t>(index_ + 1 < kSessionSlots ? index_ + 1 : 0);
  latest_ = record;
  found_ = true;
  put_le(bytes, writes_);
  put_le(bytes + 4, record.session);
  put_le(bytes + 8, record.boots);
  put_le(bytes + kCrcOffset, crc16(kCrc16Start, bytes, kCrcOffset));
  return index_;
}

}  // namespace core
