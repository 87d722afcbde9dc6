#include "core/imu/node.h"

#include <string.h>

#include "core/crc.h"

namespace core {
namespace {

// Gyro delay by DLPF_CFG, as in frames.toml.
uint16_t filter_delay_us(uint8_t dlpf) {
  constexpr uint8_t kPer100us[] = {10, 19, 28, 48, 83, 134, 186};
  return static_cast<uint16_t>(kPer100us[dlpf <= 6 ? dlpf : 2] * 100);
}

// INT16_MIN means "no value" in a packet.
int16_t less(int16_t value, int16_t offset) {
  const int32_t wide = int32_t{value} - offset;
  return static_cast<int16_t>(wide > INT16_MAX ? INT16_MAX : wide < -INT16_MAX ? -INT16_MAX : wide);
}

}  // namespace

void ImuNode::tune() {
  tuning_.declination_cdeg = settings_.declination_cdeg;
  tuning_.filter_delay_us = filter_delay_us(dlpf_);
}

void ImuNode::set_chip(uint8_t product_id, uint8_t dlpf) {
  product_id_ = product_id;
  dlpf_ = dlpf;
  tune();
}

void ImuNode::sample(const ImuRawSample& raw, uint32_t t_us) {
  ++seq_;
  const uint32_t dt_us = sampled_ ? t_us - t_us_ : 5000;
  sampled_ = true;
  t_us_ = t_us;
  temperature_cdegc_ = raw.temperature_cdegc;
  rest_.add(raw.rates, raw.force);
  for (uint8_t axis = 0; axis < 3; ++axis) {
    in_.rates[axis] = less(raw.rates[axis], settings_.rate_offset[axis]);
    in_.force[axis] = less(raw.force[axis], settings_.force_offset[axis]);
  }
  in_.gyro_saturated = raw.gyro_saturated;
  in_.accel_saturated = raw.accel_saturated;
  attitude_.set_at_rest(at_rest());
  if (rest_.take_means() && at_rest()) {
    learn_at_rest();
  }
  attitude_.step(in_, dt_us);
  if (restarted_left_ != 0) {
    --restarted_left_;
  }
}

void ImuNode::learn_at_rest() {
  int16_t rates[3];
  for (uint8_t axis = 0; axis < 3; ++axis) {
    rates[axis] = less(rest_.mean_rate(axis), settings_.rate_offset[axis]);
  }
  attitude_.set_rest_rates(rates);
}

void ImuNode::set_field(const int16_t (&field)[3]) {
  for (uint8_t axis = 0; axis < 3; ++axis) {
    field_[axis] = less(field[axis], settings_.field_offset[axis]);
  }
  field_fresh_ = true;
  attitude_.set_field(field_);
}

void ImuNode::set_gps(const frames::GpsFrame& gps) {
  gps_ = gps;
  const bool fixed = gps.fix == static_cast<uint8_t>(frames::GpsFix::kFix3d);
  if (fixed && gps.ground_speed != frames::kGpsGroundSpeedInvalid) {
    attitude_.set_speed(gps.ground_speed);
  }
}

bool ImuNode::at_rest() const {
  const bool moving = gps_.fix == static_cast<uint8_t>(frames::GpsFix::kFix3d) &&
                      gps_.ground_speed != frames::kGpsGroundSpeedInvalid &&
                      gps_.ground_speed > kMovingCmps;
  return rest_.at_rest() && !moving;
}

bool ImuNode::zero_rates() {
  if (!at_rest()) {
    return false;
  }
  for (uint8_t axis = 0; axis < 3; ++axis) {
    settings_.rate_offset[axis] = rest_.mean_rate(axis);
  }
  settings_.offsets_cdegc = temperature_cdegc_;
  settings_.offsets_valid = 1;
  attitude_.forget_bias();
  return true;
}

bool ImuNode::level() {
  constexpr int16_t kGravity = 8192;
  ImuSettings trial = settings_;
  trial.force_offset[0] = rest_.mean_force(0);
  trial.force_offset[1] = rest_.mean_force(1);
  trial.force_offset[2] = static_cast<int16_t>(rest_.mean_force(2) + kGravity);
  // In range: a parking attitude beyond 11 deg is no level.
  if (!at_rest() || !imu_settings_in_range(trial)) {
    return false;
  }
  settings_ = trial;
  return true;
}

uint8_t ImuNode::flags() const {
  uint8_t flags = 0;
  flags = static_cast<uint8_t>(flags | (in_.gyro_saturated ? frames::kImuFlagsGyroSaturated : 0));
  flags = static_cast<uint8_t>(flags | (in_.accel_saturated ? frames::kImuFlagsAccelSaturated : 0));
  flags = static_cast<uint8_t>(flags | (attitude_.valid() ? frames::kImuFlagsAttitudeValid : 0));
  flags = static_cast<uint8_t>(flags | (attitude_.heading_valid() ? frames::kImuFlagsMagValid : 0));
  flags = static_cast<uint8_t>(flags |
                               (settings_.offsets_valid != 0 ? frames::kImuFlagsOffsetsValid : 0));
  return static_cast<uint8_t>(flags | (restarted_left_ != 0 ? frames::kImuFlagsRestarted : 0));
}

// A fresh magnetometer sample first; bias and state take turns.
void ImuNode::put_aux(frames::ImuPacket& packet) {
  int16_t aux[3];
  if (field_fresh_) {
    field_fresh_ = false;
    packet.aux_kind = static_cast<uint8_t>(frames::ImuAux::kMagnetometer);
    memcpy(aux, field_, sizeof(aux));
  } else if ((seq_ & 1U) != 0) {
    packet.aux_kind = static_cast<uint8_t>(frames::ImuAux::kGyroBias);
    for (uint8_t axis = 0; axis < 3; ++axis) {
      aux[axis] = attitude_.bias(axis);
    }
  } else {
    packet.aux_kind = static_cast<uint8_t>(frames::ImuAux::kStatus);
    aux[0] = temperature_cdegc_;
    aux[1] = static_cast<int16_t>(product_id_ | dlpf_ << 8);
    aux[2] = static_cast<int16_t>(resets_);
  }
  memcpy(packet.aux, aux, sizeof(aux));
}

void ImuNode::put_packet(uint8_t* out, uint32_t start_us) {
  frames::ImuPacket packet = {};
  packet.kind = frames::kImuPacketKind;
  packet.seq = seq_;
  packet.flags = flags();
  packet.t_us = t_us_;
  const uint32_t age_4us = (start_us - t_us_ + 2) / 4;
  packet.age = age_4us > 0xFFFF ? uint16_t{0xFFFF} : static_cast<uint16_t>(age_4us);
  packet.p = in_.rates[0];
  packet.q = in_.rates[1];
  packet.r = in_.rates[2];
  packet.ax = in_.force[0];
  packet.ay = in_.force[1];
  packet.az = in_.force[2];
  packet.phi = attitude_.phi_cdeg();
  packet.theta = attitude_.theta_cdeg();
  packet.psi = attitude_.psi_cdeg();
  put_aux(packet);
  packet.crc = crc16(kCrc16Start, &packet, offsetof(frames::ImuPacket, crc));
  memcpy(out, &packet, sizeof(packet));
}

void ImuNode::put_compat(uint8_t* first, uint8_t* second) const {
  OriginalValues values;
  memcpy(values.rates, in_.rates, sizeof(values.rates));
  memcpy(values.force, in_.force, sizeof(values.force));
  values.angles[0] = attitude_.phi_cdeg();
  values.angles[1] = attitude_.theta_cdeg();
  values.angles[2] = attitude_.psi_cdeg();
  put_original_first(first, values);
  put_original_second(second, values, gps_);
}

}  // namespace core
