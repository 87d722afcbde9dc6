// The analogue supply: what a measurement says, with and without the chip's own reference.
#include "check.h"
#include "core/supply.h"
#include "random_numbers.h"

TEST_CASE("a healthy board passes whatever its reference, a starved one fails for sure") {
  // 4.75 V, the least a 5 V regulator may give, as chips of 1.0 to 1.2 V see it.
  for (uint16_t reference_mv = 1000; reference_mv <= 1200; ++reference_mv) {
    const uint16_t seen_mv = static_cast<uint16_t>(4750UL * 1100U / reference_mv);
    CHECK(core::supply_good(seen_mv, 0));
    CHECK(core::supply_good(seen_mv, reference_mv));
    const uint16_t starved_mv = static_cast<uint16_t>(4450UL * 1100U / reference_mv);
    CHECK(!core::supply_good(starved_mv, reference_mv));
  }
  CHECK(!core::supply_good(4124, 0));
  CHECK(core::supply_good(4126, 0));
  CHECK(!core::supply_good(0, 0));  // not measured yet
}

TEST_CASE("a supply no longer measured stays as it was, one measured too low does not") {
  core::SupplyWatch watch;
  CHECK(!watch.measured(0, 0));
  CHECK(watch.measured(5000, 0));
  CHECK(watch.measured(0, 1137));
  for (uint8_t i = 0; i < 3; ++i) {
    watch.measured(4100, 0);
  }
  CHECK(!watch.good());
  CHECK(!watch.measured(0, 0));
}

TEST_CASE("one or two odd conversions change nothing, wherever they fall; three do") {
  Random random(5);
  core::SupplyWatch watch;
  CHECK(watch.passes(5000, 0));
  uint8_t odd = 0;
  for (uint16_t i = 0; i < 5000; ++i) {
    const bool low = odd < 2 && random.below(2) == 0;
    odd = static_cast<uint8_t>(low ? odd + 1 : 0);
    CHECK(watch.measured(low ? random.below(4124) : uint16_t{4900}, 0));
  }
  watch.measured(5000, 0);
  CHECK(watch.measured(4100, 0));
  CHECK(watch.measured(4100, 0));
  CHECK(!watch.measured(4100, 0));
}

TEST_CASE("a calibrated measurement is the meter's within 10 mV") {
  for (uint16_t reference_mv = 1000; reference_mv <= 1200; reference_mv += 7) {
    const uint16_t seen_mv = static_cast<uint16_t>(5020UL * 1100U / reference_mv);
    const uint16_t told_mv = core::supply_mv(seen_mv, reference_mv);
    CHECK(told_mv <= 5020);
    CHECK(told_mv >= 5010);
    CHECK_EQ(core::supply_mv(seen_mv, 0), seen_mv);
  }
}

TEST_CASE("a record counts whole, and only for a reference that a chip may have") {
  uint8_t record[core::kReferenceRecordSize];
  core::write_reference(record, 1137);
  CHECK_EQ(core::read_reference(record), 1137);
  for (uint8_t byte = 0; byte < core::kReferenceRecordSize; ++byte) {
    for (uint8_t bit = 1; bit != 0; bit = static_cast<uint8_t>(bit << 1)) {
      record[byte] ^= bit;
      CHECK_EQ(core::read_reference(record), 0);
      record[byte] ^= bit;
    }
  }
  core::write_reference(record, 999);
  CHECK_EQ(core::read_reference(record), 0);
  core::write_reference(record, 1201);
  CHECK_EQ(core::read_reference(record), 0);
  const uint8_t erased[core::kReferenceRecordSize] = {0xFF, 0xFF, 0xFF, 0xFF};
  CHECK_EQ(core::read_reference(erased), 0);
}

TEST_CASE("what the boot found low no single measurement makes good, and a boot counts anew") {
  core::SupplyWatch watch;
  CHECK(!watch.passes(4100, 0));
  CHECK(!watch.measured(4100, 0));
  CHECK(!watch.good());
  CHECK(watch.passes(4125, 0));
  watch.measured(4124, 0);
  CHECK(watch.measured(4124, 0));
  CHECK(watch.passes(5000, 0));
  CHECK(watch.measured(4124, 0));
  CHECK(watch.measured(4124, 0));
  CHECK(!watch.measured(4124, 0));
  for (uint16_t i = 0; i < 600; ++i) {
    CHECK(!watch.measured(4124, 0));
  }
  CHECK(watch.measured(4125, 0));
  CHECK(watch.measured(4124, 0));
}

TEST_CASE("4.5 V to the millivolt, by the widest part where it is not calibrated") {
  CHECK(core::supply_good(4500, 1100));
  CHECK(!core::supply_good(4499, 1100));
  CHECK(core::supply_good(4950, 1000));
  CHECK(!core::supply_good(4949, 1000));
  CHECK(core::supply_good(4125, 0));
  CHECK(!core::supply_good(4124, 0));
  CHECK_EQ(core::supply_mv(5500, 1000), 5000);
  CHECK_EQ(core::supply_mv(5501, 1000), 5000);
  CHECK_EQ(core::supply_mv(60000, 1200), 65454);
  uint8_t record[core::kReferenceRecordSize];
  const uint16_t taken[] = {1000, 1200};
  for (const uint16_t reference_mv : taken) {
    core::write_reference(record, reference_mv);
    CHECK_EQ(core::read_reference(record), reference_mv);
  }
}
