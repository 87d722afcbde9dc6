"""The same flight recorded by the firmware on this computer and by its image in the chip
simulator."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from host.log import FlightLog, read_log
from host.twin.flight.fly import fly
from host.twin.recorder import avr, sitl
from host.twin.recorder.stimuli import SAMPLE_STEP_TICKS, Stimuli, stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard import cards
from numpy.typing import NDArray

CARD = {
    "format": 1,
    "aircraft": "ultrastick25e",
    "flight": {"ground_s": 4.5},
    "air": {"turbulence_mps": 0.3},
    "segment": [
        {
            "kind": "doublet", "axis": ["elevator", "aileron", "rudder"],
            "amplitude": [3.0, 3.0, 5.0], "width_s": 0.4, "before_s": 0.5,
        }
    ],
}  # fmt: skip
DIGITAL = ("imu_seq", "p", "q", "r", "ax", "ay", "az", "phi", "theta", "psi")
ANALOGUE = ("alpha_a", "alpha_b", "beta_a", "beta_b", "dp_a", "dp_b",
            "pot_elevator", "pot_aileron_left", "pot_aileron_right", "pot_rudder")  # fmt: skip
Ident = NDArray[np.void]


@pytest.fixture(scope="module")
def given() -> Stimuli:
    record = fly(cards.parse(CARD, "short"), seed=5)
    return stimuli(record, air_data(record))


@pytest.fixture(scope="module")
def logs(
    library: Path, image: Path, given: Stimuli, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, FlightLog]:
    assert library.is_file()
    assert image == avr.ELF
    folder = tmp_path_factory.mktemp("chip")
    found = {}
    for name, recorder in (("sitl", sitl.record), ("avr", avr.record)):
        recording = recorder(given, rate_hz=100, aircraft="ultrastick25e", seed=5)
        (folder / f"{name}.bin").write_bytes(recording.log)
        found[name] = read_log(folder / f"{name}.bin")
    return found


@pytest.fixture(scope="module")
def pair(logs: dict[str, FlightLog]) -> tuple[Ident, Ident]:
    return in_step(logs["sitl"].frames["ident"], logs["avr"].frames["ident"])


def in_step(one: Ident, two: Ident) -> tuple[Ident, Ident]:
    """Identification frames of two recorders, from the first IMU sample both have."""
    first = max(int(one["t_us"][0]), int(two["t_us"][0])) + 20_000
    one = one[one["t_us"] > first]
    shift = int(np.flatnonzero(two["imu_seq"] == one["imu_seq"][0])[0])
    two = two[shift:]
    count = min(len(one), len(two)) - 2
    return one[:count], two[:count]


def instants_us(ident: Ident) -> NDArray[np.float64]:
    """When each IMU sample was taken, by the recorder's own clock and age."""
    return np.asarray(ident["t_us"] - 4.0 * ident["imu_age"])


@pytest.mark.costs(25, "the image flies ten seconds, instruction by instruction, for all below")
def test_both_logs_are_whole_and_hold_the_same_samples_in_the_same_order(
    logs: dict[str, FlightLog], pair: tuple[Ident, Ident]
) -> None:
    assert {log.complete for log in logs.values()} == {"complete"}
    one, two = pair
    assert len(one) > 300
    for name in DIGITAL:
        assert np.array_equal(one[name], two[name]), name
    assert not np.array_equal(one["q"][1:], two["q"][:-1])


def clock_offset_us(pair: tuple[Ident, Ident]) -> float:
    """What the clock of the first shows more than that of the second, from the START of packets."""
    return float(np.median(instants_us(pair[0]) - instants_us(pair[1])))


def worst_time_us(pair: tuple[Ident, Ident]) -> float:
    """Largest difference between the times of a frame in both logs, by one clock."""
    apart = pair[0]["t_us"].astype(np.int64) - pair[1]["t_us"].astype(np.int64)
    return float(np.abs(apart - clock_offset_us(pair)).max())


