"""A flight through the real recorder: what it logged against what reached its pins."""

from __future__ import annotations

import subprocess
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from host.log import FlightLog, read_log
from host.readers.even_grid import even_columns
from host.sysid.maneuvers import detect_maneuvers
from host.twin.faults import FOREVER_S, Fault
from host.twin.flight.fly import FlightRecord, fly
from host.twin.outcome import compare, truth_files, virtual_calibration
from host.twin.recorder import sitl
from host.twin.recorder.fat32 import SECTOR, CardImageError, CardReader, format_card
from host.twin.recorder.stimuli import SAMPLE_STEP_TICKS, Stimuli, stimuli
from host.twin.sensors.bmp085 import compensate
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.sensors.mega_clock import TICKS_PER_S, clock_share
from host.twin.testcard import cards
from host.twin.virtual import virtual_flight
from numpy.typing import NDArray


@dataclass(frozen=True)
class Flown:
    """One recorded flight with everything about it."""

    record: FlightRecord
    data: AirData
    given: Stimuli
    recording: sitl.Recording
    log: FlightLog


@pytest.fixture(scope="module")
def flown(library: Path, tmp_path_factory: pytest.TempPathFactory) -> Flown:
    record = fly(cards.load("demo"), seed=11)
    data = air_data(record)
    given = stimuli(record, data)
    recording = sitl.record(given, rate_hz=100, aircraft=record.aircraft.name, seed=11)
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "flight.bin").write_bytes(recording.log)
    (folder / "calibration.toml").write_text(virtual_calibration.calibration(record.aircraft))
    log = read_log(folder / "flight.bin", calibration=folder / "calibration.toml")
    return Flown(record, data, given, recording, log)


def gaps(count: NDArray[np.uint16]) -> int:
    """Return how many frames are missing by their 16-bit counter."""
    steps = np.diff(count.astype(np.int64)).tolist()
    return sum((step - 1) % 65536 for step in steps)


def test_nothing_is_lost_and_the_log_is_whole(flown: Flown) -> None:
    assert flown.log.complete == "complete"
    ident = flown.log.frames["ident"]
    assert gaps(ident["count"]) == 0
    recorded_s = flown.given.duration / TICKS_PER_S - sitl.PRESS_S
    assert len(ident) == pytest.approx(recorded_s * 100.0, rel=0.01)
    assert flown.recording.lost_edges == 0


def test_truth_counts_from_the_logs_first_row(flown: Flown, tmp_path: Path) -> None:
    """Maneuvers of the truth file begin where those found in the log do."""
    table = flown.log.table()
    began_us = int(flown.log.frames["ident"]["t_us"][0])
    first_s = float(compare.true_times(flown.record, table, began_us)[0])
    truth_files.write(flown.record, flown.data, tmp_path / "flight", first_row_s=first_s)
    truth = tomllib.loads((tmp_path / "flight.truth.toml").read_text(encoding="utf-8"))
    columns, _ = even_columns(table)
    for found, true in zip(detect_maneuvers(columns), truth["maneuver"], strict=True):
        assert found.start_s == pytest.approx(true["start_s"], abs=0.15)
    with np.load(tmp_path / "flight.truth.npz") as series:
        assert series["t_s"][0] == truth["power_on_s"] == pytest.approx(-first_s)


def test_every_imu_sample_is_logged_bit_by_bit_with_its_age(flown: Flown) -> None:
    ident = flown.log.frames["ident"]
    start_us = np.array([p.start for p in flown.given.packets]) / 2.0
    seq = np.array([p.data[1] for p in flown.given.packets])
    sent_age = np.array([int.from_bytes(p.data[8:10], "little") for p in flown.given.packets])
    row = np.searchsorted(start_us, ident["t_us"] + 1.0) - 1
    names = ("p", "q", "r", "ax", "ay", "az", "phi", "theta", "psi")
    logged = np.column_stack([ident[name] for name in names])

    def agreement(shift: int) -> float:
        same = (logged == flown.given.imu.raw[row + shift]).all(axis=1)
        return float((same & (ident["imu_seq"] == seq[row + shift])).mean())

    assert agreement(0) == 1.0
    assert agreement(-1) < 0.05  # one sample off would be seen
    age_us = ident["imu_age"] * 4.0
    expected = sent_age[row] * 4.0 + (ident["t_us"] - start_us[row])
    assert np.abs(age_us - expected).max() <= 8.0


