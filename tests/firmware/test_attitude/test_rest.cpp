// Rest at the very edge of each of its limits, axis by axis.
#include "check.h"
#include "core/imu/rest_detector.h"

namespace {

constexpr uint8_t kWindow = core::RestDetector::kWindow;

struct Still {
  core::RestDetector rest;
  int16_t rates[3] = {100, -200, 300};
  int16_t force[3] = {0, 0, -8192};
  bool at_rest = false;

  int16_t& value(uint8_t axis) { return axis < 3 ? rates[axis] : force[axis - 3]; }
  void add(uint8_t samples = kWindow) {
    for (; samples != 0; --samples) {
      rest.add(rates, force);
    }
  }
  // A window in which one sample of an axis differs.
  void add_odd(uint8_t axis, int16_t by) {
    add(77);
    value(axis) = static_cast<int16_t>(value(axis) + by);
    add(1);
    value(axis) = static_cast<int16_t>(value(axis) - by);
    add(kWindow - 78);
  }
};

// Whether two windows of these values are rest.
bool rests(const int16_t (&rates)[3], const int16_t (&force)[3]) {
  Still still;
  for (uint8_t i = 0; i < 3; ++i) {
    still.rates[i] = rates[i];
    still.force[i] = force[i];
  }
  still.add();
  CHECK(!still.rest.at_rest());
  still.add();
  return still.rest.at_rest();
}

}  // namespace

TEST_CASE("rest: two whole windows, and their means once each") {
  Still still;
  still.add(kWindow);
  still.add(kWindow - 1);
  CHECK(!still.rest.at_rest());
  CHECK(!still.rest.take_means());
  still.add(1);
  CHECK(still.rest.at_rest());
  CHECK(still.rest.take_means());
  CHECK(!still.rest.take_means());
  for (uint8_t axis = 0; axis < 3; ++axis) {
    CHECK_EQ(still.rest.mean_rate(axis), still.rates[axis]);
    CHECK_EQ(still.rest.mean_force(axis), still.force[axis]);
  }
  still.add(kWindow - 1);
  CHECK(!still.rest.take_means());
  still.add(1);
  CHECK(still.rest.take_means());
}

TEST_CASE("rest: from end to end 131 counts of rate, 500 of force, either way, each axis") {
  for (uint8_t axis = 0; axis < 6; ++axis) {
    const int16_t most = axis < 3 ? 131 : 500;
    for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
      Still still;
      still.add();
      still.add_odd(axis, static_cast<int16_t>(sign * most));
      CHECK(still.rest.at_rest());
      still.add_odd(axis, static_cast<int16_t>(sign * (most + 1)));
      CHECK(!still.rest.at_rest());
      // It takes two windows again, and the odd sample is in neither.
      still.add();
      CHECK(!still.rest.at_rest());
      still.add();
      CHECK(still.rest.at_rest());
      // What moves now is no rest now, and is again in a window without it.
      still.value(axis) = static_cast<int16_t>(still.value(axis) + sign * (most + 1));
      still.add(1);
      CHECK(still.rest.at_rest());  // it is all that this window has seen
      still.value(axis) = static_cast<int16_t>(still.value(axis) - sign * (most + 1));
      still.add(1);
      CHECK(!still.rest.at_rest());
    }
  }
}

TEST_CASE("rest: 25 deg/s of offset at most, each axis and way; the others may be less") {
  const int16_t level[3] = {0, 0, -8192};
  for (uint8_t axis = 0; axis < 3; ++axis) {
    for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
      int16_t rates[3] = {5, -5, 0};
      rates[axis] = static_cast<int16_t>(sign * 1638);
      CHECK(rests(rates, level));
      rates[axis] = static_cast<int16_t>(sign * 1639);
      CHECK(!rests(rates, level));
    }
  }
}

TEST_CASE("rest: a force within 0.15 g of 1 g, however it points") {
  const int16_t none[3] = {0, 0, 0};
  const int16_t kept[][3] = {{0, 0, -9421},
                             {0, 6963, 0},
                             {-6963, 0, 0},
                             {0, 0, 9421},
                             {4728, 4728, 4728},
                             {5438, -5438, 5438}};
  for (const auto& force : kept) {
    CHECK(rests(none, force));
  }
  const int16_t refused[][3] = {{0, 0, -9422},
                                {0, 6962, 0},
                                {-6962, 0, 0},
                                {0, 9422, 0},
                                {0, 0, 0},
                                {4019, 4019, 4019},
                                {5440, -5440, 5441},
                                {6000, 3478, 622}};
  // The last one is 6963 counts long but for one in its square.
  for (const auto& force : refused) {
    CHECK(!rests(none, force));
  }
}

TEST_CASE("rest: means may drift by a quarter of a degree a second, each axis and way") {
  for (uint8_t axis = 0; axis < 3; ++axis) {
    for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
      Still still;
      still.add();
      for (uint8_t window = 0; window < 5; ++window) {
        still.rates[axis] = static_cast<int16_t>(still.rates[axis] + sign * 16);
        still.add();
        CHECK(still.rest.at_rest());
      }
      still.rates[axis] = static_cast<int16_t>(still.rates[axis] + sign * 17);
      still.add();
      CHECK(!still.rest.at_rest());
      // The first window behind motion may have any mean.
      still.rates[axis] = static_cast<int16_t>(still.rates[axis] + sign * 50);
      still.add();
      CHECK(!still.rest.at_rest());
      still.add();
      CHECK(still.rest.at_rest());
    }
  }
}

TEST_CASE("rest: means are rounded, halves away from zero, and are those of the window before") {
  const struct {
    uint8_t ones;
    int16_t mean;
  } cases[] = {{0, 0}, {99, 0}, {100, 1}, {101, 1}, {200, 1}};
  for (const auto& one : cases) {
    for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
      Still still;
      for (int16_t& rate : still.rates) {
        rate = 0;
      }
      still.add(static_cast<uint8_t>(kWindow - one.ones));
      for (int16_t& rate : still.rates) {
        rate = sign;
      }
      still.force[2] = static_cast<int16_t>(-8192 + sign);
      still.add(one.ones);
      still.rates[0] = still.rates[1] = still.rates[2] = 7;
      still.add();
      for (uint8_t axis = 0; axis < 3; ++axis) {
        CHECK_EQ(still.rest.mean_rate(axis), sign * one.mean);
      }
      // Around -8192 the half rounds down.
      const int16_t force = static_cast<int16_t>(sign > 0 ? -8192 + (one.ones > 100 ? 1 : 0)
                                                          : -8192 - (one.ones >= 100 ? 1 : 0));
      CHECK_EQ(still.rest.mean_force(2), force);
      still.add();
      CHECK_EQ(still.rest.mean_rate(1), 7);
    }
  }
}
