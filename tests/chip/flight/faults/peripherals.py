"""Faults of the chip's own peripherals: conversions, bytes that never end; a bus that babbles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from flight.faults.card import removal_is_told, turns
from flight.faults.model import Fault, Seen, expect, valid_bit
from flight.faults.sensors import SLOTS, each_once, no_bad_sample
from flight.rig import FlightRig

REFERENCE = 0x1E  # multiplexer of the converter, behind which the supply is measured
EVERY_SETTING = tuple(range(64))
SPCR = 0x4C
BABBLE_S = 0.5
BABBLE_TURN_US = 4000
MEASURED_S = 2.5  # the supply, once in 128 frames, and sent once a second
PERIOD_US = 10_000  # of the identification frame


def supply_is_unknown(seen: Seen) -> Sequence[str]:
    """Not the last supply for ever; every frame stands, and the relay does not move."""
    rows = seen.system
    time_us = rows["t_us"].astype(np.int64)
    settled_us = round(MEASURED_S * 1e6)
    inside = (time_us > seen.begin // 16 + settled_us) & (time_us < seen.end // 16)
    late = rows["avcc_mv"][inside]
    back = rows["avcc_mv"][time_us > seen.end // 16 + settled_us]
    return [
        *turns(seen),
        *expect(len(late) and not np.any(late), f"supply reported: {late} mV"),
        *expect(len(back) and np.all(np.abs(back.astype(int) - 5000) < 60), f"later {back} mV"),
        *expect(not seen.events_of("drive_changed"), "the relay moved"),
    ]


def frames_without_analog(seen: Seen) -> Sequence[str]:
    """Every sample of the IMU stands in the log, its frame without one analogue value."""
    rows = seen.during()
    analog = sum(valid_bit(name) for name in SLOTS)
    step_us = np.diff(rows["t_us"].astype(np.int64))
    return [
        *turns(seen),
        *no_bad_sample(seen),
        *each_once(seen),
        *expect(not np.any(rows["valid"] & analog), "analogue values are marked valid"),
        *expect(not np.any(rows["alpha_a"]), "analogue values are given"),
        *expect(np.max(step_us) < 1.5 * PERIOD_US, f"{np.max(step_us)} us between two frames"),
        *expect(np.all(rows["valid"] & valid_bit("imu_fresh")), "a frame without a new sample"),
    ]


def babble(rig: FlightRig) -> None:
    """Put address after address on the IMU's bus, 30 us each, for half a second."""
    begin = rig.chip.cycle
    for packet in range(round(BABBLE_S * 1e6 / 30)):
        rig.chip.twi_send(43, b"", at_cycle=begin + packet * 480, scl_hz=400_000.0)


def babble_costs_itself(seen: Seen) -> Sequence[str]:
    """No sample is made up, and the main loop turns: no packet is shorter than these."""
    longest = int(seen.system["loop_max_us"].max())
    return [
        *no_bad_sample(seen),
        *each_once(seen),
        *expect(longest <= BABBLE_TURN_US, f"a turn of the main loop took {longest} us"),
    ]


PERIPHERALS = (
    Fault("11", "IMU bus babbles for 0.5 s", "loop goes on", babble,
          check=babble_costs_itself),
    Fault("4", "SPI switched off in its register", "reported in 1 s, resumes",
          lambda r: r.chip.poke(SPCR, b"\0"), events=("card_removed",), lossless=False,
          after_s=4.0, check=removal_is_told),
    Fault("19", "supply's conversion never ends", "unknown, the relay stays",
          lambda r: r.chip.analog_stick(REFERENCE), lambda r: r.chip.analog_stick(),
          check=supply_is_unknown, fault_s=5.0, after_s=5.0),
    Fault("19", "no conversion ever ends", "frames without analogue values",
          lambda r: r.chip.analog_stick(*EVERY_SETTING), lambda r: r.chip.analog_stick(),
          check=frames_without_analog),
)  # fmt: skip
