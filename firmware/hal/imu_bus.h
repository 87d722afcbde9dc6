// The IMU's bus: its master pushes packets, this side is a slave only.
#pragma once

#include <stdint.h>

namespace hal {

constexpr uint8_t kImuPacketBytes = 40;  // longer transfers are cut

struct ImuPacket {
  uint32_t start_us;       // now_us() at START, for a master at 400 kHz
  uint16_t scan_after_us;  // from there to the start of the scan it started; 0: none
  uint8_t address;         // 7 bits, as the master sent it
  uint8_t length;          // bytes received
  uint8_t bytes[kImuPacketBytes];
};

// Answers addresses 42, 43 and 27. Once, at boot.
void start_imu_bus();

// Whether there is one. Main loop only.
bool imu_packet_waits();

// The oldest packet ended by STOP or repeated START, or nullptr. It stays until
// release_imu_packet(); two are held, a third is lost and counted. Main loop only.
const ImuPacket* imu_packet();
void release_imu_packet();

// Packets lost for want of room, since boot. Main loop only.
uint16_t lost_imu_packets();

// Lets go of the lines and starts the slave anew, for a bus silent too long. Takes less than 2 us
// with interrupts off. Main loop only.
void restart_imu_bus();

}  // namespace hal