def test_analogue_channels_are_the_pins_at_their_instants(flown: Flown) -> None:
    ident = flown.log.frames["ident"]
    grid_us = np.arange(len(flown.given.analog)) * SAMPLE_STEP_TICKS / 2.0
    names = ("alpha_a", "alpha_b", "beta_a", "beta_b", "dp_a", "dp_b",
             "pot_elevator", "pot_aileron_left", "pot_aileron_right", "pot_rudder")  # fmt: skip

    def beyond(late_us: float, swap: bool = False) -> float:
        wrong = 0
        for slot, name in enumerate(names):
            source = slot ^ 1 if swap else slot
            total = np.zeros(len(ident))
            for turn in range(4):
                at = ident["t_us"] + late_us + 12.0 + (turn * 11 + slot) * 104.0
                total += np.floor(np.interp(at, grid_us, flown.given.analog[:, source]))
            # The scan starts within 100 us of t_us: what the channel moves meanwhile is allowed.
            slope = np.abs(np.gradient(flown.given.analog[:, source], SAMPLE_STEP_TICKS / 2.0))
            moved = np.interp(ident["t_us"].astype(float), grid_us, slope) * 100.0
            wrong += int((np.abs(ident[name] - total) > 4.0 * (1.0 + moved)).sum())
        return wrong / (len(names) * len(ident))

    assert beyond(0.0) < 0.001
    assert beyond(0.0, swap=True) > 0.2
    assert beyond(30_000.0) > 0.02


def test_receiver_pulses_are_logged_within_four_microseconds(flown: Flown) -> None:
    ident = flown.log.frames["ident"]
    edges = flown.given.edges
    rise, fall = edges[0::2], edges[1::2]
    for bit, name in enumerate(("aileron", "elevator", "rudder", "throttle", "switch")):
        mine = rise["levels"] == 1 << bit
        ended_us, width_us = fall["at"][mine] / 2.0, (fall["at"] - rise["at"])[mine] / 2.0
        # A pulse counts once the line was low for 300 us behind it; a frame is finished 5 ms late.
        newest = np.searchsorted(ended_us + 300.0, ident["t_us"]) - 1
        logged = ident[f"rc_{name}"] * 0.5
        error = [np.abs(logged - width_us[np.maximum(newest + k, 0)]) for k in (0, 1)]
        assert np.minimum(*error).max() <= 4.0, name


def test_barometer_and_gps_arrive_unchanged(flown: Flown) -> None:
    baro = flown.log.frames["baro"]
    t, p = compensate(
        baro["raw_temperature"].astype(np.int64),
        baro["raw_pressure"].astype(np.int64),
        int(flown.log.frames["baro_coefficients"]["oversampling"][0]),
    )
    # The log keeps sixteenths of a pascal and hundredths of a degree.
    assert np.abs(baro["static_pressure"] / 16.0 - p).max() <= 3.0
    assert np.abs(baro["temperature"] / 100.0 - t / 10.0).max() <= 0.11
    at = baro["t_us"] * 1e-6 / (1.0 + clock_share(flown.record))
    true = np.interp(at, flown.record.t_s, flown.data.static_pa)
    error = p - true - flown.record.draws.scalar("baro_offset_pa")
    assert error[at > 6.0].std() < 5.0
    gps = flown.log.frames["gps"]
    assert len(gps) == pytest.approx((flown.record.t_s[-1] - sitl.PRESS_S) * 5.0, abs=3)
    assert np.all(np.diff(gps["itow_ms"].astype(np.int64)) == 200)


def test_decoded_table_is_the_truth_within_the_sensors_errors(flown: Flown) -> None:
    table = flown.log.table()
    first = int(flown.log.frames["ident"]["t_us"][0])
    at = compare.true_times(flown.record, table, first)
    found = compare.deviations(flown.record, table, at)
    assert len(found) == len(compare.LIMITS)
    assert [d.column for d in found if not d.within] == []
    # Half a second of shift, or a turned sign, is not within them.
    late = compare.deviations(flown.record, table, at + 0.5)
    assert sum(not d.within for d in late) >= 6
    table["q_radps"] *= -1.0
    turned = compare.deviations(flown.record, table, at)
    assert [d.column for d in turned if not d.within] == ["q_radps"]


@pytest.mark.parametrize("column", compare.LIMITS)
def test_each_column_has_limits_that_bite(flown: Flown, column: str) -> None:
    table = flown.log.table()
    at = compare.true_times(flown.record, table, int(flown.log.frames["ident"]["t_us"][0]))
    mean_limit, spread_limit = compare.LIMITS[column]
    wave = np.sin(np.arange(len(table)))
    for fault in (2.0 * mean_limit, 2.0 * spread_limit * wave):
        wrong = table.assign(**{column: table[column] + fault})
        found = compare.deviations(flown.record, wrong, at)
        assert [d.column for d in found if not d.within] == [column]


