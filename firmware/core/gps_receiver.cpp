#include "core/gps_receiver.h"

#include "core/bytes.h"

namespace core {
namespace {

constexpr uint8_t kNavigation = 0x01;
constexpr uint8_t kPosllh = 0x02;
constexpr uint8_t kSol = 0x06;
constexpr uint8_t kPvt = 0x07;
constexpr uint8_t kVelned = 0x12;

// Payloads by the offset of each word of four bytes, as the receiver descriptions of u-blox 6 and
// (NAV-PVT) 7 list them.
constexpr uint8_t kTimeOfWeek = 0;  // of all of them
constexpr uint8_t kLastWord = 68;   // that anything here looks at

namespace posllh {
constexpr uint8_t kLength = 28;
constexpr uint8_t kLongitude = 4;
constexpr uint8_t kLatitude = 8;
constexpr uint8_t kHeightAboveSea = 16;
constexpr uint8_t kHAccuracy = 20;
constexpr uint8_t kVAccuracy = 24;
}  // namespace posllh

namespace sol {
constexpr uint8_t kLength = 52;
constexpr uint8_t kWeekFixFlags = 8;
constexpr uint8_t kSatellites = 44;  // in its last byte
constexpr uint8_t kFixOk = 0b0001;
constexpr uint8_t kWeekKnown = 0b0100;
constexpr uint8_t kTimeKnown = 0b1000;
}  // namespace sol

namespace velned {
constexpr uint8_t kLength = 36;
constexpr uint8_t kNorth = 4;
constexpr uint8_t kEast = 8;
constexpr uint8_t kDown = 12;
constexpr uint8_t kGroundSpeed = 20;
constexpr uint8_t kCourse = 24;
constexpr uint8_t kSAccuracy = 28;
}  // namespace velned

namespace pvt {
constexpr uint8_t kLeastLength = 84;
constexpr uint8_t kDate = 4;
constexpr uint8_t kTimeAndValid = 8;
constexpr uint8_t kFixSatellites = 20;
constexpr uint8_t kLongitude = 24;
constexpr uint8_t kLatitude = 28;
constexpr uint8_t kHeightAboveSea = 36;
constexpr uint8_t kHAccuracy = 40;
constexpr uint8_t kVAccuracy = 44;
constexpr uint8_t kNorth = 48;
constexpr uint8_t kEast = 52;
constexpr uint8_t kDown = 56;
constexpr uint8_t kGroundSpeed = 60;
constexpr uint8_t kCourse = 64;
constexpr uint8_t kSAccuracy = 68;
constexpr uint8_t kDateValid = 0b01;
constexpr uint8_t kTimeValid = 0b10;
constexpr uint8_t kFixOk = 1;
}  // namespace pvt

constexpr uint8_t kHasPosllh = 0b001;
constexpr uint8_t kHasSol = 0b010;
constexpr uint8_t kHasVelned = 0b100;

constexpr int32_t kMaxLatitude = 900000000L;
constexpr int32_t kMaxLongitude = 1800000000L;
constexpr uint32_t kDayMs = 86400000U;
constexpr uint32_t kWeekMs = 7 * kDayMs;

int32_t within(int32_t value, int32_t limit, int32_t none) {
  return value >= -limit && value <= limit ? value : none;
}

int16_t to_i16(int32_t value) {
  return static_cast<int16_t>(within(value, INT16_MAX, INT16_MIN));
}

uint16_t to_u16(uint32_t value) {
  return value < UINT16_MAX ? static_cast<uint16_t>(value) : uint16_t{UINT16_MAX};
}

// gpsFix of u-blox: 4 is GPS with dead reckoning, 5 time only.
uint8_t to_fix(uint8_t value, bool fix_ok) {
  frames::GpsFix fix = frames::GpsFix::kNone;
  if (fix_ok && value >= 1 && value <= 3) {
    fix = static_cast<frames::GpsFix>(value);
  } else if (fix_ok && value == 4) {
    fix = frames::GpsFix::kFix3d;
  }
  return static_cast<uint8_t>(fix);
}

bool leap(uint16_t year) {
  return year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
}

uint8_t month_days(uint8_t month, uint16_t year) {
  if (month == 2) {
    return leap(year) ? 29 : 28;
  }
  return month == 4 || month == 6 || month == 9 || month == 11 ? 30 : 31;
}

// Days from 1980-01-06 to a UTC date; 0 if it is none.
uint16_t gps_days(uint16_t year, uint8_t month, uint8_t day) {
  if (year < 1980 || year > 2150 || month < 1 || month > 12) {
    return 0;
  }
  uint16_t days = 0;
  for (uint16_t y = 1980; y < year; ++y) {
    days = static_cast<uint16_t>(days + (leap(y) ? 366 : 365));
  }
  for (uint8_t m = 1; m < month; ++m) {
    days = static_cast<uint16_t>(days + month_days(m, year));
  }
  return static_cast<uint16_t>(days + day - 6);
}

}  // namespace

void clear_gps(frames::GpsFrame& frame) {
  frame = frames::GpsFrame();
  frame.itow_ms = frames::kGpsItowMsInvalid;
  frame.latitude = frames::kGpsLatitudeInvalid;
  frame.longitude = frames::kGpsLongitudeInvalid;
  frame.height = frames::kGpsHeightInvalid;
  frame.v_north = frames::kGpsVNorthInvalid;
  frame.v_east = frames::kGpsVEastInvalid;
  frame.v_down = frames::kGpsVDownInvalid;
  frame.ground_speed = frames::kGpsGroundSpeedInvalid;
  frame.course = frames::kGpsCourseInvalid;
  frame.h_accuracy = frames::kGpsHAccuracyInvalid;
  frame.v_accuracy = frames::kGpsVAccuracyInvalid;
  frame.s_accuracy = frames::kGpsSAccuracyInvalid;
}

bool GpsReceiver::byte(uint8_t value, uint32_t now_us) {
  switch (parser_.byte(value, now_us)) {
    case UbxEvent::kNone:
      return false;
    case UbxEvent::kWord:
      if (parser_.message_class() == kNavigation && parser_.offset() <= kLastWord) {
        word(static_cast<uint8_t>(parser_.offset()), parser_.word());
      }
      return false;
    case UbxEvent::kError:
      if (errors_ != 0xFFFF) {
        ++errors_;
      }
      parts_ = 0;
      return false;
    case UbxEvent::kMessage:
      break;
  }
  ++messages_;
  return message();
}

// A receiver that sends PVT says everything there.
void GpsReceiver::word(uint8_t offset, uint32_t value) {
  const uint16_t length = parser_.length();
  const bool old = !sends_pvt_;
  switch (parser_.message_id()) {
    case kPosllh:
      if (old && length == posllh::kLength) {
        posllh(offset, value);
      }
      break;
    case kSol:
      if (old && length == sol::kLength) {
        sol(offset, value);
      }
      break;
    case kVelned:
      if (old && length == velned::kLength) {
        velned(offset, value);
      }
      break;
    case kPvt:
      if (length >= pvt::kLeastLength) {
        pvt(offset, value);
      }
      break;
    default:
      break;
  }
}

void GpsReceiver::posllh(uint8_t offset, uint32_t value) {
  const int32_t number = static_cast<int32_t>(value);
  if (offset == kTimeOfWeek) {
    begin_epoch(value);
  } else if (offset == posllh::kLongitude) {
    frame_.longitude = within(number, kMaxLongitude, frames::kGpsLongitudeInvalid);
  } else if (offset == posllh::kLatitude) {
    frame_.latitude = within(number, kMaxLatitude, frames::kGpsLatitudeInvalid);
  } else if (offset == posllh::kHeightAboveSea) {
    frame_.height = number;
  } else if (offset == posllh::kHAccuracy) {
    frame_.h_accuracy = to_u16(value / 10);
  } else if (offset == posllh::kVAccuracy) {
    frame_.v_accuracy = to_u16(value / 10);
  }
}

void GpsReceiver::sol(uint8_t offset, uint32_t value) {
  if (offset == kTimeOfWeek) {
    begin_epoch(value);
  } else if (offset == sol::kWeekFixFlags) {
    const uint8_t flags = static_cast<uint8_t>(value >> 24);
    const bool week_known = (flags & sol::kWeekKnown) != 0;
    time_known_ = (flags & sol::kTimeKnown) != 0;
    frame_.week = week_known ? static_cast<uint16_t>(value) : frames::kGpsWeekInvalid;
    frame_.fix = to_fix(static_cast<uint8_t>(value >> 16), (flags & sol::kFixOk) != 0);
  } else if (offset == sol::kSatellites) {
    frame_.satellites = static_cast<uint8_t>(value >> 24);
  }
}

void GpsReceiver::velned(uint8_t offset, uint32_t value) {
  const int32_t number = static_cast<int32_t>(value);
  if (offset == kTimeOfWeek) {
    begin_epoch(value);
  } else if (offset == velned::kNorth) {
    frame_.v_north = to_i16(number);
  } else if (offset == velned::kEast) {
    frame_.v_east = to_i16(number);
  } else if (offset == velned::kDown) {
    frame_.v_down = to_i16(number);
  } else if (offset == velned::kGroundSpeed) {
    frame_.ground_speed = to_u16(value);
  } else if (offset == velned::kCourse) {
    frame_.course = to_u16(value / 1000);
  } else if (offset == velned::kSAccuracy) {
    frame_.s_accuracy = to_u16(value);
  }
}

void GpsReceiver::pvt(uint8_t offset, uint32_t value) {
  const int32_t number = static_cast<int32_t>(value);
  const uint8_t last = static_cast<uint8_t>(value >> 24);
  switch (offset) {
    case kTimeOfWeek:
      parts_ = 0;
      begin_epoch(value);
      break;
    case pvt::kDate:
      days_ = gps_days(static_cast<uint16_t>(value), static_cast<uint8_t>(value >> 16), last);
      break;
    case pvt::kTimeAndValid:
      time_known_ = (last & pvt::kTimeValid) != 0;
      if ((last & pvt::kTimeValid) != 0 && (last & pvt::kDateValid) != 0 && epoch_ms_ < kWeekMs) {
        // The date is UTC, the time of week GPS: near midnight they differ by a day.
        frame_.week = static_cast<uint16_t>((days_ + 3 - epoch_ms_ / kDayMs) / 7);
      }
      break;
    case pvt::kFixSatellites:
      frame_.fix = to_fix(static_cast<uint8_t>(value), (value >> 8 & pvt::kFixOk) != 0);
      frame_.satellites = last;
      break;
    case pvt::kLongitude:
      frame_.longitude = within(number, kMaxLongitude, frames::kGpsLongitudeInvalid);
      break;
    case pvt::kLatitude:
      frame_.latitude = within(number, kMaxLatitude, frames::kGpsLatitudeInvalid);
      break;
    case pvt::kHeightAboveSea:
      frame_.height = number;
      break;
    case pvt::kHAccuracy:
      frame_.h_accuracy = to_u16(value / 10);
      break;
    case pvt::kVAccuracy:
      frame_.v_accuracy = to_u16(value / 10);
      break;
    case pvt::kNorth:
      frame_.v_north = to_i16(number / 10);
      break;
    case pvt::kEast:
      frame_.v_east = to_i16(number / 10);
      break;
    case pvt::kDown:
      frame_.v_down = to_i16(number / 10);
      break;
    case pvt::kGroundSpeed:
      frame_.ground_speed = number < 0 ? uint16_t{0} : to_u16(value / 10);
      break;
    case pvt::kCourse:
      frame_.course = number < 0 ? frames::kGpsCourseInvalid : to_u16(value / 1000);
      break;
    case pvt::kSAccuracy:
      frame_.s_accuracy = to_u16(value / 10);
      break;
    default:
      break;
  }
}

void GpsReceiver::begin_epoch(uint32_t itow_ms) {
  if (parts_ != 0 && epoch_ms_ == itow_ms) {
    return;
  }
  parts_ = 0;
  epoch_ms_ = itow_ms;
  // Whoever looks while an epoch comes in (45 ms at 38400 baud, of 200) sees the last one, not a
  // hole: fix, place, satellites and what tells that the aircraft moves.
  const uint8_t fix = frame_.fix;
  const uint8_t satellites = frame_.satellites;
  const int32_t latitude = frame_.latitude;
  const int32_t longitude = frame_.longitude;
  const uint16_t ground_speed = time_known_ ? frame_.ground_speed : frames::kGpsGroundSpeedInvalid;
  time_known_ = true;
  clear_gps(frame_);
  frame_.fix = fix;
  frame_.satellites = satellites;
  frame_.latitude = latitude;
  frame_.longitude = longitude;
  frame_.ground_speed = ground_speed;
  frame_.t_us = parser_.first_byte_us();
}

bool GpsReceiver::message() {
  if (parser_.message_class() != kNavigation) {
    return false;
  }
  const uint8_t id = parser_.message_id();
  const uint16_t length = parser_.length();
  if (id == kPvt && length >= pvt::kLeastLength) {
    sends_pvt_ = true;
    finish();
    return true;
  }
  if (sends_pvt_) {
    return false;
  }
  uint8_t part = 0;
  if (id == kPosllh && length == posllh::kLength) {
    part = kHasPosllh;
  } else if (id == kSol && length == sol::kLength) {
    part = kHasSol;
  } else if (id == kVelned && length == velned::kLength) {
    part = kHasVelned;
  }
  parts_ = static_cast<uint8_t>(parts_ | part);
  if (parts_ != (kHasPosllh | kHasSol | kHasVelned)) {
    return false;
  }
  finish();
  return true;
}

void GpsReceiver::finish() {
  parts_ = 0;
  frame_.source = static_cast<uint8_t>(frames::GpsSource::kUbx);
  if (time_known_ && epoch_ms_ < kWeekMs) {
    frame_.itow_ms = epoch_ms_;
  }
  if (frame_.fix == static_cast<uint8_t>(frames::GpsFix::kNone)) {
    // A receiver without a fix repeats its last position or sends zeros.
    frame_.latitude = frames::kGpsLatitudeInvalid;
    frame_.longitude = frames::kGpsLongitudeInvalid;
    frame_.height = frames::kGpsHeightInvalid;
  }
}

uint32_t fat_time(uint16_t week, uint32_t itow_ms) {
  if (week == frames::kGpsWeekInvalid || itow_ms >= kWeekMs) {
    return 0;
  }
  constexpr uint8_t kLeapSeconds = 18;  // since 2017
  // Old receivers start over at week 1024 of their firmware: nothing flew this before 2018.
  uint32_t weeks = week;
  while (weeks < 2000) {
    weeks += 1024;
  }
  uint32_t second = itow_ms / 1000;
  if (second < kLeapSeconds) {
    second += kWeekMs / 1000;
    --weeks;
  }
  second -= kLeapSeconds;
  uint32_t days = weeks * 7 + second / 86400U + 5;  // from 1980-01-01
  second %= 86400U;
  uint16_t year = 1980;
  while (days >= (leap(year) ? 366U : 365U)) {
    days -= leap(year) ? 366U : 365U;
    ++year;
  }
  uint8_t month = 1;
  while (days >= month_days(month, year)) {
    days -= month_days(month, year);
    ++month;
  }
  const uint32_t date =
      static_cast<uint32_t>(year - 1980) << 9 | static_cast<uint32_t>(month) << 5 | (days + 1);
  const uint32_t hour = second / 3600;
  const uint32_t minute = second / 60 % 60;
  return date << 16 | hour << 11 | minute << 5 | (second % 60) / 2;
}

}  // namespace core
