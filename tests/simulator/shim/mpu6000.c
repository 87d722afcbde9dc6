// MPU-6000 on SPI and MPU-6050 on I2C (RM-MPU-6000A-00 rev. 4.2, PS-MPU-6000A-00 rev. 3.4): sleep,
// reset, ranges, low-pass, sample rate divider, data-ready line, samples that do not change under a
// burst. It samples a motion given as straight lines between points, on a clock of its own.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "bus.h"

enum {
  kProductId = 0x0C,
  kSmplrtDiv = 0x19,
  kConfig = 0x1A,
  kGyroConfig = 0x1B,
  kAccelConfig = 0x1C,
  kIntPinCfg = 0x37,
  kIntEnable = 0x38,
  kIntStatus = 0x3A,
  kFirstData = 0x3B,
  kLastData = 0x48,
  kUserCtrl = 0x6A,
  kPwrMgmt1 = 0x6B,
  kWhoAmI = 0x75,
};
enum { kChannels = 7 };  // ax ay az in g, degC, gx gy gz in deg/s: the order of the registers
enum { kPulseCycles = 50 * 16, kResetCycles = 16000 * 30, kGyroStartCycles = 16000 * 30 };
enum mpu_fault { kHealthy = 0, kSilent = 1, kStuck = 2, kGarbage = 3, kClockStopped = 4 };

struct mpu {
  chip* c;
  uint8_t cs_pin, int_pin;
  mpu_settings settings;
  uint8_t registers[128];
  uint8_t product_id;
  uint8_t fault;
  uint8_t pointer, position;
  bool reading, selected, revision_c;
  event tick, pulse_end;
  double next;  // cycle of the next internal sample
  uint64_t reset_until, awake_since;
  uint32_t divided;  // internal samples since the last output
  double filtered[kChannels];
  bool settled;
  bool output_waits;  // a burst is under way
  int16_t words[kChannels];
  // motion
  double *cycles, *values;
  uint32_t count, first;
  mpu_sample* samples;
  size_t sample_count, sample_capacity;
  bus_device on_bus;
};

// Delays and bandwidths of the low-pass by DLPF_CFG (register map, section 4.3): gyro.
static const double kDelayMs[7] = {0.98, 1.9, 2.8, 4.8, 8.3, 13.4, 18.6};
static const double kBandHz[7] = {256, 188, 98, 42, 20, 10, 5};
static const double kAccelDelayMs[7] = {0, 2.0, 3.0, 4.9, 8.5, 13.8, 19.0};

static void reset_registers(mpu* m) {
  memset(m->registers, 0, sizeof m->registers);
  m->registers[kPwrMgmt1] = 0x40;
  m->registers[kWhoAmI] = 0x68;
  m->registers[kProductId] = m->product_id;
  m->settled = false;
  m->divided = 0;
  m->output_waits = false;
}

static bool asleep(const mpu* m) {
  return m->registers[kPwrMgmt1] & 0x40;
}

static uint8_t low_pass(const mpu* m) {
  const uint8_t dlpf = m->registers[kConfig] & 7;
  return dlpf == 7 ? 0 : dlpf;
}

static double motion(mpu* m, uint32_t channel, double at) {
  if (m->count == 0) return 0.0;
  while (m->first + 1 < m->count && m->cycles[m->first + 1] <= at) m->first++;
  while (m->first > 0 && m->cycles[m->first] > at) m->first--;
  const double a = m->values[m->first * kChannels + channel];
  if (m->first + 1 == m->count || at <= m->cycles[m->first]) return a;
  const double b = m->values[(m->first + 1) * kChannels + channel];
  const double span = m->cycles[m->first + 1] - m->cycles[m->first];
  return a + (b - a) * (at - m->cycles[m->first]) / span;
}

// One pole at the bandwidth and what is missing of the stated delay.
static void filter(mpu* m, double now, double period) {
  const uint8_t dlpf = low_pass(m);
  for (uint32_t i = 0; i < kChannels; i++) {
    const double delay = (i < 3 ? kAccelDelayMs[dlpf] : kDelayMs[dlpf]) * 16e3;
    double tau = 16e6 / (2 * M_PI * kBandHz[dlpf]);
    if (tau > delay) tau = delay;
    const double share = tau > 0 ? 1 - exp(-period / tau) : 1.0;
    const double lag = period * (1 / share - 1);  // of the pole, sampled
    const double in = motion(m, i, now - (delay - lag));
    m->filtered[i] += (m->settled ? share : 1.0) * (in - m->filtered[i]);
  }
  m->settled = true;
}

static double noise(mpu* m) {
  double sum = -6.0;
  for (int i = 0; i < 12; i++) sum += (double)chip_random(m->c) / 4294967296.0;
  return sum;
}

static int16_t limited(double value) {
  return (int16_t)(value > 32767 ? 32767 : value < -32768 ? -32768 : lround(value));
}

