// A chip with 256 registers on a bit-banged I2C bus: follows SDA and SCL edge
// by edge, acknowledges its address, takes and gives bytes with automatic
// increment. What a register means is decided in Python, which hears of every
// write.
#include "bench.h"

enum state { kIdle, kAddress, kRegister, kWrite, kRead, kIgnore };

struct i2c_device {
  chip* c;
  uint32_t id;
  uint8_t address, sda_pin, scl_pin;
  uint8_t registers[256];
  uint8_t pointer;
  bool present;
  bool pulling;  // this device holds SDA low
  bool acknowledging;
  uint8_t state, bits, shift;
  bool sda, scl;
  uint64_t last_rise;
  uint32_t fastest;
};

static void pull(i2c_device* d, bool low) {
  if (d->pulling == low) return;
  d->pulling = low;
  pin_pull_low(d->c, d->sda_pin, low);
}

static void start(i2c_device* d) {
  d->state = kAddress;
  d->bits = 0;
  d->shift = 0;
  d->acknowledging = false;
  pull(d, false);
}

static void give_bit(i2c_device* d) {
  const bool bit = (d->shift & 0x80) != 0;
  d->shift = (uint8_t)(d->shift << 1);
  pull(d, !bit);
}

// Takes the byte just shifted in; tells whether to acknowledge.
static bool take(i2c_device* d) {
  switch ((enum state)d->state) {
    case kAddress:
      if (!d->present || d->shift >> 1 != d->address) {
        d->state = kIgnore;
        return false;
      }
      d->state = d->shift & 1 ? kRead : kRegister;
      return true;
    case kRegister:
      d->pointer = d->shift;
      d->state = kWrite;
      return true;
    case kWrite: {
      const uint8_t number = d->pointer++;
      d->registers[number] = d->shift;
      if (d->c->callback) {
        d->c->callback(kCallbackI2c, d->id, chip_now(d->c), (uint32_t)(number << 8 | d->shift));
      }
      return true;
    }
    default:
      return false;
  }
}

static void clock_rises(i2c_device* d) {
  const uint64_t now = chip_now(d->c);
  if (d->last_rise && d->state != kIdle && now - d->last_rise < d->fastest) {
    d->fastest = (uint32_t)(now - d->last_rise);
  }
  d->last_rise = now;
  if (d->state == kIdle || d->state == kIgnore) return;
  if (d->state == kRead) {
    // ninth bit: the master's acknowledge
    if (d->bits == 9 && d->sda) d->state = kIgnore;
    return;
  }
  if (d->bits < 8) {
    d->shift = (uint8_t)(d->shift << 1 | d->sda);
    d->bits++;
  }
}

static void clock_falls(i2c_device* d) {
  switch ((enum state)d->state) {
    case kIdle:
      return;
    case kIgnore:
      pull(d, false);
      return;
    case kRead:
      if (d->acknowledging || d->bits == 9) {  // address acknowledged, or the master wants more
        d->acknowledging = false;
        d->shift = d->registers[d->pointer++];
        d->bits = 1;
        give_bit(d);
      } else if (d->bits == 8) {
        d->bits = 9;
        pull(d, false);
      } else {
        d->bits++;
        give_bit(d);
      }
      return;
    default:
      break;
  }
  if (d->acknowledging) {
    d->acknowledging = false;
    d->bits = 0;
    d->shift = 0;
    pull(d, false);
  } else if (d->bits == 8) {
    if (take(d)) {
      d->acknowledging = true;
      pull(d, true);
    }
    d->bits = 0;
  }
}

static void line_changed(chip* c, void* param, uint8_t number, bool level) {
  (void)c;
  i2c_device* const d = param;
  if (number == d->scl_pin) {
    if (level == d->scl) return;
    d->scl = level;
    if (level)
      clock_rises(d);
    else
      clock_falls(d);
    return;
  }
  if (level == d->sda) return;
  d->sda = level;
  if (!d->scl || d->pulling) return;
  if (!level) {
    start(d);
  } else {
    d->state = kIdle;
  }
}

i2c_device* bench_i2c_device(
    chip* c, uint32_t id, uint32_t address, uint32_t sda_pin, uint32_t scl_pin) {
  i2c_device* const d = chip_allocate(c, sizeof *d);
  d->c = c;
  d->id = id;
  d->address = (uint8_t)address;
  d->sda_pin = (uint8_t)sda_pin;
  d->scl_pin = (uint8_t)scl_pin;
  d->present = true;
  d->fastest = UINT32_MAX;
  c->pins[sda_pin].weak = c->pins[scl_pin].weak = kDriveHigh;
  pin_refresh(c, d->sda_pin);
  pin_refresh(c, d->scl_pin);
  d->sda = c->pins[sda_pin].level;
  d->scl = c->pins[scl_pin].level;
  pin_listen(c, d->sda_pin, line_changed, d);
  pin_listen(c, d->scl_pin, line_changed, d);
  return d;
}

uint8_t* bench_i2c_registers(i2c_device* d) {
  return d->registers;
}

void bench_i2c_present(i2c_device* d, bool present) {
  d->present = present;
  if (!present) {
    pull(d, false);
    d->state = kIdle;
  }
}

uint32_t bench_i2c_fastest(const i2c_device* d) {
  return d->fastest;
}
