// The interface Python loads. Times are cycles of 62.5 ns since the chip was
// made; pins are port index * 8 + bit with ports A..H = 0..7, J = 8, K = 9, L
// = 10.
#ifndef SIMAVR_BENCH_BENCH_H_
#define SIMAVR_BENCH_BENCH_H_

#include "chip.h"

#define BENCH_API __attribute__((visibility("default")))

typedef void (*bench_callback)(uint32_t kind, uint32_t source, uint64_t cycle, uint32_t value);

enum { kCallbackTimer = 100, kCallbackI2c = 101 };

BENCH_API chip* bench_create(uint64_t seed, uint32_t kind);
BENCH_API void bench_destroy(chip* c);
BENCH_API void bench_on_event(chip* c, bench_callback callback);
BENCH_API void bench_set_startup(chip* c, uint32_t cycles, uint32_t reset_pc);

BENCH_API void bench_run(chip* c, uint64_t until);
BENCH_API void bench_stop(chip* c);
BENCH_API uint64_t bench_cycle(const chip* c);
BENCH_API void bench_timer(chip* c, uint64_t cycle, uint32_t id);

BENCH_API void bench_power_on(chip* c);
BENCH_API void bench_power_off(chip* c);
BENCH_API void bench_assert_reset(chip* c, uint32_t cause);
BENCH_API void bench_release_reset(chip* c, uint32_t cause);
BENCH_API int bench_state(const chip* c);  // 0 off, 1 held in reset, 2 running, 3 sleeping

BENCH_API uint8_t* bench_flash(chip* c);
BENCH_API uint8_t* bench_data(chip* c);
BENCH_API uint8_t* bench_eeprom(chip* c);
BENCH_API uint32_t bench_pc(const chip* c);
BENCH_API uint32_t bench_sp(const chip* c);
BENCH_API uint32_t bench_lowest_sp(const chip* c);
BENCH_API void bench_poke_pc(chip* c, uint32_t pc);
BENCH_API void bench_load(const chip* c,
                          uint64_t cycles[3]);  // running, sleeping, held
BENCH_API const vector_stats* bench_vector(const chip* c, uint32_t vector);
BENCH_API void bench_clear_statistics(chip* c);
BENCH_API void bench_log_interrupts(chip* c, bool on);
BENCH_API void bench_log_marks(chip* c, bool on);
BENCH_API void bench_watch_pc(chip* c, uint32_t address,
                              uint32_t number);  // 0: no more

BENCH_API void bench_count_cycles(chip* c);  // per flash word, from now on
BENCH_API const uint64_t* bench_spent(const chip* c);

BENCH_API size_t bench_log_count(const chip* c);
BENCH_API const log_record* bench_log(const chip* c);
BENCH_API void bench_clear_log(chip* c);

BENCH_API void bench_pin_watch(chip* c, uint32_t pin, bool log, bool notify);
BENCH_API bool bench_pin_level(const chip* c, uint32_t pin);
BENCH_API bool bench_pin_driven(const chip* c, uint32_t pin);
BENCH_API void bench_pin_strong(chip* c, uint32_t pin, uint32_t drive);
BENCH_API void bench_pin_weak(chip* c, uint32_t pin, uint32_t drive);
BENCH_API void bench_pin_strong_at(chip* c, uint64_t cycle, uint32_t pin, uint32_t drive);
BENCH_API void bench_pin_pull_low(chip* c, uint32_t pin, bool low);

BENCH_API void bench_analog_set(
    chip* c, uint32_t channel, const double* cycles, const double* volts, uint32_t count);
BENCH_API void bench_analog_noise(chip* c, uint32_t channel, double lsb);
BENCH_API void bench_analog_supply(chip* c, double avcc, double aref, double bandgap);
BENCH_API void bench_analog_stick(chip* c, uint64_t settings);
BENCH_API uint64_t bench_adc_conversions(const chip* c);

BENCH_API void bench_uart_send(chip* c,
                               uint32_t port,
                               const uint8_t* bytes,
                               uint32_t count,
                               double bit_cycles,
                               uint64_t from_cycle);
BENCH_API void bench_uart_notify(chip* c, uint32_t port, bool on);
BENCH_API uint64_t bench_uart_lost(const chip* c, uint32_t port);

BENCH_API void bench_twi_send(chip* c,
                              uint64_t start,
                              uint32_t id,
                              uint32_t address,
                              const uint8_t* bytes,
                              uint32_t count,
                              uint32_t scl_cycles,
                              uint32_t abort_kind,
                              uint32_t abort_after);
BENCH_API void bench_twi_hold(chip* c, bool sda, bool scl);

// Two chips on one bus: the master of a slave (or of register chips only). `rate`: cycles of the
// master in one of the slave. They run together from then on.
struct twi_bus;
BENCH_API struct twi_bus* bench_bus(chip* master, chip* slave, double rate);
BENCH_API void bench_bus_hold(
    struct twi_bus* b, bool sda_low, bool scl_low, bool sda_high, bool scl_high);
BENCH_API void bench_bus_hang(struct twi_bus* b, uint32_t clocks);     // SDA low for so many of SCL
BENCH_API void bench_bus_listen(struct twi_bus* b, uint32_t address);  // acknowledges everything
BENCH_API void bench_bus_log_bytes(struct twi_bus* b, bool on);
BENCH_API void bench_bus_stretch(struct twi_bus* b, double cycles);  // SCL held after every byte
BENCH_API double bench_bus_time(const struct twi_bus* b, const chip* c, uint64_t cycle);

