// Receiver inputs: edges of five lines, stamped when they happen.
#pragma once

#include <stdint.h>

namespace hal {

constexpr uint8_t kReceiverInputs = 5;

struct Edge {
  uint16_t at_ticks;  // low half of now_ticks() at the edge
  uint8_t levels;     // lines after the edge, bit 0 is input 0 (A8)
  bool late;          // the stamp may be late: the interrupt was held up; not to be measured with
};

// Arms the inputs. Once, at boot.
void start_pulse_capture();

// Whether there is one to be taken. Main loop only.
bool edge_waits();

// Takes the oldest edge; false if there is none. Main loop only, at least every 30 ms, else stamps
// become ambiguous.
bool take_edge(Edge* edge);

// Edges that found the buffer full since boot. Main loop only.
uint16_t lost_edges();

// Edges in the millisecond in which the bank was masked because of a storm; 0: it is not masked.
// Main loop only.
uint8_t edge_storm();

}  // namespace hal
