// What a card's bytes must say: each limit at its edge and one behind it.
#include <string.h>

#include "check.h"
#include "core/flight_card.h"
#include "core/learning/axis_card.h"
#include "random_numbers.h"

namespace {

using core::CardHead;
using core::CardRow;
using frames::CardFault;
using frames::CardShape;

const char kAircraft[16] = "ultrastick25e";

CardHead good_head() {
  CardHead head = {};
  head.magic = frames::kCardHeadLayoutMagic;
  head.version = frames::kCardHeadLayoutVersion;
  head.rows = 3;
  memcpy(head.aircraft, kAircraft, sizeof head.aircraft);
  head.airspeed_input = 4;
  head.alpha_input = 1;
  head.beta_input = 255;
  head.dp_max = head.alpha_max = head.beta_max = 4000;
  head.phi_max = 6000;
  head.p_max = head.q_max = head.r_max = 20000;
  head.height_min_pa = 300;
  head.height_max_pa = 2000;
  head.distance_max_m = 300;
  head.still_ms = 500;
  head.stick_us = 40;
  for (uint8_t i = 0; i < core::kCardAxes; ++i) {
    head.servo_min_us[i] = 1100;
    head.servo_max_us[i] = 1900;
    head.amplitude_max_us[i] = 150;
  }
  head.rate_max_usps = 4000;
  head.frequency_max_chz = 500;
  return head;
}

CardRow good_row(CardShape shape) {
  CardRow row = {};
  row.shape = static_cast<uint8_t>(shape);
  row.axes = 2;
  row.quiet_ms = 1000;
  row.duration_ms = 2000;
  row.amplitude_us[1] = -150;
  if (shape == CardShape::kSweep) {
    row.first_chz = 20;
    row.last_chz = 400;
  }
  if (shape == CardShape::kMultisine) {
    row.components[0] = 10;  // 5 Hz
    row.components[2] = 1 << 6 | 30;
  }
  return row;
}

CardFault judged(CardRow row) {
  row.crc = core::crc16(core::kCrc16Start, &row, offsetof(CardRow, crc));
  return core::judge_row(row, core::row_limits(good_head()));
}

CardFault judged(const CardHead& head) {
  return core::judge_head(head, kAircraft);
}

// The head with one field at a value, and what is said of it.
#define HEAD_SAYS(field, value, fault)                    \
  {                                                       \
    CardHead head = good_head();                          \
    head.field = value;                                   \
    CHECK_EQ(static_cast<int>(judged(head)), int(fault)); \
  }
#define ROW_SAYS(shape, change, fault)                   \
  {                                                      \
    CardRow row = good_row(shape);                       \
    change;                                              \
    CHECK_EQ(static_cast<int>(judged(row)), int(fault)); \
  }

}  // namespace

TEST_CASE("a good head, and who wrote it"){
    HEAD_SAYS(rows, 1, CardFault::kNone) HEAD_SAYS(rows, 32, CardFault::kNone)
        HEAD_SAYS(rows, 0, CardFault::kRows) HEAD_SAYS(rows, 33, CardFault::kRows)
            HEAD_SAYS(magic, 0x4347, CardFault::kMagic) HEAD_SAYS(magic, 0x4345, CardFault::kMagic)
                HEAD_SAYS(version, 0, CardFault::kOtherVersion)
                    HEAD_SAYS(version, 1, CardFault::kOtherVersion)
                        HEAD_SAYS(version, 3, CardFault::kOtherVersion)
                            HEAD_SAYS(aircraft[15], 'x', CardFault::kAircraft)
                                HEAD_SAYS(aircraft[0], 'U', CardFault::kAircraft)}

