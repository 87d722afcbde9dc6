#include "core/imu_receiver.h"

#include <string.h>

#include "core/bytes.h"
#include "core/crc.h"
#include "core/float32.h"
#include "core/gps_receiver.h"

namespace core {
namespace {

constexpr uint8_t kOriginalSize = frames::kOriginalImu1PacketSize;
constexpr int16_t kNone = INT16_MIN;
constexpr int16_t kFullScale = 32767;

// Place of a value in the first original packet and in `half_`.
enum Half : uint8_t { kPhi, kTheta, kPsi, kP, kQ, kR, kAx, kAy, kHalfValues };

int16_t to_i16(const uint8_t* bytes, uint8_t scale) {
  int32_t value = 0;
  return float32_to_int(bytes, scale, kFullScale, value) ? static_cast<int16_t>(value) : kNone;
}

bool inside(int16_t value) {
  return value > -kFullScale && value < kFullScale;
}

void count(uint16_t& counter, uint8_t by = 1) {
  counter = counter > 0xFFFF - by ? uint16_t{0xFFFF} : static_cast<uint16_t>(counter + by);
}

}  // namespace

ImuResult ImuReceiver::packet(uint8_t address,
                              const uint8_t* bytes,
                              uint8_t size,
                              uint32_t start_us) {
  if (address == frames::kImuPacketAddress) {
    return own_packet(bytes, size, start_us);
  }
  if (size == kOriginalSize && address == frames::kOriginalImu1PacketAddress) {
    return original_first(bytes, start_us);
  }
  if (size == kOriginalSize && address == frames::kOriginalImu2PacketAddress) {
    return original_second(bytes, start_us);
  }
  count(bad_);
  return ImuResult::kBad;
}

ImuResult ImuReceiver::own_packet(const uint8_t* bytes, uint8_t size, uint32_t start_us) {
  constexpr uint8_t kCrcOffset = offsetof(frames::ImuPacket, crc);
  if (size != frames::kImuPacketSize || bytes[0] != frames::kImuPacketKind ||
      crc16(kCrc16Start, bytes, kCrcOffset) != get_le<uint16_t>(bytes + kCrcOffset)) {
    count(bad_);
    return ImuResult::kBad;
  }
  // Read where it lies, as what was written as bytes may be: a copy was 0.3 % of the chip.
  const frames::ImuPacket& in = *reinterpret_cast<const frames::ImuPacket*>(bytes);
  const bool restart = (in.flags & frames::kImuFlagsRestarted) != 0;
  const bool was_restart = (sample_.flags & frames::kImuFlagsRestarted) != 0;
  if (heard_ && !sample_.original && in.seq == sample_.seq && in.t_us == sample_.imu_t_us) {
    return ImuResult::kDuplicate;
  }
  if (restart && !was_restart) {
    restarted_ = heard_;
  } else if (heard_ && !sample_.original && in.seq != sample_.seq &&
             start_us - sample_.start_us < kSilentUs) {
    count(lost_, static_cast<uint8_t>(in.seq - sample_.seq - 1));
  }
  heard_ = true;
  sample_.original = false;
  sample_.start_us = start_us;
  sample_.imu_t_us = in.t_us;
  sample_.age_4us = in.age;
  sample_.seq = in.seq;
  sample_.flags = in.flags;
  sample_.p = in.p;
  sample_.q = in.q;
  sample_.r = in.r;
  sample_.ax = in.ax;
  sample_.ay = in.ay;
  sample_.az = in.az;
  sample_.phi = in.phi;
  sample_.theta = in.theta;
  sample_.psi = in.psi;
  sample_.unsaturated =
      (in.flags & (frames::kImuFlagsGyroSaturated | frames::kImuFlagsAccelSaturated)) == 0;
  take_aux(in.aux_kind, bytes + offsetof(frames::ImuPacket, aux));
  attitude_waits_ = true;
  count(good_);
  return ImuResult::kSample;
}

void ImuReceiver::take_aux(uint8_t kind, const uint8_t* aux) {
  int16_t values[3];
  memcpy(values, aux, sizeof(values));
  if (kind == static_cast<uint8_t>(frames::ImuAux::kMagnetometer)) {
    mag_waits_ = (sample_.flags & frames::kImuFlagsMagValid) != 0;
    memcpy(mag_, values, sizeof(mag_));
  } else if (kind == static_cast<uint8_t>(frames::ImuAux::kGyroBias)) {
    memcpy(bias_, values, sizeof(bias_));
  } else if (kind == static_cast<uint8_t>(frames::ImuAux::kStatus)) {
    temperature_ = values[0];
    product_id_ = aux[2];
    dlpf_ = aux[3];
  }
}

ImuResult ImuReceiver::original_first(const uint8_t* bytes, uint32_t start_us) {
  if (half_waits_) {
    count(lost_);
  }
  half_waits_ = true;
  half_us_ = start_us;
  for (uint8_t i = 0; i < kHalfValues; ++i) {
    half_[i] = to_i16(bytes + 4 * i, i <= kPsi ? 100 : 1);
  }
  return ImuResult::kHalf;
}

ImuResult ImuReceiver::original_second(const uint8_t* bytes, uint32_t start_us) {
  memcpy(position_, bytes + 4, sizeof(position_));
  position_us_ = start_us;
  position_waits_ = true;
  if (!half_waits_ || start_us - half_us_ > kPairUs) {
    half_waits_ = false;
    count(lost_);
    return ImuResult::kHalf;
  }
  half_waits_ = false;
  heard_ = true;
  sample_.original = true;
  sample_.start_us = half_us_;
  sample_.imu_t_us = 0;
  sample_.age_4us = 0;
  ++sample_.seq;
  sample_.p = half_[kP];
  sample_.q = half_[kQ];
  sample_.r = half_[kR];
  sample_.ax = half_[kAx];
  sample_.ay = half_[kAy];
  sample_.az = to_i16(bytes, 1);
  sample_.phi = half_[kPhi];
  sample_.theta = half_[kTheta];
  sample_.psi = half_[kPsi];
  const bool attitude = sample_.phi != kNone && sample_.theta != kNone && sample_.psi != kNone;
  sample_.flags = attitude ? frames::kImuFlagsAttitudeValid : uint8_t{0};
  sample_.unsaturated = inside(sample_.p) && inside(sample_.q) && inside(sample_.r) &&
                        inside(sample_.ax) && inside(sample_.ay) && inside(sample_.az);
  count(good_);
  return ImuResult::kSample;
}

uint16_t ImuReceiver::age_4us(uint32_t t_us) const {
  const uint32_t since_4us = (t_us - sample_.start_us) >> 2;
  if (!heard_ || since_4us >= 0xFFFF) {
    return frames::kIdentImuAgeInvalid;
  }
  const uint32_t age = since_4us + sample_.age_4us;
  return age < 0xFFFF ? static_cast<uint16_t>(age) : frames::kIdentImuAgeInvalid;
}

bool ImuReceiver::take_mag(frames::MagFrame& out) {
  if (!mag_waits_) {
    return false;
  }
  mag_waits_ = false;
  out.t_us = sample_.start_us;
  out.mx = mag_[0];
  out.my = mag_[1];
  out.mz = mag_[2];
  return true;
}

bool ImuReceiver::take_attitude(frames::AttitudeFrame& out) {
  if (!attitude_waits_) {
    return false;
  }
  attitude_waits_ = false;
  out.t_us = sample_.start_us;
  out.imu_t_us = sample_.imu_t_us;
  out.imu_seq = sample_.seq;
  out.imu_flags = sample_.flags;
  out.bias_p = bias_[0];
  out.bias_q = bias_[1];
  out.bias_r = bias_[2];
  out.temperature = temperature_;
  out.product_id = product_id_;
  out.dlpf = dlpf_;
  return true;
}

bool ImuReceiver::take_restarted() {
  const bool restarted = restarted_;
  restarted_ = false;
  return restarted;
}

bool ImuReceiver::take_position(frames::GpsFrame& out) {
  if (!position_waits_) {
    return false;
  }
  position_waits_ = false;
  clear_gps(out);
  out.t_us = position_us_;
  out.source = static_cast<uint8_t>(frames::GpsSource::kOriginalImu);
  // latitude, longitude, altitude, course, ground speed, fix, satellites
  int32_t value = 0;
  if (!float32_to_int(position_ + 20, 1, 255, value) || value <= 0) {
    return true;
  }
  out.fix = static_cast<uint8_t>(frames::GpsFix::kFix3d);
  if (float32_to_int(position_, 10000000UL, 900000000L, value)) {
    out.latitude = value;
  }
  if (float32_to_int(position_ + 4, 10000000UL, 1800000000L, value)) {
    out.longitude = value;
  }
  if (float32_to_int(position_ + 8, 1000, 100000000L, value)) {
    out.height = value;
  }
  if (float32_to_int(position_ + 12, 100, 36000, value) && value >= 0) {
    out.course = static_cast<uint16_t>(value);
  }
  if (float32_to_int(position_ + 16, 100, 65000L, value) && value >= 0) {
    out.ground_speed = static_cast<uint16_t>(value);
  }
  if (float32_to_int(position_ + 24, 1, 255, value) && value >= 0) {
    out.satellites = static_cast<uint8_t>(value);
  }
  return true;
}

}  // namespace core
