"""The bench judges rightly what is known, and a short flight of the image keeps every limit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import stack_depth
from both_images import each_image_once
from devices.ardu_imu import ImuSample, SentSample
from flight.bench import pulses, signals
from flight.bench.fly import fly
from flight.bench.inputs import FRAMES_S, fly_input
from flight.bench.plan import CYCLES_PER_S, RECEIVERS, STALL_S, ramp, stalls, steps
from flight.bench.report import flight_rows, input_rows
from flight.bench.table import Table

ROW_S = 6.0  # no sine above 5 Hz
US = 16
FRAME = 20_000 * US


@pytest.mark.costs(20, "a row is flown by the image, instruction by instruction")
@pytest.mark.parametrize(
    ("flight_elf", "rate_hz", "first"),
    each_image_once([(100, 1), (200, 6)]),
    indirect=["flight_elf"],
)
def test_short_flight_keeps_every_limit(
    flight_elf: Path, tmp_path: Path, rate_hz: int, first: int
) -> None:
    table = Table()
    depth = stack_depth.analyse(flight_elf)
    flight = fly(
        flight_elf,
        rate_hz=rate_hz,
        minutes=0.15,
        folder=tmp_path,
        ground_s=12.0,
        receivers=RECEIVERS[first : first + 1],
    )
    flight_rows(table, flight, depth, stack_depth.room_bytes(flight_elf))
    assert table.missed == []
    assert len(flight.samples_sent) > 7 * rate_hz
    assert flight.stalls >= 2


@pytest.mark.parametrize(
    ("flight_elf", "rate_hz", "frame_s", "holds"),
    each_image_once(
        [(100, FRAMES_S[1], False), (200, FRAMES_S[0], False), (200, FRAMES_S[1], True)]
    ),
    indirect=["flight_elf"],
)
def test_row_that_teaches_or_holds_keeps_every_limit(
    flight_elf: Path, tmp_path: Path, rate_hz: int, frame_s: float, holds: bool
) -> None:
    table = Table()
    figures = fly_input(
        flight_elf, rate_hz=rate_hz, frame_s=frame_s, duration_s=ROW_S, folder=tmp_path,
        holds=holds,
    )  # fmt: skip
    input_rows(table, figures)
    assert table.missed == []
    assert len(figures.width_error_us) > 3 * 45 * ROW_S
    assert figures.stalls >= 1


def channel(seed: int, count: int = 200) -> tuple[np.ndarray, np.ndarray, int]:
    """Receiver pulses, what a perfect firmware accepts of them, the zero of its clock."""
    rng = np.random.default_rng(seed)
    start = 5_000_000_000 + np.arange(count) * FRAME
    width = rng.integers(1100 * US, 1900 * US, count)
    sent = np.column_stack((start, start + width))
    zero = 4_000_000
    accepted = np.column_stack((((start - zero) // 8) % (1 << 32), np.round(width / 8)))
    return sent, accepted.astype(np.int64), zero


def servo(sent: np.ndarray, *, delay_us: int = 8000) -> np.ndarray:
    """Servo pulses that repeat each receiver pulse a fixed time after its end."""
    start = np.arange(len(sent)) * FRAME + sent[0, 0] + FRAME // 10 + delay_us * US
    newest = np.searchsorted(sent[:, 1], start - 1000 * US) - 1
    ticks = np.round((sent[newest, 1] - sent[newest, 0]) / 8).astype(np.int64)
    keep = newest >= 0
    made: np.ndarray = np.column_stack((start, start + ticks * 8))[keep]
    return made


def test_perfect_pulses_have_no_error() -> None:
    sent, accepted, zero = channel(1)
    measured = pulses.match_measured(sent, accepted, zero)
    assert np.all(np.abs(measured.error_us) <= 0.25)
    seen = pulses.judge_output(servo(sent), measured)
    assert seen.strange == 0
    assert seen.width_error_us.max() == 0
    assert 0 < seen.delay_ms.min() < seen.delay_ms.max() < 22


def test_a_wrong_measurement_shows() -> None:
    sent, accepted, zero = channel(2)
    accepted[50, 1] += 12  # 6 us
    accepted = np.delete(accepted, 70, axis=0)
    measured = pulses.match_measured(sent, accepted, zero)
    assert np.abs(measured.error_us).max() == pytest.approx(6, abs=0.3)
    assert np.flatnonzero(measured.width_ticks == 0).tolist() == [70]
    accepted[60, 0] += 4000  # a rise where none was
    with pytest.raises(ValueError, match="1 pulses nobody sent"):
        pulses.match_measured(sent, accepted, zero)


def test_a_servo_pulse_of_nobody_and_an_old_one_show() -> None:
    sent, accepted, zero = channel(3)
    measured = pulses.match_measured(sent, accepted, zero)
    good = servo(sent)
    strange = good.copy()
    strange[40, 1] += 2 * US
    assert pulses.judge_output(strange, measured).strange == 1
    old = good.copy()
    old[60, 1] = old[60, 0] + (good[53, 1] - good[53, 0])  # 140 ms ago
    assert pulses.judge_output(old, measured).strange == 1


def test_a_late_servo_pulse_shows() -> None:
    sent, accepted, zero = channel(4)
    measured = pulses.match_measured(sent, accepted, zero)
    good = servo(sent)
    late = good.copy()
    late[80, 1] = late[80, 0] + (good[79, 1] - good[79, 0])  # repeats the last one once more
    worst = pulses.judge_output(good, measured).delay_ms.max()
    assert pulses.judge_output(late, measured).delay_ms.max() > worst + 10


SAMPLE = np.dtype([("imu_seq", "u1"), *((name, "<i2") for name in signals.CHANNELS)])


def samples(count: int) -> tuple[list[SentSample], np.ndarray]:
    """Samples as sent and as a perfect log holds them."""
    sent, rows = [], np.zeros(count, SAMPLE)
    for n in range(count):
        values = [n + k for k in range(9)]
        sample = ImuSample((n, n + 1, n + 2), (n + 3, n + 4, n + 5), (n + 6, n + 7, n + 8))
        sent.append(SentSample(n & 0xFF, n * 160_000, sample, (n,), False))
        rows[n] = (n & 0xFF, *values)
    return sent, rows


def test_a_lost_a_doubled_and_a_changed_sample_show() -> None:
    sent, rows = samples(400)
    assert signals.find_samples(rows, sent, 1 << 40) == signals.Samples(400, 0, 0, 0)
    assert signals.find_samples(np.delete(rows, 9), sent, 1 << 40).missing == 1
    twice = np.insert(rows, 9, rows[9])
    assert signals.find_samples(twice, sent, 1 << 40).repeated == 1
    changed = rows.copy()
    changed["az"][30] += 1
    found = signals.find_samples(changed, sent, 1 << 40)
    assert (found.missing, found.strange) == (1, 1)
    # what may still have been in the ring does not count
    assert signals.find_samples(rows[:390], sent, 390 * 160_000).missing == 0


@pytest.mark.parametrize("late_us", [0.0, 150.0])
def test_a_ramp_tells_how_late_the_samples_are(late_us: float) -> None:
    profile = ramp(0, 5 * CYCLES_PER_S, 2)
    at = np.arange(CYCLES_PER_S, 4 * CYCLES_PER_S, 160_123).astype(np.float64)
    counts = np.floor(profile.counts(at - late_us * US))
    error_us = signals.ramp_errors_us(counts, at, profile)
    assert len(error_us) > 200
    assert np.median(np.abs(error_us)) == pytest.approx(late_us, abs=15)


def test_a_step_shows_a_count_too_many() -> None:
    profile = steps(0, 60 * CYCLES_PER_S, np.random.default_rng(5))
    at = np.arange(2 * CYCLES_PER_S, 58 * CYCLES_PER_S, 160_123).astype(np.float64)
    counts = np.floor(profile.counts(at))
    assert np.abs(signals.step_errors(counts, at, profile)).max() <= 0.5
    assert np.abs(signals.step_errors(counts + 2, at, profile)).max() > 1


@pytest.mark.parametrize("rate_hz", [100, 200])
def test_stalls_come_every_3_s_at_any_phase(rate_hz: int) -> None:
    begin = 20 * CYCLES_PER_S
    planned = stalls(rate_hz, begin, begin + 600 * CYCLES_PER_S, np.random.default_rng(7))
    at = np.array([stall.cycle - begin for stall in planned]) / CYCLES_PER_S
    assert (at // 3).astype(int).tolist() == list(range(200))
    assert np.diff(at).min() > STALL_S[rate_hz] + 0.2
    room_s = 3 - STALL_S[rate_hz] - 0.2
    shares = np.histogram(at % 3, bins=5, range=(0, room_s))[0]
    assert shares.sum() == 200
    assert shares.min() > 20
    assert sum(stall.reject for stall in planned) == 10