TEST_CASE("each limit of the head at its edge and behind it") {
  const CardFault no = CardFault::kLimits;
  const CardFault yes = CardFault::kNone;
  HEAD_SAYS(airspeed_input, 5, yes)
  HEAD_SAYS(airspeed_input, 255, yes)
  HEAD_SAYS(airspeed_input, 6, no)
  HEAD_SAYS(airspeed_input, 3, no)
  HEAD_SAYS(alpha_input, 0, yes)
  HEAD_SAYS(alpha_input, 2, no)
  HEAD_SAYS(beta_input, 3, yes)
  HEAD_SAYS(beta_input, 1, no)
  HEAD_SAYS(dp_min, 4000, yes)
  HEAD_SAYS(dp_min, 4001, no)
  HEAD_SAYS(alpha_min, 4001, no)
  HEAD_SAYS(beta_min, 4001, no)
  HEAD_SAYS(phi_max, 18000, yes)
  HEAD_SAYS(phi_max, 18001, no)
  HEAD_SAYS(theta_min, 1, no)
  HEAD_SAYS(theta_max, -1, no)
  HEAD_SAYS(p_max, 32768U, no)
  HEAD_SAYS(q_max, 32768U, no)
  HEAD_SAYS(r_max, 32768U, no)
  HEAD_SAYS(r_max, 32767, yes)
  HEAD_SAYS(az_min, 1, no)
  HEAD_SAYS(height_min_pa, 119, no)
  HEAD_SAYS(height_min_pa, 120, yes)
  HEAD_SAYS(height_min_pa, 2001, no)
  HEAD_SAYS(distance_max_m, 0, yes)
  HEAD_SAYS(distance_max_m, 3000, yes)
  HEAD_SAYS(distance_max_m, 3001, no)
  HEAD_SAYS(still_ms, 99, no)
  HEAD_SAYS(still_ms, 100, yes)
  HEAD_SAYS(still_ms, 2001, no)
  HEAD_SAYS(stick_us, 9, no)
  HEAD_SAYS(stick_us, 200, yes)
  HEAD_SAYS(stick_us, 201, no)
  HEAD_SAYS(servo_min_us[2], 799, no)
  HEAD_SAYS(servo_min_us[0], 800, yes)
  HEAD_SAYS(servo_min_us[0], 1901, no)
  HEAD_SAYS(servo_max_us[1], 2200, yes)
  HEAD_SAYS(servo_max_us[1], 2201, no)
  HEAD_SAYS(amplitude_max_us[2], 500, yes)
  HEAD_SAYS(amplitude_max_us[2], 501, no)
  HEAD_SAYS(rate_max_usps, 99, no)
  HEAD_SAYS(rate_max_usps, 60000U, yes)
  HEAD_SAYS(rate_max_usps, 60001U, no)
  HEAD_SAYS(frequency_max_chz, 0, no)
  HEAD_SAYS(frequency_max_chz, 501, no)
  HEAD_SAYS(learned_axes, 3, yes)
  HEAD_SAYS(learned_axes, 4, no)
  HEAD_SAYS(reserved_2[4], 1, no)
  HEAD_SAYS(hold, 1, yes)
  HEAD_SAYS(hold, 2, no)
  HEAD_SAYS(reserved_2[0], 1, no)
  HEAD_SAYS(beta_input, 2, yes)
  HEAD_SAYS(beta_input, 4, no)
  HEAD_SAYS(theta_max, 3000, yes)
  HEAD_SAYS(az_max, 3000, yes)
  HEAD_SAYS(p_max, 32767, yes)
  HEAD_SAYS(q_max, 32767, yes)
  HEAD_SAYS(still_ms, 2000, yes)
  HEAD_SAYS(stick_us, 10, yes)
  HEAD_SAYS(rate_max_usps, 100, yes)
  HEAD_SAYS(frequency_max_chz, 1, yes)
}

TEST_CASE("axes that do not exist, none at all, and each alone") {
  ROW_SAYS(CardShape::kDoublet, row.axes = 10, CardFault::kRowAxes)
  ROW_SAYS(CardShape::kDoublet, row.axes = 8; row.amplitude_us[1] = 0, CardFault::kRowAxes)
  ROW_SAYS(CardShape::kDoublet, row.axes = 0; row.amplitude_us[1] = 0, CardFault::kRowAxes)
  ROW_SAYS(CardShape::kDoublet, row.axes = 1; row.amplitude_us[0] = 10;
           row.amplitude_us[1] = 0, CardFault::kNone)
  ROW_SAYS(CardShape::kDoublet, row.axes = 4; row.amplitude_us[2] = 10;
           row.amplitude_us[1] = 0, CardFault::kNone)
}

TEST_CASE("a row holds what it does not move, where the card has gains") {
  const auto says = [](uint8_t axes, uint8_t hold) {
    CardHead head = good_head();
    head.hold = hold;
    CardRow row = good_row(CardShape::kDoublet);
    row.axes = axes;
    row.crc = core::crc16(core::kCrc16Start, &row, offsetof(CardRow, crc));
    return core::judge_row(row, core::row_limits(head));
  };
  CHECK((says(0x12, 1) == CardFault::kNone));
  CHECK((says(0x12, 0) == CardFault::kRowHold));  // no gains
  CHECK((says(0x22, 1) == CardFault::kRowHold));  // moved and held
  CHECK((says(0x32, 1) == CardFault::kRowHold));
  CHECK((says(0x42, 1) == CardFault::kRowHold));  // the rudder is never held
  CHECK((says(0x82, 1) == CardFault::kRowHold));
  CHECK((says(0x10, 1) == CardFault::kRowAxes));  // nothing moves
}

