// Holds the axes that a row does not excite: wings level by the ailerons, the pitch of the trigger
// by the elevator. It lives in a row and ends with it; what it may do at all, and when it may
// begin, is decided here, the rest of the row's rules hold beside it.
//
// A sample of the IMU gives a demand: gain times error, plus an integral, minus gain times rate;
// in ticks, never beyond the card's authority, and no faster than the card's rate. Gains are whole
// numbers of the card (flight-card.md).
#pragma once

#include <stdint.h>

#include "core/drive.h"
#include "core/flight_card.h"
#include "core/input_watch.h"

namespace core {

// One axis: the law, and whether it loses.
class HeldAxis {
 public:
  // Of its authority: from there on the surface works against an error.
  static constexpr uint8_t kWorksShift = 1;
  static constexpr uint8_t kSpanSamples = 20;  // 0.1 s
  static constexpr uint8_t kMostSpans = 5;

  void load(const frames::CardHoldLayout& card, uint8_t axis);
  // The error is zero at this angle.
  void start(int16_t angle);
  // Deflection wanted for a sample, ticks; |angle| is at most 4500, that of the start 1500.
  int16_t demand(int16_t angle, int16_t rate);
  // With each sample behind demand(): the error grew for 0.5 s, span by span, while the deflection
  // in force was half of the authority or more against it.
  bool loses(int16_t applied_ticks);
  int16_t error() const { return error_; }

 private:
  int32_t integral_;  // ticks / 2^20
  int16_t angle_gain_;
  int16_t integral_gain_;
  int16_t rate_gain_;
  int16_t authority_;  // ticks
  int16_t wanted_angle_;
  int16_t error_;
  uint16_t span_sum_;  // of sizes of errors, in 0.04 deg
  uint16_t last_sum_;
  uint8_t samples_;  // of this span
  uint8_t grown_;    // spans
  bool worked_;      // in all samples of this span
};

// Lent memory, while a row may be flown that holds (app/row_memory.h).
class AttitudeHold {
 public:
  // 0.01 deg and raw steps of a rate, 0.01527 deg/s.
  static constexpr int16_t kStartBank = 2000;
  static constexpr int16_t kStartPitch = 1500;
  static constexpr int16_t kStartRate = 1965;  // 30 deg/s
  static constexpr int16_t kMostBank = 4500;
  static constexpr int16_t kMostPitch = 2500;
  // Samples alike in all rates and forces, to the bit: of a sensor with noise of 4 steps in a rate
  // and 20 in a force two are alike once in 10^9, and a sample that the IMU sent twice is no end.
  static constexpr uint8_t kMostAlike = 4;

  // When a row is judged that holds.
  void load(const frames::CardHoldLayout& card, uint8_t held, uint16_t rate_max_usps);
  // When the switch has come to armed: the sticks are to stay until the trigger.
  void arm(const RcChannels& rc);
  bool sticks_still(const RcChannels& rc, uint16_t stick_us) const;
  // Before the trigger, with each sample. kDone: it may begin here.
  frames::InputEnd may_start(const InputReadings& in);
  // At the trigger.
  void start(uint32_t now_us);
  // With each sample of the IMU: the deflections in force go towards what is demanded.
  frames::InputEnd step(const InputReadings& in, int16_t* applied_ticks, uint32_t now_us);

 private:
  bool holds(uint8_t axis) const { return (held_ >> axis & 1U) != 0; }
  // With each sample. Of its attitude nothing is asked: the filter of a frozen gyro goes on
  // turning.
  bool still(const InputReadings& in);

  HeldAxis axes_[kHeldAxes];
  uint16_t stick_ticks_[kServos];  // when it was armed
  int16_t theta_;                  // of the last sample before the trigger
  uint16_t rate_max_usps_;
  uint16_t stepped_us_;  // low half
  // Of the sample before.
  int16_t rates_[3];
  int16_t force_[3];
  uint8_t alike_;  // samples, the last one among them
  uint8_t held_;
};

}  // namespace core