def test_frames_are_dated_alike_within_100_us(pair: tuple[Ident, Ident]) -> None:
    # The Mega's clock starts with its program, a few ms behind that of the library: one constant.
    assert 0.0 < clock_offset_us(pair) < 10_000.0
    off = instants_us(pair[0]) - instants_us(pair[1])
    assert np.abs(off - clock_offset_us(pair)).max() < 100.0
    assert worst_time_us(pair) < 100.0
    swapped = instants_us(pair[0])[1:] - instants_us(pair[1])[:-1]
    assert np.abs(swapped - clock_offset_us(pair)).max() > 100.0


def test_a_scan_200_us_late_is_seen(
    given: Stimuli, logs: dict[str, FlightLog], tmp_path: Path
) -> None:
    # Packets whose STOP comes 200 us later start their scans so much later.
    slow = [dataclasses.replace(p, end=p.end + 400) for p in given.packets]
    recording = sitl.record(
        dataclasses.replace(given, packets=slow), rate_hz=100, aircraft="ultrastick25e", seed=5
    )
    (tmp_path / "slow.bin").write_bytes(recording.log)
    late = in_step(read_log(tmp_path / "slow.bin").frames["ident"], logs["avr"].frames["ident"])
    assert worst_time_us(late) > 100.0


def test_analogue_channels_are_the_pins_within_a_count(
    given: Stimuli, pair: tuple[Ident, Ident]
) -> None:
    start = clock_offset_us(pair)
    grid_us = np.arange(len(given.analog)) * SAMPLE_STEP_TICKS / 2.0

    def beyond(ident: Ident, offset_us: float) -> float:
        wrong = 0
        for slot, name in enumerate(ANALOGUE):
            total = np.zeros(len(ident))
            for turn in range(4):
                at = ident["t_us"] + offset_us + 12.0 + (turn * 11 + slot) * 104.0
                total += np.floor(np.interp(at, grid_us, given.analog[:, slot]))
            slope = np.abs(np.gradient(given.analog[:, slot], SAMPLE_STEP_TICKS / 2.0))
            moved = np.interp(ident["t_us"] + offset_us, grid_us, slope) * 100.0
            wrong += int((np.abs(ident[name] - total) > 4.0 * (1.0 + moved)).sum())
        return wrong / (len(ANALOGUE) * len(ident))

    assert beyond(pair[0], 0.0) == 0.0
    assert beyond(pair[1], start) == 0.0
    # Log against log: one count of a sum of four, without any allowance for slope.
    one, two = (np.column_stack([ident[name].astype(int) for name in ANALOGUE]) for ident in pair)
    assert np.abs(one - two).max() <= 4
    assert np.abs(one[1:] - two[:-1]).max() > 4
    assert beyond(pair[1], start + 30_000.0) > 0.05


def test_receiver_pulses_agree_within_four_microseconds(
    given: Stimuli, pair: tuple[Ident, Ident]
) -> None:
    start = clock_offset_us(pair)
    rise, fall = given.edges[0::2], given.edges[1::2]

    def worst(ident: Ident, offset_us: float, stretch: float = 1.0) -> float:
        largest = 0.0
        for bit, name in enumerate(("aileron", "elevator", "rudder", "throttle", "switch")):
            mine = rise["levels"] == 1 << bit
            ended = fall["at"][mine] / 2.0
            width = (fall["at"] - rise["at"])[mine] / 2.0 * stretch
            newest = np.searchsorted(ended + 300.0, ident["t_us"] + offset_us) - 1
            error = [
                np.abs(ident[f"rc_{name}"] * 0.5 - width[np.clip(newest + k, 0, len(width) - 1)])
                for k in (-1, 0, 1)
            ]
            largest = max(largest, float(np.min(error, axis=0).max()))
        return largest

    assert worst(pair[0], 0.0) <= 4.0
    assert worst(pair[1], start) <= 4.0
    assert worst(pair[1], start, stretch=1.01) > 4.0


def test_gps_and_magnetometer_agree_to_the_digit(logs: dict[str, FlightLog]) -> None:
    one, two = (logs[name].frames["gps"] for name in ("sitl", "avr"))
    both = np.intersect1d(one["itow_ms"], two["itow_ms"])
    assert len(both) > 10
    for name in ("latitude", "longitude", "height", "v_north", "v_down", "fix", "satellites"):
        left = one[name][np.isin(one["itow_ms"], both)]
        assert np.array_equal(left, two[name][np.isin(two["itow_ms"], both)]), name