TEST_CASE("a pulse is half a period, and a card may allow less than 5 Hz") {
  CardRow row = good_row(CardShape::kPulse);
  core::RowLimits limits = core::row_limits(good_head());
  limits.frequency_max_chz = 100;
  const uint16_t durations_ms[] = {499, 500};
  for (const uint16_t duration_ms : durations_ms) {
    row.duration_ms = duration_ms;
    row.crc = core::crc16(core::kCrc16Start, &row, offsetof(CardRow, crc));
    const CardFault said = core::judge_row(row, limits);
    CHECK((said == (duration_ms < 500 ? CardFault::kRowFrequency : CardFault::kNone)));
  }
}

TEST_CASE("good rows of every shape, and a bit that fell") {
  for (uint8_t shape = 1; shape <= 5; ++shape) {
    CHECK_EQ(static_cast<int>(judged(good_row(static_cast<CardShape>(shape)))), 0);
  }
  ROW_SAYS(CardShape::kPulse, row.shape = 0, CardFault::kRowShape)
  ROW_SAYS(CardShape::kPulse, row.shape = 6, CardFault::kRowShape)
  ROW_SAYS(CardShape::kPulse, row.components[29] = 1, CardFault::kRowShape)
  ROW_SAYS(CardShape::kPulse, row.components[0] = 1, CardFault::kRowShape)
  CardRow row = good_row(CardShape::kDoublet);
  row.crc = core::crc16(core::kCrc16Start, &row, offsetof(CardRow, crc));
  uint8_t* const bytes = reinterpret_cast<uint8_t*>(&row);
  for (uint8_t at = 0; at < sizeof row; ++at) {
    for (uint8_t bit = 1; bit != 0; bit = static_cast<uint8_t>(bit << 1)) {
      const uint8_t right = bytes[at];
      bytes[at] = static_cast<uint8_t>(right ^ bit);
      CHECK(core::judge_row(row, core::row_limits(good_head())) == CardFault::kRowCrc);
      bytes[at] = right;
    }
  }
}

TEST_CASE("axes and amplitudes go together"){
    ROW_SAYS(CardShape::kDoublet, row.axes = 0, CardFault::kRowAxes)
        ROW_SAYS(CardShape::kDoublet, row.axes = 8, CardFault::kRowAxes)
            ROW_SAYS(CardShape::kDoublet, row.axes = 6, CardFault::kRowAxes)
                ROW_SAYS(CardShape::kDoublet, row.amplitude_us[0] = 1, CardFault::kRowAxes)
                    ROW_SAYS(CardShape::kDoublet, row.amplitude_us[1] = 150, CardFault::kNone)
                        ROW_SAYS(CardShape::kDoublet,
                                 row.amplitude_us[1] = 151,
                                 CardFault::kRowAmplitude) ROW_SAYS(CardShape::kDoublet,
                                                                    row.amplitude_us[1] = -151,
                                                                    CardFault::kRowAmplitude)
                            ROW_SAYS(CardShape::kDoublet,
                                     row.amplitude_us[1] = INT16_MIN,
                                     CardFault::kRowAmplitude)}

TEST_CASE("a row lasts 20 s at most, its quiet time included") {
  ROW_SAYS(CardShape::kPulse, row.duration_ms = 99, CardFault::kRowTime)
  ROW_SAYS(CardShape::kPulse, row.duration_ms = 100, CardFault::kNone)
  ROW_SAYS(CardShape::kPulse, row.quiet_ms = 18000, CardFault::kNone)
  ROW_SAYS(CardShape::kPulse, row.quiet_ms = 18001, CardFault::kRowTime)
  ROW_SAYS(CardShape::kPulse, row.duration_ms = 20001, CardFault::kRowTime)
  ROW_SAYS(CardShape::kPulse, row.duration_ms = 65535U; row.quiet_ms = 65535U, CardFault::kRowTime)
}

TEST_CASE("no shape is faster than the card allows"){
    ROW_SAYS(CardShape::kDoublet, row.duration_ms = 199, CardFault::kRowFrequency)
        ROW_SAYS(CardShape::kDoublet, row.duration_ms = 200, CardFault::kNone)
            ROW_SAYS(CardShape::kThreeTwoOneOne, row.duration_ms = 699, CardFault::kRowFrequency)
                ROW_SAYS(CardShape::kThreeTwoOneOne, row.duration_ms = 700, CardFault::kNone)
                    ROW_SAYS(CardShape::kDoublet, row.first_chz = 1, CardFault::kRowFrequency)
                        ROW_SAYS(CardShape::kDoublet, row.last_chz = 1, CardFault::kRowFrequency)
                            ROW_SAYS(CardShape::kSweep, row.first_chz = 0, CardFault::kRowFrequency)
                                ROW_SAYS(CardShape::kSweep,
                                         row.last_chz = 501,
                                         CardFault::kRowFrequency) ROW_SAYS(CardShape::kSweep,
                                                                            row.first_chz = 500,
                                                                            CardFault::kNone)
                                    ROW_SAYS(CardShape::kMultisine,
                                             row.components[0] = 11,
                                             CardFault::kRowFrequency)}

