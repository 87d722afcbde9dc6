// What the frame `identity` says of this program.
#pragma once

namespace app {

constexpr char kVersion[] = "0.1.0";  // at most 19 characters

}  // namespace app
