"""Share of killed mutants of every formula and limit: ``make mutants``.

    make mutants                          all files; stopped, it goes on where it was
    make mutants MUTANTS="rc_decoder"     some; --survivors names what was not killed

Exit codes: 0, 1 where nothing could be judged, 2 for an unknown file, 6 if a share is below 95 %.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys

from tests.mutants.judge import (
    INVALID,
    KILLED,
    SAME,
    MutantError,
    judge_file,
    survivor_lines,
)

LEAST_SHARE = 0.95
# A file of firmware, and the suites that are its own.
FILES = {
    "core/airborne.cpp": ("test_airborne",),
    "core/baro.cpp": ("test_baro", "test_native_baro", "test_barometer"),
    "core/block.cpp": ("test_block",),
    "core/block_writer.cpp": ("test_block_writer",),
    "core/byte_budget.cpp": ("test_timing",),
    "core/byte_ring.cpp": ("test_byte_ring",),
    "core/crc.cpp": ("test_crc",),
    "core/drive.cpp": ("test_drive",),
    "core/envelope.cpp": ("test_envelope",),
    "core/every.h": ("test_timing",),
    "core/flight_card.cpp": ("test_flight_card",),
    "core/float32.cpp": ("test_imu_receiver",),
    "core/flying_proof.cpp": ("test_flying_proof",),
    "core/gps_receiver.cpp": ("test_gps",),
    "core/health.h": ("test_timing",),
    "core/ident_trigger.cpp": ("test_timing",),
    "core/imu_receiver.cpp": ("test_imu_receiver",),
    "core/input_command.cpp": ("test_input_command",),
    "core/input_watch.cpp": ("test_input_watch",),
    "core/rc_decoder.cpp": ("test_rc_decoder",),
    "core/recording.cpp": ("test_recording",),
    "core/relay_watch.h": ("test_drive",),
    "core/session_record.cpp": ("test_records",),
    "core/settings.cpp": ("test_records",),
    "core/stick_travel.cpp": ("test_input_watch",),
    "core/storm_guard.h": ("test_timing",),
    "core/supply.cpp": ("test_supply",),
    "core/test_input.cpp": ("test_test_input",),
    "core/ubx.cpp": ("test_gps",),
    "core/imu/answer.cpp": ("test_imu_schedule",),
    "core/imu/attitude.cpp": ("test_attitude",),
    "core/imu/console.cpp": ("test_imu_node",),
    "core/imu/fixed_point.cpp": ("test_attitude",),
    "core/imu/node.cpp": ("test_imu_node",),
    "core/imu/original_packets.cpp": ("test_imu_node",),
    "core/imu/packet_schedule.h": ("test_imu_schedule",),
    "core/imu/record.cpp": ("test_imu_node",),
    "core/imu/record_writer.h": ("test_imu_schedule",),
    "core/imu/rest_detector.cpp": ("test_attitude",),
    "core/imu/sensor_watch.h": ("test_imu_schedule",),
    "core/learning/axis_card.h": ("test_flight_card", "test_learning"),
    "core/learning/equation_error.cpp": ("test_learning",),
    "core/learning/fourier_sums.cpp": ("test_learning",),
    "core/learning/rotation.cpp": ("test_learning",),
    "drivers/barometer.h": ("test_barometer",),
    "drivers/bmp085.h": ("test_barometer",),
    "drivers/bmp280.h": ("test_barometer",),
    "drivers/hmc5883l.h": ("test_imu_chips",),
    "drivers/mpu6000.h": ("test_imu_chips",),
    "drivers/sd_card.h": ("test_sd_card",),
    "drivers/sd_wire.h": ("test_sd_card",),
    "drivers/soft_i2c.h": ("test_barometer",),
    "drivers/ublox.h": ("test_ublox",),
}
SHORT = {name.rsplit("/", 1)[1].split(".")[0]: name for name in FILES}


def _processor_s() -> float:
    """Processor time of compilers and suites so far: other work does not alter it."""
    of_children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return of_children.ru_utime + of_children.ru_stime


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="mutants", description=__doc__)
    parser.add_argument("names", nargs="*", help="files, without folder and suffix; none means all")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--most", type=int, help="judge a sample of so many of each file")
    parser.add_argument("--survivors", action="store_true", help="name what was not killed")
    asked = parser.parse_args(arguments)
    strange = set(asked.names) - set(SHORT)
    if strange:
        print(
            f"no file {', '.join(sorted(strange))}; there are {', '.join(SHORT)}", file=sys.stderr
        )
        return 2
    print(
        f"{'file':24}{'judged':>14}{'killed':>8}{'of':>6}{'share':>8}"
        f"{'same':>7}{'proved':>8}{'invalid':>9}{'CPU s':>8}"
    )
    below, broken = [], []
    for short in asked.names or SHORT:
        name = SHORT[short]
        start_s = _processor_s()
        try:
            result = judge_file(name, FILES[name], jobs=asked.jobs, most=asked.most)
        except MutantError as error:
            print(f"mutants: {error}", file=sys.stderr)
            broken.append(short)
            continue
        killed = result.count(KILLED)
        print(
            f"{short:24}{result.judged:>14}{killed:>8}{result.counted:>6}{result.share:>8.1%}"
            f"{result.count(SAME):>7}{result.proved:>8}{result.count(INVALID):>9}"
            f"{_processor_s() - start_s:>8.0f}",
            flush=True,
        )
        if asked.survivors:
            print("\n".join(survivor_lines(result)), flush=True)
        if result.share < LEAST_SHARE:
            below.append(short)
    if broken:
        print(f"not judged: {', '.join(broken)}")
        return 1
    if below:
        print(f"below {LEAST_SHARE:.0%}: {', '.join(below)}")
        return 6
    return 0


if __name__ == "__main__":
    sys.exit(main())