TEST_CASE("a sweep's ends are above 0, each for itself") {
  const CardShape sweep = CardShape::kSweep;
  ROW_SAYS(sweep, row.first_chz = 1, CardFault::kNone)
  ROW_SAYS(sweep, row.last_chz = 1, CardFault::kNone)
  ROW_SAYS(sweep, row.last_chz = 0, CardFault::kRowFrequency)
}

TEST_CASE("the components of a multisine") {
  const CardShape sine = CardShape::kMultisine;
  const CardFault no = CardFault::kRowComponents;
  ROW_SAYS(sine, row.components[2] = 1 << 6 | 1, CardFault::kNone)
  ROW_SAYS(sine, row.components[2] = 1 << 6 | 32, CardFault::kNone)
  ROW_SAYS(sine, row.components[3] = 1; row.components[5] = 1 << 6, no)  // a second without share
  for (uint8_t last = 27; last <= 28; ++last) {
    ROW_SAYS(
        sine,
        for (uint8_t i = 0; i < 30; i = uint8_t(i + 3)) {
          row.components[i] = 1;
          row.components[i + 2] = uint8_t(1 << 6 | (i == 27 ? last : 25));
        },
        last == 27 ? CardFault::kNone : no)
  }
  ROW_SAYS(sine, row.components[2] = 0 << 6 | 30, no)  // an axis that the row has not
  ROW_SAYS(sine, row.components[2] = 3 << 6 | 30, no)
  ROW_SAYS(sine, row.components[2] = 1 << 6, no)              // no share
  ROW_SAYS(sine, row.components[0] = 0, no)                   // none at all
  ROW_SAYS(sine, row.components[5] = 1, no)                   // something behind the last
  ROW_SAYS(sine, row.axes = 3; row.amplitude_us[0] = 10, no)  // an axis without one
  ROW_SAYS(
      sine,
      for (uint8_t i = 0; i < 30; i = uint8_t(i + 3)) {
        row.components[i] = 1;
        row.components[i + 2] = 1 << 6 | 25;
      },
      CardFault::kNone)
  ROW_SAYS(
      sine,
      for (uint8_t i = 0; i < 30; i = uint8_t(i + 3)) {
        row.components[i] = 1;
        row.components[i + 2] = 1 << 6 | 26;
      },
      no)
}

TEST_CASE("a single that is no number is found wherever it stands") {
  core::AxisCard axis = {};
  axis.harmonic_count = 6;
  frames::CardWorthLayout worth = {};
  CHECK(core::axis_good(axis));
  CHECK(core::worth_good(worth));
  const uint32_t numbers[] = {
      0x7F800000, 0xFF800000, 0x7FC00000, 0x7F800001, 0x7F7FFFFF, 0x807FFFFF};
  for (const uint32_t bits : numbers) {
    const bool finite = (bits & 0x7F800000U) != 0x7F800000U;
    for (uint8_t at = offsetof(core::AxisCard, advance_s); at < sizeof axis;
         at = static_cast<uint8_t>(at + 4)) {
      core::AxisCard bad = axis;
      memcpy(reinterpret_cast<uint8_t*>(&bad) + at, &bits, sizeof bits);
      CHECK_EQ(core::axis_good(bad), finite);
    }
    for (uint8_t at = 0; at < 40; at = static_cast<uint8_t>(at + 4)) {
      frames::CardWorthLayout bad = worth;
      memcpy(reinterpret_cast<uint8_t*>(&bad) + at, &bits, sizeof bits);
      CHECK_EQ(core::worth_good(bad), finite);
    }
  }
}

TEST_CASE("random bytes are no card") {
  Random random(77);
  for (uint16_t n = 0; n < 300; ++n) {
    CardHead head = good_head();
    CardRow row = good_row(CardShape::kMultisine);
    for (uint8_t i = 0; i < 6; ++i) {
      reinterpret_cast<uint8_t*>(&row)[random.below(46)] = random.byte();
      reinterpret_cast<uint8_t*>(&head)[random.below(92)] = random.byte();
    }
    (void)judged(head);
    if (judged(row) != CardFault::kNone) continue;
    // What passes keeps every bound that the flight relies on.
    CHECK(uint32_t{row.quiet_ms} + row.duration_ms <= 20000U);
    for (uint8_t i = 0; i < core::kCardAxes; ++i) {
      const int16_t amplitude_us = row.amplitude_us[i];
      CHECK(amplitude_us >= -150);
      CHECK(amplitude_us <= 150);
    }
  }
}
