// Packets of any length from any address: no sample but of a whole packet whose CRC is right, or of
// two original ones; counters count every packet once.
#include "core/imu_receiver.h"
#include "core/bytes.h"
#include "core/crc.h"
#include "feed.h"

namespace {

constexpr uint8_t kRoom = 64;

uint8_t address_of(uint8_t what) {
  switch (what & 0x03) {
    case 0:
    case 1:
      return frames::kImuPacketAddress;
    case 2:
      return frames::kOriginalImu1PacketAddress;
    default:
      return (what & 0x04) != 0 ? frames::kOriginalImu2PacketAddress : uint8_t(what >> 3);
  }
}

bool is_own(uint8_t address, const uint8_t* packet, uint8_t size) {
  constexpr uint8_t kCrc = frames::kImuPacketSize - 2;
  return address == frames::kImuPacketAddress && size == frames::kImuPacketSize &&
         packet[0] == frames::kImuPacketKind &&
         core::crc16(core::kCrc16Start, packet, kCrc) == core::get_le<uint16_t>(packet + kCrc);
}

}  // namespace

int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  Feed feed(bytes, size);
  core::ImuReceiver receiver;
  uint32_t now_us = feed.u32();
  while (feed.more()) {
    const uint8_t what = feed.u8();
    const uint8_t address = address_of(what);
    // Of the right length three times in four; a packet of ours with its CRC put right as often.
    const uint8_t right =
        address == frames::kImuPacketAddress ? frames::kImuPacketSize : uint8_t{32};
    const uint8_t length = (what & 0x18) == 0x18 ? uint8_t(feed.u8() % (kRoom + 1)) : right;
    now_us += static_cast<uint32_t>(feed.u16()) * ((what & 0x20) != 0 ? 64U : 1U);
    // As long as it says and no longer, so that a read behind its end is seen.
    uint8_t* packet = static_cast<uint8_t*>(malloc(length == 0 ? 1 : length));
    feed.fill(packet, length);
    if (length == frames::kImuPacketSize && (what & 0xC0) != 0) {
      packet[0] = frames::kImuPacketKind;
      core::put_le(packet + length - 2,
                   core::crc16(core::kCrc16Start, packet, uint8_t(length - 2)));
    }
    const uint16_t good = receiver.good();
    const uint16_t bad = receiver.bad();
    const uint16_t lost = receiver.lost();
    const core::ImuSample before = receiver.sample();
    const core::ImuResult result = receiver.packet(address, packet, length, now_us);
    const core::ImuSample& sample = receiver.sample();
    const bool own = is_own(address, packet, length);
    free(packet);
    switch (result) {
      case core::ImuResult::kBad:
        ALWAYS(receiver.bad() == (bad == 0xFFFF ? bad : bad + 1));
        ALWAYS(memcmp(&before, &sample, sizeof sample) == 0);
        ALWAYS(receiver.good() == good && receiver.lost() == lost && !own);
        break;
      case core::ImuResult::kDuplicate:
        ALWAYS(own && receiver.good() == good && receiver.bad() == bad);
        ALWAYS(memcmp(&before, &sample, sizeof sample) == 0);
        break;
      case core::ImuResult::kHalf:
        ALWAYS(!own && receiver.good() == good && receiver.bad() == bad);
        break;
      case core::ImuResult::kSample:
        ALWAYS(receiver.good() == (good == 0xFFFF ? good : good + 1));
        ALWAYS(receiver.bad() == bad && sample.original != own);
        ALWAYS(receiver.age_4us(sample.start_us) == sample.age_4us || sample.age_4us == 0xFFFF);
        break;
    }
    ALWAYS(receiver.lost() >= lost && receiver.lost() - lost <= 255);
    frames::MagFrame mag;
    frames::AttitudeFrame attitude;
    frames::GpsFrame gps = {};
    if (receiver.take_mag(mag)) ALWAYS(own && !receiver.take_mag(mag));
    if (receiver.take_attitude(attitude)) ALWAYS(own && !receiver.take_attitude(attitude));
    if (receiver.take_restarted()) ALWAYS(own && !receiver.take_restarted());
    if (receiver.take_position(gps)) {
      ALWAYS(address == frames::kOriginalImu2PacketAddress && !receiver.take_position(gps));
      ALWAYS(gps.latitude == frames::kGpsLatitudeInvalid ||
             (gps.latitude >= -900000000 && gps.latitude <= 900000000));
      ALWAYS(gps.course == frames::kGpsCourseInvalid || gps.course <= 36000);
    }
  }
  return 0;
}
