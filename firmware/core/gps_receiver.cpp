#include "core/gps_receiver.h"

#include "core/bytes.h"

namespace core {
namespace {

constexpr uint8_t kNavigation = 0x01;
constexpr uint8_t kPosllh = 0x02;
constexpr uint8_t kStatus = 0x03;
constexpr uint8_t kSol = 0x06;
constexpr uint8_t kPvt = 0x07;
constexpr uint8_t kVelned = 0x12;

constexpr uint8_t kHasPosllh = 0b001;
constexpr uint8_t kHasSol = 0b010;
constexpr uint8_t kHasVelned = 0b100;

constexpr int32_t kMaxLatitude = 900000000L;
constexpr int32_t kMaxLongitude = 1800000000L;
constexpr uint32_t kDayMs = 86400000U;
constexpr uint32_t kWeekMs = 7 * kDayMs;

int32_t i32(const uint8_t* payload, uint8_t offset) {
  return get_le<int32_t>(payload + offset);
}

uint32_t u32(const uint8_t* payload, uint8_t offset) {
  return get_le<uint32_t>(payload + offset);
}

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

// Days from 1980-01-06 to a UTC date.
uint16_t gps_days(uint16_t year, uint8_t month, uint8_t day) {
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
    case UbxEvent::kError:
      if (errors_ != 0xFFFF) {
        ++errors_;
      }
      return false;
    case UbxEvent::kMessage:
      break;
  }
  ++messages_;
  return message();
}

bool GpsReceiver::message() {
  if (parser_.message_class() != kNavigation || parser_.length() < 4) {
    return false;
  }
  const uint8_t* payload = parser_.payload();
  const uint8_t id = parser_.message_id();
  const uint16_t length = parser_.length();
  if (id == kPvt && length >= 84) {
    sends_pvt_ = true;
    return pvt(payload);
  }
  if (sends_pvt_) {
    return false;  // it says all the others do
  }
  if (id == kPosllh && length == 28) {
    begin_epoch(u32(payload, 0));
    parts_ = static_cast<uint8_t>(parts_ | kHasPosllh);
    frame_.longitude = within(i32(payload, 4), kMaxLongitude, frames::kGpsLongitudeInvalid);
    frame_.latitude = within(i32(payload, 8), kMaxLatitude, frames::kGpsLatitudeInvalid);
    frame_.height = i32(payload, 16);
    frame_.h_accuracy = to_u16(u32(payload, 20) / 10);
    frame_.v_accuracy = to_u16(u32(payload, 24) / 10);
  } else if (id == kSol && length == 52) {
    begin_epoch(u32(payload, 0));
    parts_ = static_cast<uint8_t>(parts_ | kHasSol);
    const uint8_t flags = payload[11];
    time_known_ = (flags & 0b1000) != 0;
    frame_.week = (flags & 0b0100) != 0 ? get_le<uint16_t>(payload + 8) : frames::kGpsWeekInvalid;
    frame_.fix = to_fix(payload[10], (flags & 1) != 0);
    frame_.satellites = payload[47];
  } else if (id == kVelned && length == 36) {
    begin_epoch(u32(payload, 0));
    parts_ = static_cast<uint8_t>(parts_ | kHasVelned);
    frame_.v_north = to_i16(i32(payload, 4));
    frame_.v_east = to_i16(i32(payload, 8));
    frame_.v_down = to_i16(i32(payload, 12));
    frame_.ground_speed = to_u16(u32(payload, 20));
    frame_.course = to_u16(u32(payload, 24) / 1000);
    frame_.s_accuracy = to_u16(u32(payload, 28));
  }
  if (parts_ != (kHasPosllh | kHasSol | kHasVelned)) {
    return false;
  }
  finish();
  return true;
}

void GpsReceiver::begin_epoch(uint32_t itow_ms) {
  if (parts_ != 0 && epoch_ms_ == itow_ms) {
    return;
  }
  parts_ = 0;
  epoch_ms_ = itow_ms;
  time_known_ = true;
  clear_gps(frame_);
  frame_.t_us = parser_.first_byte_us();
}

bool GpsReceiver::pvt(const uint8_t* payload) {
  parts_ = 0;
  begin_epoch(u32(payload, 0));
  const uint8_t valid = payload[11];
  time_known_ = (valid & 0b10) != 0;
  const uint8_t month = payload[6];
  if ((valid & 0b11) == 0b11 && epoch_ms_ < kWeekMs && month >= 1 && month <= 12) {
    // The date is UTC, the time of week GPS: near midnight they differ by a day.
    const uint16_t days = gps_days(get_le<uint16_t>(payload + 4), month, payload[7]);
    frame_.week = static_cast<uint16_t>((days + 3 - epoch_ms_ / kDayMs) / 7);
  }
  const uint8_t flags = payload[21];
  frame_.fix = to_fix(payload[20], (flags & 1) != 0);
  frame_.satellites = payload[23];
  frame_.longitude = within(i32(payload, 24), kMaxLongitude, frames::kGpsLongitudeInvalid);
  frame_.latitude = within(i32(payload, 28), kMaxLatitude, frames::kGpsLatitudeInvalid);
  frame_.height = i32(payload, 36);
  frame_.h_accuracy = to_u16(u32(payload, 40) / 10);
  frame_.v_accuracy = to_u16(u32(payload, 44) / 10);
  frame_.v_north = to_i16(i32(payload, 48) / 10);
  frame_.v_east = to_i16(i32(payload, 52) / 10);
  frame_.v_down = to_i16(i32(payload, 56) / 10);
  const int32_t speed_mmps = i32(payload, 60);
  frame_.ground_speed =
      speed_mmps < 0 ? uint16_t{0} : to_u16(static_cast<uint32_t>(speed_mmps) / 10);
  const int32_t course = i32(payload, 64);
  frame_.course =
      course < 0 ? frames::kGpsCourseInvalid : to_u16(static_cast<uint32_t>(course) / 1000);
  frame_.s_accuracy = to_u16(u32(payload, 68) / 10);
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