// MPU-6000 on SPI, MPU-6050 on the bus. Times are cycles of the chip it is wired to.
typedef struct mpu mpu;
typedef struct mpu_settings {
  double clock_rate;     // of its own clock against the chip's
  double jitter_cycles;  // of a sample, either way; does not add up
  double gyro_noise_lsb, accel_noise_lsb;
} mpu_settings;
typedef struct mpu_sample {
  uint64_t cycle;    // data-ready
  int16_t words[7];  // ax ay az temperature gx gy gz, as in the registers
} mpu_sample;
BENCH_API mpu* bench_mpu_spi(chip* c, uint32_t cs_pin, uint32_t int_pin, uint32_t product_id);
BENCH_API mpu* bench_mpu_i2c(chip* c, struct twi_bus* b, uint32_t int_pin, uint32_t product_id);
BENCH_API void bench_mpu_set(mpu* m, const mpu_settings* settings);
BENCH_API void bench_mpu_fault(mpu* m,
                               uint32_t fault);  // 0 none 1 silent 2 stuck 3 garbage 4 clock
BENCH_API void bench_mpu_reset(mpu* m);          // by itself: asleep, registers at default
// Values by point: ax ay az in g, degC, gx gy gz in deg/s, axes of the chip.
BENCH_API void bench_mpu_write(mpu* m, uint32_t number, uint32_t value);
BENCH_API void bench_mpu_motion(mpu* m, const double* cycles, const double* values, uint32_t count);
BENCH_API size_t bench_mpu_count(const mpu* m);
BENCH_API const mpu_sample* bench_mpu_samples(const mpu* m);
BENCH_API const uint8_t* bench_mpu_registers(const mpu* m);

// HMC5883L, or QMC5883L; field in gauss, axes of the chip.
typedef struct magnetometer magnetometer;
BENCH_API magnetometer* bench_magnetometer(chip* c, struct twi_bus* b, bool qmc);
BENCH_API void bench_magnetometer_fault(magnetometer* m, bool present, bool stuck);
BENCH_API uint64_t bench_magnetometer_count(const magnetometer* m);
BENCH_API void bench_magnetometer_field(magnetometer* m,
                                        const double* cycles,
                                        const double* values,
                                        uint32_t count);

// Devices on bit-banged I2C: a file of 256 registers with automatic increment.
typedef struct i2c_device i2c_device;
BENCH_API i2c_device* bench_i2c_device(
    chip* c, uint32_t id, uint32_t address, uint32_t sda_pin, uint32_t scl_pin);
BENCH_API uint8_t* bench_i2c_registers(i2c_device* d);
BENCH_API void bench_i2c_present(i2c_device* d, bool present);
BENCH_API uint32_t bench_i2c_fastest(const i2c_device* d);  // shortest SCL period seen, cycles

// SD card in SPI mode on a memory the caller owns.
typedef struct sd_card sd_card;
typedef struct sd_settings {
  uint32_t blocks;
  uint32_t high_capacity;  // block addresses
  uint32_t version_1;      // knows no CMD8
  uint32_t busy_cycles;    // after every block written
  uint32_t read_cycles;    // before every block read
  uint32_t init_cycles;    // ACMD41 answers idle for so long
  uint32_t erase_cycles;
  uint32_t response_bytes;  // 0xFF before R1, 1..8
} sd_settings;
typedef struct sd_counters {
  uint64_t commands, written, read, rejected, lost, bytes_ignored, erased;
} sd_counters;
BENCH_API sd_card* bench_sd_card(
    chip* c, uint32_t cs_pin, uint8_t* memory, const sd_settings* settings, uint64_t seed);
BENCH_API void bench_sd_insert(sd_card* s, bool present);
BENCH_API void bench_sd_stall(sd_card* s, uint64_t from_cycle, uint32_t cycles);
BENCH_API void bench_sd_reject(sd_card* s, uint64_t from_cycle, uint32_t count, uint32_t token);
BENCH_API void bench_sd_power_cut(sd_card* s);
BENCH_API bool bench_sd_busy(const sd_card* s);
BENCH_API void bench_sd_fail_reads(sd_card* s, bool fail);
BENCH_API void bench_sd_hold_line(sd_card* s, bool low);
BENCH_API void bench_sd_delays(sd_card* s, uint32_t read_cycles, uint32_t init_cycles);
// Keeps every block that was programmed from now on, in the caller's memory; a power cut at any
// instant of the run can be told from it. `ended` is UINT64_MAX while the card is busy with it;
// what a cut spoiled carries the garbage. Records beyond `capacity` are counted, not kept.
typedef struct sd_record {
  uint64_t begun, ended;
  uint32_t block, spoiled;
  uint8_t data[512];
} sd_record;
BENCH_API void bench_sd_journal(sd_card* s, sd_record* records, uint64_t capacity);
BENCH_API uint64_t bench_sd_journal_count(const sd_card* s);
BENCH_API void bench_sd_counters(const sd_card* s, sd_counters* out);

// Module entries behind this interface.
double adc_channel_volt(chip* c, uint8_t number, uint64_t cycle);
void uart_send(chip* c,
               uint8_t number,
               const uint8_t* bytes,
               uint32_t count,
               uint64_t bit_256,
               uint64_t from_cycle);
void interrupt_returned(struct avr_irq_t* irq, uint32_t value, void* param);

#endif  // SIMAVR_BENCH_BENCH_H_
