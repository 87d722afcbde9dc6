// What the frame `identity` says of this program.
#pragma once

#include "core/progmem.h"

namespace app {

constexpr char kVersion[] CORE_FLASH = "0.1.0";  // at most 19 characters

}  // namespace app
