// HMC5883L (Honeywell 900405 rev. E) and QMC5883L (QST 13-52-04 rev. A) on the bus: registers,
// output rate, gain, and a field given as straight lines between points.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "bus.h"

enum { kAxes = 3 };

struct magnetometer {
  chip* c;
  bool qmc;
  bool stuck;
  uint8_t registers[16];
  bus_device on_bus;
  event tick;
  uint64_t samples;
  double *cycles, *values;  // gauss, axes of the chip
  uint32_t count, first;
};

static double field(magnetometer* m, uint32_t axis, double at) {
  if (m->count == 0) return 0.0;
  while (m->first + 1 < m->count && m->cycles[m->first + 1] <= at) m->first++;
  const double a = m->values[m->first * kAxes + axis];
  if (m->first + 1 == m->count || at <= m->cycles[m->first]) return a;
  const double b = m->values[(m->first + 1) * kAxes + axis];
  return a + (b - a) * (at - m->cycles[m->first]) / (m->cycles[m->first + 1] - m->cycles[m->first]);
}

static double jitter(magnetometer* m) {
  return (double)chip_random(m->c) / 1073741824.0 - 2.0;  // 2 LSB
}

static void convert_hmc(magnetometer* m, double now) {
  // Gain by CRB (table 9), X Z Y with the high byte first; out of range is -4096.
  static const double kLsb[8] = {1370, 1090, 820, 660, 440, 390, 330, 230};
  static const uint8_t kPlace[kAxes] = {0, 4, 2};
  const double lsb = kLsb[m->registers[1] >> 5];
  for (uint32_t axis = 0; axis < kAxes; axis++) {
    const double exact = field(m, axis, now) * lsb + jitter(m);
    const int16_t value = fabs(exact) > 2047 ? -4096 : (int16_t)lround(exact);
    m->registers[3 + kPlace[axis]] = (uint8_t)((uint16_t)value >> 8);
    m->registers[4 + kPlace[axis]] = (uint8_t)value;
  }
}

static void convert_qmc(magnetometer* m, double now) {
  const double lsb = m->registers[9] & 0x10 ? 3000 : 12000;
  for (uint32_t axis = 0; axis < kAxes; axis++) {
    const double exact = field(m, axis, now) * lsb + 5 * jitter(m);
    const int16_t value = (int16_t)(exact > 32767    ? 32767
                                    : exact < -32768 ? -32768
                                                     : lround(exact));
    m->registers[2 * axis] = (uint8_t)value;
    m->registers[2 * axis + 1] = (uint8_t)((uint16_t)value >> 8);
  }
}

static void tick(chip* c, void* param, uint64_t argument) {
  (void)argument;
  magnetometer* const m = param;
  static const double kHmcHz[8] = {0.75, 1.5, 3, 7.5, 15, 30, 75, 15};
  static const double kQmcHz[4] = {10, 50, 100, 200};
  const double rate_hz =
      m->qmc ? kQmcHz[(m->registers[9] >> 2) & 3] : kHmcHz[(m->registers[0] >> 2) & 7];
  event_at(c, &m->tick, chip_now(c) + (uint64_t)(16e6 / rate_hz));
  const bool continuous = m->qmc ? (m->registers[9] & 3) == 1 : (m->registers[2] & 3) == 0;
  if (!continuous || m->stuck) return;
  m->samples++;
  if (m->qmc)
    convert_qmc(m, (double)chip_now(c));
  else
    convert_hmc(m, (double)chip_now(c));
}

static uint8_t read_register(chip* c, void* param, uint8_t number) {
  (void)c;
  magnetometer* const m = param;
  return m->registers[number & 15];
}

static void write_register(chip* c, void* param, uint8_t number, uint8_t value) {
  (void)c;
  magnetometer* const m = param;
  const bool writable = m->qmc ? number >= 9 && number <= 11 : number <= 2;
  if (writable) m->registers[number] = value;
}

static uint8_t next_hmc(uint8_t number) {
  return number == 8 ? 3 : (uint8_t)((number + 1) & 15);
}

magnetometer* bench_magnetometer(chip* c, twi_bus* b, bool qmc) {
  magnetometer* const m = chip_allocate(c, sizeof *m);
  m->c = c;
  m->qmc = qmc;
  if (qmc) {
    m->registers[13] = 0xFF;
  } else {
    m->registers[0] = 0x10;
    m->registers[1] = 0x20;
    m->registers[2] = 0x01;
    memcpy(m->registers + 10, "H43", 3);
  }
  m->on_bus = (bus_device){.address = qmc ? 0x0D : 0x1E,
                           .present = true,
                           .param = m,
                           .read = read_register,
                           .write = write_register,
                           .next = qmc ? NULL : next_hmc};
  bus_add(b, &m->on_bus);
  m->tick.run = tick;
  m->tick.param = m;
  event_at(c, &m->tick, chip_now(c) + 160000);
  chip_own(c, (void**)&m->cycles);
  chip_own(c, (void**)&m->values);
  return m;
}

void bench_magnetometer_fault(magnetometer* m, bool present, bool stuck) {
  m->on_bus.present = present;
  m->stuck = stuck;
}

uint64_t bench_magnetometer_count(const magnetometer* m) {
  return m->samples;
}

void bench_magnetometer_field(magnetometer* m,
                              const double* cycles,
                              const double* values,
                              uint32_t count) {
  free(m->cycles);
  free(m->values);
  m->cycles = malloc((count + 1) * sizeof(double));
  m->values = malloc((count + 1) * kAxes * sizeof(double));
  if (!m->cycles || !m->values) abort();
  memcpy(m->cycles, cycles, count * sizeof(double));
  memcpy(m->values, values, count * kAxes * sizeof(double));
  m->count = count;
  m->first = 0;
}
