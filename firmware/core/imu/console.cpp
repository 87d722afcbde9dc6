#include "core/imu/console.h"

#include <string.h>

namespace core {
namespace {

// The text behind `word` and a blank, or the end; nullptr if `text` does not begin with it.
const char* behind(const char* text, const char* word) {
  while (*word != 0) {
    if (*text++ != *word++) {
      return nullptr;
    }
  }
  if (*text == 0) {
    return text;
  }
  return *text == ' ' ? text + 1 : nullptr;
}

// A decimal number from `text` to a blank or the end, left behind it.
bool take_number(const char*& text, int16_t least, int16_t most, int16_t& out) {
  const bool negative = *text == '-';
  text += negative ? 1 : 0;
  if (*text == 0 || *text == ' ') {
    return false;
  }
  int32_t value = 0;
  for (; *text != 0 && *text != ' '; ++text) {
    if (*text < '0' || *text > '9' || value > 10000) {
      return false;
    }
    value = value * 10 + (*text - '0');
  }
  value = negative ? -value : value;
  out = static_cast<int16_t>(value);
  return value >= least && value <= most;
}

// A decimal number and nothing else.
bool number(const char* text, int16_t least, int16_t most, int16_t& out) {
  return take_number(text, least, most, out) && *text == 0;
}

// Three numbers, a blank between two.
bool iron(const char* text, ImuSettings& out) {
  for (uint8_t axis = 0; axis < 3; ++axis) {
    int16_t value = 0;
    if ((axis != 0 && *text++ != ' ') || !take_number(text, -kMostIron, kMostIron, value)) {
      return false;
    }
    out.field_offset[axis] = value;
  }
  return *text == 0;
}

}  // namespace

ImuReply ImuConsole::byte(uint8_t value, ImuNode& node, ImuSettings& settings) {
  if (value != '\n' && value != '\r') {
    too_long_ = too_long_ || size_ == kLongest;
    if (!too_long_) {
      line_[size_++] = static_cast<char>(value);
    }
    return ImuReply::kNone;
  }
  line_[size_] = 0;
  const bool usable = !too_long_ && size_ != 0;
  size_ = 0;
  too_long_ = false;
  return usable ? line(node, settings) : ImuReply::kNone;
}

ImuReply ImuConsole::line(ImuNode& node, ImuSettings& settings) {
  const char* const command = behind(line_, "imu");
  if (command == nullptr) {
    return ImuReply::kNone;
  }
  if (behind(command, "show") != nullptr) {
    return ImuReply::kShow;
  }
  ImuSettings wanted = settings;
  int16_t value = 0;
  const char* text = nullptr;
  if (behind(command, "zero") != nullptr) {
    return node.zero_rates() ? ImuReply::kChanged : ImuReply::kMoving;
  }
  if (behind(command, "level") != nullptr) {
    return node.level() ? ImuReply::kChanged : ImuReply::kMoving;
  }
  if ((text = behind(command, "declination")) != nullptr &&
      number(text, -kMostDeclinationCdeg, kMostDeclinationCdeg, value)) {
    wanted.declination_cdeg = value;
  } else if ((text = behind(command, "dlpf")) != nullptr && number(text, 0, kMostDlpf, value)) {
    wanted.dlpf = static_cast<uint8_t>(value);
  } else if ((text = behind(command, "compat")) != nullptr && number(text, 0, 1, value)) {
    wanted.compat = static_cast<uint8_t>(value);
  } else if ((text = behind(command, "iron")) != nullptr && iron(text, wanted)) {
    // Taken off every field from the next one on.
  } else {
    return ImuReply::kUnknown;
  }
  if (!node.at_rest()) {
    return ImuReply::kMoving;
  }
  settings = wanted;
  node.settings_changed();
  return ImuReply::kChanged;
}

}  // namespace core
