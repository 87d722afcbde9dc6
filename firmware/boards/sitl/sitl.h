// The firmware as a shared library: one instrument in simulated time, stepped by its caller.
// Times are in ticks of 0.5 us since sitl_create(). Arrays are copied, but for the card's image,
// which stays the caller's. A call with a capacity fills at most that much and returns how much
// there is.
#pragma once

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

// A new world: erased EEPROM, no card, no stimuli, power off.
void sitl_create(void);

// --- the instrument, before power-on ---
void sitl_set_clock_offset(uint32_t offset_us);  // where the Mega's clock starts at each boot
void sitl_set_file_blocks(uint32_t blocks);      // size of a new flight file; 0: 64 MiB
void sitl_set_eeprom(const uint8_t* bytes);      // 4096
void sitl_get_eeprom(uint8_t* bytes);
// Settings into the EEPROM: the fields of the frame `config`, t_us first. 0: out of range.
int sitl_set_config(const uint8_t* config, size_t size);
// The settings an erased EEPROM gives, in the same layout.
size_t sitl_default_config(uint8_t* config, size_t capacity);
void sitl_insert_card(uint8_t* image, uint32_t blocks, const uint8_t* id);

// --- stimuli, in order of time; more may be added behind those given ---
void sitl_add_edges(const int64_t* at, const uint8_t* levels, size_t count);
// 40 bytes stand in `bytes` for each packet; a byte with its acknowledge takes `byte_ticks`,
// and the Mega holds the clock for 7 ticks behind it.
void sitl_add_packets(const int64_t* start,
                      const uint8_t* address,
                      const uint8_t* length,
                      const uint8_t* bytes,
                      uint32_t byte_ticks,
                      size_t count);
// Rows of 11 channels in counts, in the slots of the scan (alpha_a ... pot_rudder, rail).
void sitl_set_analog(int64_t start, int64_t step, const double* counts, size_t rows);
// As the chip measures it against a reference of 1.1 V.
void sitl_set_supply(uint16_t avcc_mv);
// The relay's contacts stay where they are when engaged, heartbeat or not.
void sitl_weld_relay(int welded);
// Its contacts stay at rest whatever the heartbeat does.
void sitl_cut_relay(int cut);
// A BMP085 with its 11 coefficients; rows of UT and UP, UP as at oversampling 3.
void sitl_set_pressure(
    const uint16_t* words, int64_t start, int64_t step, const double* raw, size_t rows);
// A BMP280 with its 12 coefficients; rows of the 20 bits of temperature and pressure.
void sitl_set_bmp280(
    const uint16_t* words, int64_t start, int64_t step, const double* raw, size_t rows);
void sitl_remove_pressure(void);
void sitl_hold_pressure_bus(int held);
void sitl_add_gps(const int64_t* at, const uint8_t* bytes, size_t count);
// The radio's modem takes no byte until then: what is sent waits. Port as for sitl_sent.
void sitl_hold_port(int port, int64_t until);
// Bytes that the USB line brings.
void sitl_add_usb(const int64_t* at, const uint8_t* bytes, size_t count);
void sitl_add_button(const int64_t* at, const uint8_t* pressed, size_t count);
// kind: 0 next block busy for `value` us, 1 next `value` blocks refused, 2 removed, 3 inserted,
// 4 every block busy for `value` us, 5 reads fail while `value` is not 0.
void sitl_add_card_events(const int64_t* at,
                          const uint8_t* kind,
                          const uint32_t* value,
                          size_t count);

// --- power and time ---
void sitl_power_on(void);
// Power goes, for the card too: a block being programmed is lost as garbage made from `seed`.
void sitl_power_cut(uint32_t seed);
// The chip restarts by itself, the card keeps its power. source: reset_cause of frames.toml.
void sitl_reset(uint8_t source);
void sitl_run_until(int64_t at);

// --- what it did ---
struct SitlState {
  int64_t now;
  uint32_t clock_us;
  uint32_t file_number;
  uint32_t blocks_taken;   // by the card's stream
  uint32_t ground_writes;  // blocks written outside it
  uint32_t conversions;    // of the pressure sensor
  uint16_t lost_edges;
  uint16_t lost_packets;
  uint16_t lost_gps_bytes;
  uint8_t recorder;  // app::Recorder::State
  uint8_t volume;    // storage::VolumeStatus
  uint8_t drive;     // enum drive of frames.toml
  uint8_t relay;
  uint8_t powered;
  uint8_t programming;  // the card is writing a block
  uint8_t led;
  uint8_t buzzer;
};
void sitl_state(struct SitlState* state);
size_t sitl_pulses(int64_t* start, uint8_t* output, uint16_t* width_ticks, size_t capacity);
// what: 0 relay, 1 LED, 2 buzzer.
size_t sitl_levels(int what, int64_t* at, uint8_t* level, size_t capacity);
// Bytes sent; port: 0 USB, 1 GPS, 2 telemetry.
size_t sitl_sent(int port, uint8_t* bytes, size_t capacity);

#ifdef __cplusplus
}
#endif
