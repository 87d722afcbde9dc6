// What the composition root starts, in this order.
#pragma once

#include <stdint.h>

namespace mega {

// Until the flight tests on the simulated chip have passed, servo, relay and heartbeat pins stay
// inputs, and the boot line says so.
constexpr bool kBenchOnly = true;

void start_clock();

}  // namespace mega