static void convert(mpu* m, uint64_t now) {
  const double gyro_lsb = 131.072 / (1 << ((m->registers[kGyroConfig] >> 3) & 3));
  const double accel_lsb =
      (m->revision_c ? 8192.0 : 16384.0) / (1 << ((m->registers[kAccelConfig] >> 3) & 3));
  const bool starting = now < m->awake_since + kGyroStartCycles;
  for (uint32_t i = 0; i < kChannels; i++) {
    double value = m->filtered[i];
    if (i < 3)
      value = value * accel_lsb + m->settings.accel_noise_lsb * noise(m);
    else if (i == 3)
      value = (value - 36.53) * 340 + 2 * noise(m);
    else
      value = starting ? 0 : value * gyro_lsb + m->settings.gyro_noise_lsb * noise(m);
    m->words[i] = limited(value);
  }
}

static void publish(mpu* m) {
  for (uint32_t i = 0; i < kChannels; i++) {
    m->registers[kFirstData + 2 * i] = (uint8_t)((uint16_t)m->words[i] >> 8);
    m->registers[kFirstData + 2 * i + 1] = (uint8_t)m->words[i];
  }
  m->output_waits = false;
}

static void line(mpu* m, bool on) {
  const bool low_active = m->registers[kIntPinCfg] & 0x80;
  pin_strong(m->c, m->int_pin, on != low_active ? kDriveHigh : kDriveLow);
}

static void pulse_over(chip* c, void* param, uint64_t argument) {
  (void)c, (void)argument;
  line(param, false);
}

static void remember(mpu* m, uint64_t cycle) {
  if (m->sample_count == m->sample_capacity) {
    m->sample_capacity = m->sample_capacity ? 2 * m->sample_capacity : 4096;
    m->samples = realloc(m->samples, m->sample_capacity * sizeof *m->samples);
    if (!m->samples) abort();
  }
  mpu_sample* const s = &m->samples[m->sample_count++];
  s->cycle = cycle;
  memcpy(s->words, m->words, sizeof s->words);
}

static void output(mpu* m, uint64_t now) {
  if (m->fault != kStuck) convert(m, now);
  if (m->selected)
    m->output_waits = true;
  else
    publish(m);
  m->registers[kIntStatus] |= 0x01;
  if (!(m->registers[kIntEnable] & 0x01)) return;
  remember(m, now);
  line(m, true);
  if (!(m->registers[kIntPinCfg] & 0x20)) event_at(m->c, &m->pulse_end, now + kPulseCycles);
}

static void tick(chip* c, void* param, uint64_t argument) {
  (void)argument;
  mpu* const m = param;
  const uint64_t now = chip_now(c);
  const bool fast = (m->registers[kConfig] & 7) == 0 || (m->registers[kConfig] & 7) == 7;
  const double period = (fast ? 2000.0 : 16000.0) / m->settings.clock_rate;
  m->next += period;
  const double jitter = m->settings.jitter_cycles * ((double)chip_random(c) / 2147483648.0 - 1.0);
  const double at = m->next + jitter;
  event_at(c, &m->tick, at > (double)now ? (uint64_t)at : now + 1);
  if (asleep(m) || now < m->reset_until || m->fault == kSilent || m->fault == kClockStopped) return;
  filter(m, (double)now, period);
  if (++m->divided > m->registers[kSmplrtDiv]) {
    m->divided = 0;
    output(m, now);
  }
}

// ---- registers ----

static uint8_t read_register(mpu* m, uint8_t number) {
  if (m->fault == kGarbage) return (uint8_t)chip_random(m->c);
  if (chip_now(m->c) < m->reset_until) return 0;
  const uint8_t value = m->registers[number & 0x7F];
  const bool any_clears = m->registers[kIntPinCfg] & 0x10;
  if (number == kIntStatus || any_clears) {
    m->registers[kIntStatus] = 0;
    if (m->registers[kIntPinCfg] & 0x20) line(m, false);
  }
  return value;
}

static void write_register(mpu* m, uint8_t number, uint8_t value) {
  if (m->fault == kGarbage || chip_now(m->c) < m->reset_until) return;
  number &= 0x7F;
  if (number == kPwrMgmt1 && (value & 0x80)) {
    reset_registers(m);
    m->reset_until = chip_now(m->c) + kResetCycles;
    line(m, false);
    return;
  }
  if (number == kProductId || number == kWhoAmI || (number >= kIntStatus && number <= kLastData)) {
    return;
  }
  const bool was_asleep = asleep(m);
  m->registers[number] = value;
  if (was_asleep && !asleep(m)) {
    m->awake_since = chip_now(m->c);
    m->settled = false;
    m->divided = 0;
  }
}

static void released(mpu* m) {
  m->selected = false;
  m->position = 0;
  if (m->output_waits) publish(m);
}

