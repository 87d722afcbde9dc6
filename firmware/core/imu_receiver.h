// Packets of the IMU's bus in, one sample out: our own packet (address 43) and the two original
// 32-byte packets (42 and 27). Main loop only.
#pragma once

#include <stdint.h>

#include "generated/frames.h"

namespace core {

struct ImuSample {
  uint32_t start_us = 0;  // Mega clock at the START of the transfer
  uint32_t imu_t_us = 0;  // IMU clock at the sample; 0 for original packets
  uint16_t age_4us = 0;   // from the sample to that START; 0 for original packets
  uint8_t seq = 0;
  uint8_t flags = 0;  // imu_flags
  // Raw values as in the frame `ident`; INT16_MIN is none. Original: counts of its own scale.
  int16_t p = INT16_MIN, q = INT16_MIN, r = INT16_MIN;
  int16_t ax = INT16_MIN, ay = INT16_MIN, az = INT16_MIN;
  int16_t phi = INT16_MIN, theta = INT16_MIN, psi = INT16_MIN;
  bool original = false;
  bool unsaturated = false;
};

enum class ImuResult : uint8_t {
  kBad,        // wrong length, kind or CRC
  kDuplicate,  // the sequence number of the last packet again
  kHalf,       // first of two original packets
  kSample,     // `sample` is a fresh one
};

class ImuReceiver {
 public:
  static constexpr uint32_t kPairUs = 10000;      // second original packet after the first
  static constexpr uint32_t kSilentUs = 1000000;  // then a gap in 8 bits of sequence says nothing

  ImuResult packet(uint8_t address, const uint8_t* bytes, uint8_t size, uint32_t start_us);

  const ImuSample& sample() const { return sample_; }
  // Age of the sample at `t_us` in steps of 4 us; 65535 if none or older than 262 ms.
  uint16_t age_4us(uint32_t t_us) const;

  // Frames that the last packet made possible; each true once.
  bool take_mag(frames::MagFrame& out);
  bool take_attitude(frames::AttitudeFrame& out);  // with the last bias and status heard
  bool take_restarted();
  // Position from the second original packet; true once for each. Source is original_imu.
  bool take_position(frames::GpsFrame& out);

  uint16_t good() const { return good_; }
  uint16_t bad() const { return bad_; }
  uint16_t lost() const { return lost_; }
  uint8_t dlpf() const { return dlpf_; }

 private:
  ImuResult own_packet(const uint8_t* bytes, uint8_t size, uint32_t start_us);
  ImuResult original_first(const uint8_t* bytes, uint32_t start_us);
  ImuResult original_second(const uint8_t* bytes, uint32_t start_us);
  void take_aux(uint8_t kind, const uint8_t* aux);

  ImuSample sample_;
  uint32_t half_us_ = 0;
  int16_t half_[8] = {};  // first original packet until the second comes
  int16_t bias_[3] = {INT16_MIN, INT16_MIN, INT16_MIN};
  int16_t mag_[3] = {};
  int16_t temperature_ = INT16_MIN;
  uint16_t good_ = 0;
  uint16_t bad_ = 0;
  uint16_t lost_ = 0;
  uint8_t product_id_ = 0;
  uint8_t dlpf_ = frames::kAttitudeDlpfInvalid;
  bool half_waits_ = false;
  bool heard_ = false;
  bool mag_waits_ = false;
  bool attitude_waits_ = false;
  bool restarted_ = false;
  // The second packet's bytes are parsed when a position is taken, at 5 Hz, not at 50.
  uint8_t position_[28] = {};
  uint32_t position_us_ = 0;
  bool position_waits_ = false;
};

}  // namespace core
