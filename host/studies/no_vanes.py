"""Without vanes: angles against the air, derivatives against the truth and the same
flights' own logs with vanes.

Each flight of the card `demo` is flown once with all tolerances drawn, in calm air or in gusts. Its
own log has vanes; the log that a PX4 plane would have written has none. Before the launch it stands
at a pitch that an inclinometer gave to `INCLINOMETER_RAD`; angles are reconstructed without that
too. One row a number goes to a file that a later run continues.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from host.aircraft.file import load_measured, read_document
from host.arrays import Array
from host.compiled import prefer_machine_code
from host.constants import EVEN_SD
from host.errors import IdentificationError
from host.export.toml import dumps
from host.instrument.instrument_errors import (
    InstrumentErrors,
    instrument_errors,
    standard_errors,
)
from host.physical.recording import AUTOPILOT
from host.sysid.answer import CAREFUL, TRUSTED
from host.sysid.flight import ReconstructedFlight
from host.sysid.pipeline import Identification, ReadingOptions, aircraft_data, prepare, read_flight
from host.twin.flight.fly import FlightRecord, fly
from host.twin.outcome.autopilot_logs import write_autopilot_log
from host.twin.outcome.ideal import true_table
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.testcard.cards import load

import host
from studies.imported_logs import AIRCRAFT, AXIS, MODELS, own_log, truth
from studies.stored_rows import Row, flown_rows, seeded_run

FIRST_SEED = 440  # 400, 401 and 420-425 were looked at
WITH_VANES = 8  # flights of each cell whose own log is identified too
TURBULENCE_MPS = (0.0, 0.5)
SETTLED_S = 5.0  # behind the launch
STANDS_S = 1.0
INCLINOMETER_RAD = np.radians(0.25)  # one deviation: of the instrument and of the ground
ANGLES = {"alpha": 1, "beta": 2}  # and the axis that the IMU's tilt turns them about
OPEN = ", tilt open"  # behind an angle: nobody measured how the aircraft stands
# Columns of an angle: rms, mean and stated deviation of its error, tilt of the IMU, deg.
COLUMNS = (
    "seed", "turbulence_mps", "name", "true", "estimate", "half_width", "mark", "with_vanes",
    "rms_deg", "mean_deg", "stated_deg", "tilt_deg",
)  # fmt: skip


def rows_of(seed: int, turbulence_mps: float, *, with_own: bool = False) -> Iterator[Row]:
    """Fly, hide the vanes, reconstruct and identify; `with_own` identifies the own log too."""
    card = load("demo")
    card = replace(
        card,
        air=replace(card.air, turbulence_mps=turbulence_mps),
        sensors=replace(card.sensors, servo_tolerance=True),
    )
    record = fly(card, seed=seed, errors=of_an_autopilot())
    data = air_data(record)
    key: dict[str, object] = {"seed": seed, "turbulence_mps": turbulence_mps}
    with tempfile.TemporaryDirectory() as folder:
        stem = Path(folder) / "flight"
        path = write_autopilot_log("ulog", record, data, stem, airframe="conventional")
        standing = stem.with_suffix(".toml")
        standing.write_text(dumps(_standing(record, data)), encoding="utf-8")
        try:
            found = host.identify(path, aircraft=standing, models=MODELS)
        except IdentificationError as error:
            yield {**key, "name": "refused", "mark": str(error)[:80]}
            return
        bare = prepare(read_flight(path, ReadingOptions(), aircraft_data(AIRCRAFT)))
        vanes = {}
        if with_own:
            # The same flight of our own instrument: an autopilot's errors are not ours.
            ours = fly(card, seed=seed)
            own, by = own_log(ours, air_data(ours), stem)
            answer = host.identify(own, aircraft=AIRCRAFT, models=MODELS, calibration=by)
            vanes = _half_widths(answer)
    for flight, kind in ((found.flights[0], ""), (bare.flight, OPEN)):
        yield from ({**key, **row} for row in _angles(record, data, flight, kind))
    yield from ({**key, **row} for row in _coefficient_rows(truth(record, data), found, vanes))


def of_an_autopilot() -> InstrumentErrors:
    """Return what its sensors are drawn from: what identification allows for, but for two.

    The servos' delay stays within a receiver's frame, and gyros are zeroed at start-up: what an
    autopilot's own estimator has learned of them by the launch the twin's would not know.
    """
    errors = instrument_errors(load_measured(AIRCRAFT), maker=AUTOPILOT)
    ours = {name: standard_errors()[name] for name in ("servo_delay_s", "gyro_bias_radps")}
    return InstrumentErrors({**errors.named, **ours})


def _standing(record: FlightRecord, data: AirData) -> dict[str, object]:
    """Return the aircraft file with the pitch at which it stands, as it was measured."""
    true, document = true_table(record, data), dict(read_document(AIRCRAFT))
    pitch = float(np.interp(STANDS_S, true["t_s"], true["theta_rad"]))
    off = float(np.random.default_rng([record.seed, 21]).normal(0.0, INCLINOMETER_RAD))
    geometry = document["geometry"]
    assert isinstance(geometry, dict)
    geometry = {
        **geometry,
        "ground_pitch_rad": pitch + off,
        "ground_pitch_tolerance_rad": INCLINOMETER_RAD / EVEN_SD,
    }
    return {**document, "geometry": geometry}


def _angles(
    record: FlightRecord, data: AirData, flight: ReconstructedFlight, kind: str
) -> Iterator[Row]:
    if flight.angles is None:
        return
    true, t = true_table(record, data), flight.corrected["t_s"]
    begin = record.card.flight.ground_s + SETTLED_S
    aloft = (t > begin) & (t < float(true["t_s"].iloc[-1]) - 1.0)
    tilt = np.degrees(record.draws.vector("misalignment_rad"))
    for name, axis in ANGLES.items():
        angle = getattr(flight.angles, f"{name}_rad")
        error = np.degrees(angle - np.interp(t, true["t_s"], true[f"{name}_rad"]))[aloft]
        yield {
            "name": name + kind, "rms_deg": float(np.sqrt(np.mean(error**2))),
            "mean_deg": float(error.mean()),
            "stated_deg": float(np.degrees(getattr(flight.angles, f"{name}_sd_rad"))),
            "tilt_deg": float(tilt[axis]),
        }  # fmt: skip


def _coefficient_rows(
    true: dict[str, float], found: Identification, vanes: dict[str, float]
) -> Iterator[Row]:
    flat = found.table.reset_index().set_index("name")
    marks, value = flat["verdict"].to_dict(), flat["value"].to_dict()
    half = _half_widths(found)
    for name, expected in true.items():
        if name in half:
            yield {
                "name": name, "true": expected, "estimate": value[name], "half_width": half[name],
                "mark": marks[name], "with_vanes": vanes.get(name, ""),
            }  # fmt: skip


def _half_widths(found: Identification) -> dict[str, float]:
    flat = found.table.reset_index().set_index("name")
    return {str(name): float(half) for name, half in flat["half_width"].to_dict().items()}


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return the lines of both tables, and what all intervals of a cell come to."""
    lines = [
        "| gusts m/s | angle | median rms deg | worst | about its mean | less the IMU's tilt"
        " | stated sd |"
    ]
    cells = [[r for r in rows if float(r["turbulence_mps"]) == t] for t in TURBULENCE_MPS]
    every = [*ANGLES, *(name + OPEN for name in ANGLES)]
    for turbulence, (cell, name) in zip(
        np.repeat(TURBULENCE_MPS, len(every)), product(cells, every), strict=True
    ):
        if own := [r for r in cell if r["name"] == name]:
            numbers = " | ".join(f"{x:.2f}" for x in _angle_numbers(own))
            lines.append(f"| {turbulence:g} | {name} | {numbers} |")
    lines.append(
        "| gusts m/s | | held | width over vanes' | width % | over rms error | mean error %"
        " | not doubtful |"
    )
    for turbulence, cell in zip(TURBULENCE_MPS, cells, strict=True):
        held = total = sure = 0
        for name in AXIS:
            if not (own := [r for r in cell if r["name"] == name]):
                continue
            error, half, within = _errors(own)
            marked = [r["mark"] in (TRUSTED, CAREFUL) for r in own]
            both = [r for r in own if r["with_vanes"]]
            ratio = [float(r["half_width"]) / float(r["with_vanes"]) for r in both]
            rms = float(np.sqrt(np.mean(error**2)))
            lines.append(
                f"| {turbulence:g} | {name} | {int(within.sum())} of {len(own)}"
                f" | {np.median(ratio) if ratio else np.nan:.1f} | {np.median(half):.1f}"
                f" | {np.median(half) / rms:.1f} | {error.mean():+.1f} | {sum(marked)} |"
            )
            held, total, sure = held + int(within.sum()), total + len(own), sure + sum(marked)
        refused = sum(r["name"] == "refused" for r in cell)
        wide = sum(
            r["mark"] == TRUSTED and float(r["half_width"]) > 0.1 * abs(float(r["estimate"]))
            for r in cell
            if r["name"] in AXIS
        )
        if total:
            lines.append(
                f"{turbulence:g} m/s: {held} of {total} hold ({100.0 * held / total:.1f} %),"
                f" {sure} not doubtful ({100.0 * sure / total:.0f} %), {refused} flights refused,"
                f" {wide} under trust though the coefficient is wider than 10 %"
            )
    return lines


