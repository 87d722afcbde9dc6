"""What the logger would say of an axis in flight: half-widths, the truth, double precision, live.

Virtual flights of one row an axis through the recorder, every tolerance drawn. Every second frame
of the log goes through the logger's arithmetic (`onboard_sums`, `onboard_equation_error`), in
integers and single floats and in double precision. A solve begins each second. One row a flight,
axis, instant and derivative goes to a file that a later run continues.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from host.arrays import Array
from host.live.estimates.flight_estimate import FlightEstimator
from host.log import read_log
from host.physical.calibration import load_calibration
from host.planning.learning_card import (
    NAMES,
    SIX_HARMONICS,
    TEN_HARMONICS,
    LearningCondition,
    learning_card,
)
from host.planning.onboard_sums import (
    PITCH,
    ROLL,
    SAMPLE_HZ,
    SIGNALS,
    YAW,
    AxisCard,
    FourierSums,
)
from host.sysid.flight import FlightColumns, read_flight_columns
from host.twin.flight.fly import fly
from host.twin.outcome import compare, truth_files
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import Card, Segment, load
from numpy.typing import NDArray

from studies.onboard_equation_error import EquationError, Learned
from studies.stored_rows import flown_rows, seeded_run

FIRST_SEED = 22_006  # 22000-22005 were looked at
AIRCRAFT, RATE_HZ = "ultrastick25e", 100
AIRSPEED_MPS, DENSITY_KGPM3 = 17.0, 1.213
BEFORE_S, BEHIND_S, LIVE_BEHIND_S = 0.5, 2.0, 3.0
AFTER_S = (5.0, 10.0, 99.0)  # and at the end
SLICES_PER_SAMPLE = 12
COLUMNS = (
    "seed", "row", "after_s", "name", "true", "estimate", "half_width", "exact", "exact_half_width",
    "live", "live_half_width",
)  # fmt: skip
# Axis, test point of the card, harmonics, expected rms of the angle's rate (rad/s).
ROWS: Mapping[str, tuple[str, int, tuple[int, ...], float]] = {
    "pitch, multisine": (PITCH, 0, TEN_HARMONICS, 0.20),
    "pitch, 3-2-1-1": (PITCH, 2, TEN_HARMONICS, 0.24),
    "roll, multisine": (ROLL, 1, SIX_HARMONICS, 0.28),
    "yaw, multisine": (YAW, 1, SIX_HARMONICS, 0.28),
}


def card() -> Card:
    """Return the flight: a row for pitch, one for roll and yaw, and a short one for pitch."""
    rows = (
        Segment("trim", duration_s=4.0),
        Segment(
            "multisine", axes=("elevator",), amplitudes=(3.0,), duration_s=20.0, low_hz=0.2,
            high_hz=3.5,
        ),
        Segment(
            "multisine", axes=("aileron", "rudder"), amplitudes=(3.0, 4.5), duration_s=20.0,
            low_hz=0.2, high_hz=3.0,
        ),
        Segment("3211", axes=("elevator",), amplitudes=(3.0,), width_s=0.25),
        Segment("trim", duration_s=4.0),
    )  # fmt: skip
    return replace(load("demo"), segments=rows)


@dataclass(frozen=True, slots=True)
class Flown:
    """A flight: log, calibration of its instrument, true maneuvers and times of the rows."""

    log: bytes
    calibration: str
    maneuvers: Sequence[Mapping[str, Any]]
    t_s: Array


def flown(seed: int) -> Flown:
    """Fly the card through the recorder."""
    record = fly(card(), seed=seed)
    data = air_data(record)
    recording = sitl.record(
        stimuli(record, data), rate_hz=RATE_HZ, aircraft=record.aircraft.name, faults=(), seed=seed
    )
    text = calibration(record.aircraft, record.draws.errors)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "flight.bin"
        log.write_bytes(recording.log)
        decoded = read_log(log)
        first_us = int(decoded.frames["ident"]["t_us"][0])
        t_s = compare.true_times(record, decoded.table(), first_us)
    return Flown(recording.log, text, truth_files.maneuvers(record, data), np.asarray(t_s))


@dataclass(frozen=True, slots=True)
class LearningRow:
    """What the logger is given of one row: its card, and raw counts at 50 Hz."""

    name: str
    card: AxisCard
    samples: NDArray[np.int64]
    end_s: float


def learning_rows(flight: Flown) -> Iterator[LearningRow]:
    """Return the rows of a flight, from its log."""
    with tempfile.TemporaryDirectory() as folder:
        log, text = _files(flight, Path(folder))
        frames, lines = read_log(log, calibration=text).frames["ident"], load_calibration(text)
        for name, (axis, point, harmonics, rate) in ROWS.items():
            of = flight.maneuvers[point]
            end_s = float(of["input_end_s"]) + (BEHIND_S if of["kind"] == "3211" else 0.0)
            begin_s = float(of["start_s"]) - BEFORE_S
            inside = (flight.t_s >= begin_s) & (flight.t_s < end_s)
            at = LearningCondition(AIRSPEED_MPS, DENSITY_KGPM3, harmonics, rate)
            samples = _signals(frames, axis)[inside][:: RATE_HZ // SAMPLE_HZ]
            yield LearningRow(name, learning_card(AIRCRAFT, axis, at, lines), samples, end_s)


def rows_of(flight: Flown, seed: int) -> Iterator[dict[str, object]]:
    """Learn every row of a flight, and ask the live estimator after each."""
    with tempfile.TemporaryDirectory() as folder:
        log, text = _files(flight, Path(folder))
        live = FlightEstimator(AIRCRAFT, text)
        read = read_flight_columns(read_log(log, calibration=text))
        for row in learning_rows(flight):
            truth = flight.maneuvers[ROWS[row.name][1]]["derivatives"]
            ours, exact = (learned(row.card, row.samples, double=d) for d in (False, True))
            known = int(np.searchsorted(flight.t_s, row.end_s + LIVE_BEHIND_S))
            ground = live.of(_until(read, known)).values
            for after_s in AFTER_S:
                one, other = (_last(found, after_s) for found in (ours, exact))
                if one is None or other is None or (after_s < 99.0 and len(ours) <= after_s):
                    continue
                for k, name in enumerate(NAMES[row.card.axis]):
                    value = (
                        seed, row.name, after_s, name, truth[name], one.estimate[k],
                        one.half_width[k], other.estimate[k], other.half_width[k],
                        *ground.get(name, (np.nan, np.nan)),
                    )  # fmt: skip
                    yield dict(zip(COLUMNS, value, strict=True))


def _files(flight: Flown, folder: Path) -> tuple[Path, Path]:
    log, text = folder / "flight.bin", folder / "calibration.toml"
    log.write_bytes(flight.log)
    text.write_text(flight.calibration, encoding="utf-8")
    return log, text


def learned(card: AxisCard, samples: NDArray[np.int64], *, double: bool) -> dict[int, Learned]:
    """Return the answer of every solve that ended, by the second at which it began."""
    sums = FourierSums(card, exact=double)
    solver = EquationError(card, sums, double=double)
    found: dict[int, Learned] = {}
    work, began = None, 0
    for sample in samples:
        sums.take(sample)
        if work is None and sums.count >= 2 * SAMPLE_HZ and sums.count % SAMPLE_HZ == 0:
            work, began = solver.slices(), sums.count // SAMPLE_HZ
        for _ in range(SLICES_PER_SAMPLE if work else 0):
            if work is not None and next(work):
                work = None
                if solver.learned is not None:
                    found[began] = solver.learned
    return found


def _last(found: Mapping[int, Learned], after_s: float) -> Learned | None:
    at = [second for second in found if second <= after_s]
    return found[max(at)] if at else None


def _signals(frames: NDArray[Any], axis: str) -> NDArray[np.int64]:
    """Return the signals of an axis as the logger forms them from its frames."""

    def raw(name: str) -> NDArray[np.int64]:
        return np.asarray(frames[name], dtype=np.int64)

    made = {
        "alpha": raw("alpha_a") + raw("alpha_b"),
        "beta": raw("beta_a") + raw("beta_b"),
        "de": raw("pot_elevator"),
        "da": raw("pot_aileron_left") - raw("pot_aileron_right"),
        "dr": raw("pot_rudder"),
    } | {rate: raw(rate) for rate in "pqr"}
    return np.stack([made[name] for name in SIGNALS[axis]], axis=1)


def _until(read: FlightColumns, rows: int) -> FlightColumns:
    return replace(read, columns={name: v[:rows] for name, v in read.columns.items()})


def table(rows: Sequence[Mapping[str, str]]) -> list[str]:
    """Return how often the truth is held, and what the arithmetic costs, row by row."""
    lines = [
        "row               after s  name      error: mean   rms    half-width   holds   "
        "from double: half-widths, width %   live: error rms, half-width"
    ]
    for key in dict.fromkeys((r["row"], r["after_s"], r["name"]) for r in rows):
        own = [r for r in rows if (r["row"], r["after_s"], r["name"]) == key]
        lines.append(_line(key, own))
    for after_s in dict.fromkeys(r["after_s"] for r in rows):
        own = [r for r in rows if r["after_s"] == after_s]
        held = _holds(own, "estimate", "half_width")
        apart, wider = _from_double(own)
        lines.append(
            f"after {after_s} s: {held.sum()} of {len(held)} intervals hold the truth"
            f" ({100.0 * held.mean():.1f} %); from double precision {apart.max():.4f} half-widths"
            f" and {100.0 * wider.max():.2f} % of a half-width at most"
        )
    ends = [r for r in rows if r["after_s"] == str(AFTER_S[-1]) and np.isfinite(float(r["live"]))]
    live = _holds(ends, "live", "live_half_width")
    if len(live):
        lines.append(f"live: {live.sum()} of {len(live)} ({100.0 * live.mean():.1f} %)")
    return lines


def _line(key: tuple[str, str, str], rows: Sequence[Mapping[str, str]]) -> str:
    true, value, half, live, live_half = (
        _column(rows, name)
        for name in ("true", "estimate", "half_width", "live", "live_half_width")
    )
    size = 0.01 * abs(float(np.mean(true)))
    error, live_error = (value - true) / size, (live - true) / size
    apart, wider = _from_double(rows)
    return (
        f"{key[0]:17s} {float(key[1]):6.0f}   {key[2]:9s} {np.mean(error):8.1f} %"
        f" {_rms(error):6.1f} % {np.median(half / size):8.1f} %"
        f"   {_holds(rows, 'estimate', 'half_width').sum():3d}/{len(rows)}"
        f"   {apart.max():.4f}  {100.0 * wider.max():5.2f}"
        f"   {_rms(live_error[np.isfinite(live)]):6.1f} %"
        f" {np.nanmedian(live_half / size) if np.isfinite(live).any() else np.nan:6.1f} %"
    )


def _column(rows: Sequence[Mapping[str, str]], name: str) -> Array:
    return np.array([float(r[name]) for r in rows])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def _holds(rows: Sequence[Mapping[str, str]], value: str, half: str) -> NDArray[np.bool_]:
    found = np.abs(_column(rows, value) - _column(rows, "true")) <= _column(rows, half)
    return np.asarray(found)


def _from_double(rows: Sequence[Mapping[str, str]]) -> tuple[Array, Array]:
    exact, width = _column(rows, "exact"), _column(rows, "exact_half_width")
    apart = np.abs(_column(rows, "estimate") - exact) / width
    return apart, np.abs(_column(rows, "half_width") / width - 1.0)


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    run = seeded_run("onboard_learning", __doc__, arguments, flights=20, first_seed=FIRST_SEED)
    rows = flown_rows(
        run.rows,
        COLUMNS,
        [(seed,) for seed in run.seeds],
        lambda seed: list(rows_of(flown(seed), seed)),
    )
    return run.report(rows, table)


if __name__ == "__main__":
    sys.exit(main())