static uint8_t exchange(chip* c, void* param, uint8_t mosi, bool selected) {
  mpu* const m = param;
  if (!selected || m->fault == kSilent) return 0xFF;
  // Mode 0 or 3; 1 MHz but for the sensor registers (PS, section 6.5).
  const uint8_t mode = c->avr->data[REG_SPCR] & 0x0C;
  const bool data = m->reading && m->pointer >= kIntStatus && m->pointer <= kLastData;
  if ((mode != 0 && mode != 0x0C) || (m->position > 0 && !data && spi_divider(c) < 16)) return 0xFF;
  if (m->position++ == 0) {
    m->reading = mosi & 0x80;
    m->pointer = mosi & 0x7F;
    return 0xFF;
  }
  const uint8_t number = m->pointer;
  m->pointer = (uint8_t)((m->pointer + 1) & 0x7F);
  if (m->reading) return read_register(m, number);
  write_register(m, number, mosi);
  return 0xFF;
}

static void select_moves(chip* c, void* param, uint8_t number, bool level) {
  (void)c, (void)number;
  mpu* const m = param;
  if (level)
    released(m);
  else
    m->selected = true;
}

static uint8_t bus_read(chip* c, void* param, uint8_t number) {
  (void)c;
  return read_register(param, number);
}

static void bus_write(chip* c, void* param, uint8_t number, uint8_t value) {
  (void)c;
  write_register(param, number, value);
}

static void bus_busy(chip* c, void* param, bool on) {
  (void)c;
  mpu* const m = param;
  if (on)
    m->selected = true;
  else
    released(m);
}

// ---- interface ----

static mpu* make(chip* c, uint32_t int_pin, uint32_t product_id) {
  mpu* const m = chip_allocate(c, sizeof *m);
  m->c = c;
  m->int_pin = (uint8_t)int_pin;
  m->product_id = (uint8_t)product_id;
  const uint8_t revision = product_id & 0x0F;
  m->revision_c = (product_id & 0x10) && (revision == 4 || revision == 5);
  m->settings.clock_rate = 1.0;
  reset_registers(m);
  m->reset_until = chip_now(c) + kResetCycles;
  m->next = (double)chip_now(c) + 16000;
  m->tick.run = tick;
  m->tick.param = m;
  m->pulse_end.run = pulse_over;
  m->pulse_end.param = m;
  event_at(c, &m->tick, (uint64_t)m->next);
  line(m, false);
  chip_own(c, (void**)&m->cycles);
  chip_own(c, (void**)&m->values);
  chip_own(c, (void**)&m->samples);
  return m;
}

mpu* bench_mpu_spi(chip* c, uint32_t cs_pin, uint32_t int_pin, uint32_t product_id) {
  mpu* const m = make(c, int_pin, product_id);
  m->cs_pin = (uint8_t)cs_pin;
  if (c->spi.device_count == kSpiDeviceCount) abort();
  c->spi.device[c->spi.device_count++] = (spi_device){m->cs_pin, exchange, m};
  pin_listen(c, m->cs_pin, select_moves, m);
  return m;
}

mpu* bench_mpu_i2c(chip* c, twi_bus* b, uint32_t int_pin, uint32_t product_id) {
  mpu* const m = make(c, int_pin, product_id);
  m->on_bus = (bus_device){.address = 0x68,
                           .present = true,
                           .param = m,
                           .read = bus_read,
                           .write = bus_write,
                           .busy = bus_busy};
  bus_add(b, &m->on_bus);
  return m;
}

void bench_mpu_set(mpu* m, const mpu_settings* settings) {
  m->settings = *settings;
}

void bench_mpu_fault(mpu* m, uint32_t fault) {
  m->fault = (uint8_t)fault;
  m->on_bus.present = fault != kSilent;
}

void bench_mpu_write(mpu* m, uint32_t number, uint32_t value) {
  m->reset_until = 0;
  write_register(m, (uint8_t)number, (uint8_t)value);
}

void bench_mpu_reset(mpu* m) {
  reset_registers(m);
  m->reset_until = chip_now(m->c) + kResetCycles;
  line(m, false);
}

void bench_mpu_motion(mpu* m, const double* cycles, const double* values, uint32_t count) {
  free(m->cycles);
  free(m->values);
  m->cycles = malloc((count + 1) * sizeof(double));
  m->values = malloc((count + 1) * kChannels * sizeof(double));
  if (!m->cycles || !m->values) abort();
  memcpy(m->cycles, cycles, count * sizeof(double));
  memcpy(m->values, values, count * kChannels * sizeof(double));
  m->count = count;
  m->first = 0;
}

size_t bench_mpu_count(const mpu* m) {
  return m->sample_count;
}

const mpu_sample* bench_mpu_samples(const mpu* m) {
  return m->samples;
}

const uint8_t* bench_mpu_registers(const mpu* m) {
  return m->registers;
}
