// The IMU between its sensors and its bus: takes samples, knows offsets and rest, runs the attitude
// filter, makes packets. Main loop only.
#pragma once

#include <stdint.h>

#include "core/imu/attitude.h"
#include "core/imu/original_packets.h"
#include "core/imu/record.h"
#include "core/imu/rest_detector.h"
#include "core/imu/sample.h"
#include "generated/frames.h"

namespace core {

class ImuNode {
 public:
  static constexpr uint16_t kRestartedSamples = 400;  // 2 s of the flag: it outlives lost packets
  static constexpr uint8_t kCompatEvery = 4;          // 50 Hz
  static constexpr uint16_t kMovingCmps = 300;        // GPS speed above which nothing is zeroed

  // `settings` must outlive the node.
  explicit ImuNode(ImuSettings& settings) : settings_(settings) { tune(); }

  void sample(const ImuRawSample& raw, uint32_t t_us);
  // Behind every sample, when its packet is on its way: what can wait (Attitude::catch_up).
  void catch_up() { attitude_.catch_up(); }
  // A sample was due and none came: its number is used up, so that its loss shows.
  void skip() { ++seq_; }
  void set_field(const int16_t (&field)[3]);  // body axes, 1090 LSB per gauss
  void set_gps(const frames::GpsFrame& gps);
  void set_chip(uint8_t product_id, uint8_t dlpf);
  void count_reset(uint16_t resets) { resets_ = resets; }

  // The packet of the last sample, sealed for a transfer that starts at `start_us`.
  void put_packet(uint8_t* out, uint32_t start_us);
  // Whether the last sample is one of those the original packets are sent for.
  bool compat_due() const { return settings_.compat != 0 && seq_ % kCompatEvery == 0; }
  void put_compat(uint8_t* first, uint8_t* second) const;

  // Both refuse (false) unless the IMU lies still and no GPS says that it moves.
  bool zero_rates();  // the rate offsets become the mean of the last second
  bool level();       // the force offsets make this attitude level: put it level first
  bool at_rest() const;
  void settings_changed() { tune(); }

  const Attitude& attitude() const { return attitude_; }
  uint8_t flags() const;

 private:
  void learn_at_rest();
  void put_aux(frames::ImuPacket& packet);
  void tune();

  ImuSettings& settings_;
  AttitudeSettings tuning_;
  Attitude attitude_{tuning_};
  RestDetector rest_;
  frames::GpsFrame gps_ = {};
  AttitudeInput in_;
  uint32_t t_us_ = 0;
  int16_t field_[3] = {};
  int16_t temperature_cdegc_ = 0;
  uint16_t resets_ = 0;
  uint16_t restarted_left_ = kRestartedSamples;
  uint8_t product_id_ = 0;
  uint8_t dlpf_ = 0;
  uint8_t seq_ = 0;
  bool field_fresh_ = false;
  bool sampled_ = false;
};

}  // namespace core