def _angle_numbers(own: Sequence[dict[str, str]]) -> tuple[float, ...]:
    rms, mean, stated, tilt = (
        np.array([float(r[f"{k}_deg"]) for r in own]) for k in ("rms", "mean", "stated", "tilt")
    )
    about = np.sqrt(np.maximum(rms**2 - mean**2, 0.0))
    # The tilt turns alpha and beta against the air by as much, of opposite sign laterally.
    level = np.sqrt(about**2 + np.minimum(np.abs(mean - tilt), np.abs(mean + tilt)) ** 2)
    return (
        float(np.median(rms)), float(rms.max()), float(np.median(about)),
        float(np.median(level)), float(np.median(stated)),
    )  # fmt: skip


def _errors(own: Sequence[dict[str, str]]) -> tuple[Array, Array, Array]:
    """Return errors and half-widths in percent of the truth, and which hold."""
    true, value, half = (
        np.array([float(r[k]) for r in own]) for k in ("true", "estimate", "half_width")
    )
    scale = 100.0 / np.abs(true)
    return (value - true) * scale, half * scale, np.abs(value - true) <= half


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print both tables."""
    run = seeded_run(
        "no_vanes",
        __doc__,
        arguments,
        flights=6,
        first_seed=FIRST_SEED,
        each="of each cell (the page: 50)",
    )
    prefer_machine_code()

    def both(seed: int, turbulence_mps: float) -> Iterator[Row]:
        return rows_of(seed, turbulence_mps, with_own=seed < run.seeds.start + WITH_VANES)

    rows = flown_rows(run.rows, COLUMNS, product(run.seeds, TURBULENCE_MPS), both)
    return run.report(rows, table)


if __name__ == "__main__":
    sys.exit(main())