def test_the_same_seed_gives_the_same_file(flown: Flown) -> None:
    again = sitl.record(flown.given, rate_hz=100, aircraft=flown.record.aircraft.name, seed=11)
    assert again.log == flown.recording.log


def test_faults_show_in_the_log_and_nowhere_else(library: Path, tmp_path: Path) -> None:
    card = cards.load("faults")
    record = fly(card, seed=2)
    given = stimuli(record, air_data(record))
    recording = sitl.record(given, rate_hz=100, aircraft="ultrastick25e", faults=card.faults)
    path = tmp_path / "flight.bin"
    path.write_bytes(recording.log)
    log = read_log(path)
    ident, system = log.frames["ident"], log.frames["system"]
    at = ident["t_us"] * 1e-6 / (1.0 + clock_share(record))

    def during(kind: str) -> np.ndarray:
        fault = next(f for f in card.faults if f.kind == kind)
        return (at > fault.at_s + 0.1) & (at < fault.at_s + min(fault.duration_s, 1e6) - 0.1)

    # Frames go on through everything, a card stall of 500 ms included.
    assert gaps(ident["count"]) == 0
    assert int(system["card_busy_max_ms"].max()) >= 450
    assert np.ptp(ident["alpha_a"][during("vane_stuck")]) <= 16
    assert ident["alpha_a"][during("vane_open")].min() >= 4088
    fresh = ident["valid"] >> 10 & 1
    assert fresh[during("imu_off")].max() == 0
    assert fresh[during("pitot_blocked")].min() == 1
    assert int(system["imu_bad_packets"][-1]) == pytest.approx(10, abs=8)
    lost = during("receiver_lost")
    assert ident["rc_elevator"][lost].max() == 0


def test_a_card_formatted_here_is_clean_to_an_independent_checker(tmp_path: Path) -> None:
    image = format_card()
    path = tmp_path / "partition.img"
    with path.open("wb") as out:
        out.write(image[2048 * SECTOR : 4 * 1024 * 1024])
        out.truncate(len(image) - 2048 * SECTOR)
    checked = subprocess.run(
        ["/usr/sbin/fsck.vfat", "-n", str(path)], capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stdout
    assert CardReader(image).files() == []


def test_what_is_no_card_is_refused() -> None:
    with pytest.raises(CardImageError, match="no FAT32 partition"):
        CardReader(bytes(4 * 1024 * 1024))
    with pytest.raises(CardImageError, match="expected 65525"):
        format_card(64 * 1024 * 1024)


@pytest.mark.parametrize("chain", ["sitl", "none", "true", "thesis"])
def test_a_study_gets_table_and_truth_on_one_clock(library: Path, chain: str) -> None:
    flight = virtual_flight("calm", 4, chain=chain)
    assert library.is_file()
    assert len(flight.maneuvers) == 4
    t, q = flight.table["t_s"].to_numpy(), flight.table["q_radps"].to_numpy()
    true_q = np.interp(t, flight.record.t_s, flight.record.states[:, 4])
    flying = (t > 7.0) & np.isfinite(q)  # the last row has no later IMU sample to align with
    # Rows of the thesis are 1 to 2 rows old and come 30 ms late.
    assert np.corrcoef(q[flying], true_q[flying])[0, 1] > (0.65 if chain == "thesis" else 0.99)


def test_an_unknown_chain_is_refused() -> None:
    with pytest.raises(ValueError, match="expected one of sitl"):
        virtual_flight("calm", 1, chain="avr")


@pytest.mark.parametrize("kind", ["card_removed", "power_cut", "baro_off"])
def test_what_was_on_the_card_before_a_fault_stays(
    library: Path, tmp_path: Path, kind: str
) -> None:
    card = cards.load("calm")
    broken = replace(card, faults=(Fault(kind, 15.0, 5.0 if kind == "baro_off" else FOREVER_S),))
    record = fly(broken, seed=3)
    recording = sitl.record(
        stimuli(record, air_data(record)), rate_hz=100, aircraft="x", faults=broken.faults
    )
    assert library.is_file()
    path = tmp_path / "flight.bin"
    path.write_bytes(recording.log)
    log = read_log(path)
    end_s = float(log.frames["ident"]["t_us"][-1]) * 1e-6
    if kind == "baro_off":
        assert end_s > 38.0
        at = log.frames["baro"]["t_us"] * 1e-6
        assert np.diff(at).max() == pytest.approx(5.0, abs=2.0)
    else:
        # At most a block (75 ms) and what waited in the ring are lost.
        assert 14.0 < end_s < 15.2
    assert gaps(log.frames["ident"]["count"]) == 0
