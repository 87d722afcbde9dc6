"""What the logger learned while it flew the rows itself: its log against the truth.

Virtual flights in which the recorder's own program triggers and flies multisines of pitch, roll
and yaw and learns from them, every tolerance drawn, in gusts of 0.3 m/s. The last answer of each
row is held against the derivatives of the aircraft as flown.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from host.aircraft.linear_aircraft import load as load_aircraft
from host.arrays import Array
from host.log import read_log
from host.physical.calibration import calibration_of_text
from host.planning.flight_envelope import Envelope
from host.planning.learning_card import NAMES, learned_axes
from host.planning.logger_card import logger_card
from host.planning.onboard_sums import AxisCard
from host.twin.flight.fly import FlightRecord
from host.twin.outcome import truth_files
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.logger_flight import logger_flight
from host.twin.recorder.stimuli import Stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import Card, Segment, Tone, load
from host.wire.schema_text import packed_schema
from numpy.typing import NDArray

from studies.stored_rows import flown_rows, seeded_run

FIRST_SEED, FLIGHTS = 31_100, 20
AIRCRAFT = "ultrastick25e"
ROW_S = 15.0
SHARE = 0.3  # of the amplitude, each of ten tones with Schroeder's phases
COLUMNS = ("seed", "row", "name", "samples", "true", "estimate", "half_width", "enough")


def multisine(axis: str, amplitude_deg: float, first: int, step: int) -> Segment:
    """Return a row of ten tones, each `step` / 15 Hz above the one before."""
    tones = tuple(
        Tone(axis, first + step * k, SHARE, (-0.5 * k * (k + 1) / 10.0) % 1.0) for k in range(10)
    )
    return Segment(
        "multisine", axes=(axis,), amplitudes=(amplitude_deg,), duration_s=ROW_S, before_s=1.0,
        tones=tones,
    )  # fmt: skip


def card() -> Card:
    """Return the flight: each surface once."""
    rows = (
        multisine("elevator", 5.0, 5, 5),
        multisine("aileron", 4.0, 6, 6),
        multisine("rudder", 9.0, 5, 4),
        Segment("trim", duration_s=3.0),
    )
    demo = load("demo")
    return replace(demo, segments=rows, flight=replace(demo.flight, airspeed_mps=17.0))


def flown(seed: int) -> Iterator[dict[str, object]]:
    """Fly once; return a row for each derivative that a row of the card sent at its end."""
    plane, plan = load_aircraft(AIRCRAFT), card()
    lines = calibration_of_text(calibration(plane), Path("calibration.toml"))
    axes = learned_axes(AIRCRAFT, plan, lines)
    wide = Envelope(distance_m=0, alpha_deg=12.0, rates_degps=250.0)
    data = logger_card(plan, plane, lines, wide, axes)

    def recorder(record: FlightRecord, given: Stimuli) -> sitl.Recording:
        name = record.aircraft.name
        return sitl.record(given, rate_hz=100, aircraft=name, seed=seed, flight_card=data)

    record, _, recording = logger_flight(data, plan, seed=seed, recorder=recorder)
    windows = truth_files.maneuvers(record, air_data(record))
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "flight.bin"
        log.write_bytes(recording.log)
        learned = read_log(log).frames["learned"]
    for place, axis in enumerate(axes):
        yield from _of_row(seed, place, axis, learned, windows)


def _of_row(
    seed: int,
    place: int,
    axis: AxisCard,
    learned: NDArray[np.void],
    windows: Sequence[Mapping[str, object]],
) -> Iterator[dict[str, object]]:
    codes = packed_schema().enums["derivative"]
    moved = {"pitch": "elevator", "roll": "aileron", "yaw": "rudder"}[axis.axis]
    truth = next((w["derivatives"] for w in windows if w["axes"] == [moved]), None)
    of = learned[learned["row"] == place]
    for name in NAMES[axis.axis]:
        own = of[of["derivative"] == codes[name.lower()]]
        if len(own) and isinstance(truth, Mapping):
            last = own[-1]
            value = (
                seed, axis.axis, name, int(last["samples"]), truth[name],
                1e-6 * int(last["estimate"]), 1e-6 * int(last["half_width"]), int(last["enough"]),
            )  # fmt: skip
            yield dict(zip(COLUMNS, value, strict=True))


def lines_of(rows: Sequence[Mapping[str, str]]) -> list[str]:
    """Return the table."""

    def column(own: Sequence[Mapping[str, str]], name: str) -> Array:
        return np.array([float(row[name]) for row in own])

    lines = ["row    name       sent    error: mean    rms    half-width   enough   holds"]
    for key in dict.fromkeys((row["row"], row["name"]) for row in rows):
        own = [row for row in rows if (row["row"], row["name"]) == key]
        true, half = column(own, "true"), column(own, "half_width")
        error, size = column(own, "estimate") - true, 0.01 * abs(float(np.mean(true)))
        enough, held = column(own, "enough").sum(), np.sum(abs(error) <= half)
        lines.append(
            f"{key[0]:6s} {key[1]:9s} {len(own):4d}    {error.mean() / size:9.1f} %"
            f" {np.sqrt(np.mean(error**2)) / size:6.1f} % {np.median(half) / size:8.1f} %"
            f" {enough:7.0f}  {held:3d} of {len(own)}"
        )
    error = abs(column(rows, "estimate") - column(rows, "true"))
    inside = error <= column(rows, "half_width")
    share = 100.0 * inside.mean()
    return [*lines, f"{inside.sum()} of {len(inside)} intervals hold the truth ({share:.1f} %)"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly what is not in the file yet and print the table."""
    run = seeded_run(
        "learned_in_flight", __doc__, arguments, flights=FLIGHTS, first_seed=FIRST_SEED
    )
    rows = flown_rows(run.rows, COLUMNS, ((seed,) for seed in run.seeds), flown)
    return run.report(rows, lines_of)


if __name__ == "__main__":
    sys.exit(main())
