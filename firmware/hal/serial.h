// Serial ports, each with a buffer in both directions filled and emptied by interrupts.
#pragma once

#include <stdint.h>

namespace hal {

// The IMU's board has one, kGps: the receiver in flight, the console on the ground.
enum class Port : uint8_t { kUsb, kGps, kTelemetry };

void open_port(Port port, uint32_t baud);

// Takes the oldest received byte; false if there is none. Main loop only. A board need buffer the
// GPS's port only; on USB it need hold one byte, and on the radio's nobody listens.
bool take_byte(Port port, uint8_t* byte);

// Room for bytes to send; the peer's "stop" (CTS) shows as room that does not grow.
uint16_t send_room(Port port);

// Queues a byte or some; only when there is room. Main loop only.
void send_byte(Port port, uint8_t byte);
void send_bytes(Port port, const uint8_t* bytes, uint8_t size);

// Bytes lost because nobody took them, since boot.
uint16_t lost_bytes(Port port);

}  // namespace hal
