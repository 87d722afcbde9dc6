"""The cells of the gate: a world and how hard its air is; every flight has an aircraft file."""

from __future__ import annotations

import functools
import itertools
import math
import tempfile
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from host.export.toml import dumps
from host.physical.recording import FOREIGN, SURFACES, Recording
from host.readers.even_grid import even_columns
from host.sysid.pipeline import Identification, at_hand, identify_columns
from host.twin.testcard.cards import load
from host.twin.virtual import virtual_flight

import host
from studies.field_records.ranges import RANGES, Draw, draw
from studies.field_records.record_flight import RATE_HZ, drawn_aircraft
from studies.field_records.record_flight import fly as fly_worn
from studies.field_records.recorded_columns import ROW_HZ, columns_of
from studies.field_records.true_derivatives import short_period_radps, true_derivatives
from studies.foreign.aeroplane import FLYING_WING, TRAINER, Trainer
from studies.foreign.flight import Air, fly
from studies.foreign.instrument import (
    SENSORS_FILE,
    TRAINER_FILE,
    WING_FILE,
    drawn_file,
    with_sensor_errors,
)
from studies.judgement.default_errors import with_default_errors
from studies.judgement.field_flights import OWN
from studies.judgement.judged_rows import COEFFICIENTS, Flown, Truth
from studies.judgement.trainer_flights import truth_document, truth_of
from studies.one_model_gate.worn_coefficients import coefficients_of, thrust_of

AIR_MPS = (0.0, 0.5, 1.0)
DRAW = 51
MODEL = "coefficients"
FILES = {TRAINER: TRAINER_FILE, FLYING_WING: WING_FILE}
# Form, whether gusts turn with the aircraft, whether air pitches and rolls: by the seed in turn.
KINDS = (("dryden", True, True), ("karman", False, True), ("dryden", False, True))


@dataclass(frozen=True, slots=True)
class Cell:
    """One world in one air.

    Attributes
    ----------
    world : str
    air_mps : float
        Deviation of the vertical gust.
    names : tuple of str
        Parameters that are judged.
    scale : str
        World of `judgement/scales.csv` whose scale divides the score.
    fly : callable
        Given air, seed and method, a flight.
    """

    world: str
    air_mps: float
    names: tuple[str, ...]
    scale: str
    fly: Callable[[float, int, str | None], Flown]

    @property
    def name(self) -> str:
        """World and air."""
        return f"{self.world}, {self.air_mps:g} m/s"


def independent(a: Trainer, air_mps: float, seed: int, method: str | None) -> Flown:
    """Return a flight of the independent simulator with errors that its files state."""
    form, turns, spread = KINDS[seed % len(KINDS)]
    measured, true = fly(Air(form, air_mps, turns, spread), seed, a)
    rng = np.random.default_rng([DRAW, seed])
    table = with_sensor_errors(measured, rng, a)
    if a is FLYING_WING:
        del table["rudder_rad"]
    known = truth_of(true, a)

    def identify() -> Identification:
        with tempfile.TemporaryDirectory() as folder:
            truth = Path(folder) / "truth.toml"
            truth.write_text(dumps(known), encoding="utf-8")
            return host.identify(
                pd.DataFrame(table),
                aircraft=drawn_file(Path(folder), rng, FILES[a]),
                calibration=SENSORS_FILE,
                models=MODEL,
                methods=method,
                truth=truth,
            )

    return Flown(known, identify)


def real_records(air_mps: float, seed: int, method: str | None) -> Flown:
    """Return a flight with the errors of real records, of which a file tells mass and sizes."""
    rng = np.random.default_rng([DRAW, seed])
    drawn = draw(rng)
    by = replace(drawn, values={**drawn.values, "gust_mps": air_mps})  # noqa: PD011
    plane = drawn_aircraft(rng, by)
    rows = fly_worn(plane, by, rng)
    at_trim = true_derivatives(plane, float(rows[0, 19]), plane.trim_alpha, plane.trim_de)
    record = columns_of(rows, by, short_period_radps(at_trim), rng)
    record = with_default_errors(record, rng, OWN)
    thrust_n = thrust_of(plane, record["airspeed_mps"])
    record = {**record, "thrust_n": thrust_n}
    thin = rows[:: RATE_HZ // ROW_HZ].astype(np.float64)
    true = {
        "t_s": record["t_s"],
        "airspeed_mps": thin[:, 19],
        "alpha_rad": thin[:, 20],
        "elevator_rad": thin[:, 25],
    }

    def local(speed: float, alpha: float, de: float) -> dict[str, dict[str, float]]:
        dimensional = true_derivatives(plane, speed, alpha, de)
        found = coefficients_of(plane, dimensional, speed, alpha)
        return {"derivatives": found, "dimensional": dimensional}

    truth = truth_document(true, local)

    def identify() -> Identification:
        with tempfile.TemporaryDirectory() as folder:
            file = measured_file(Path(folder), rng, by)
            recording = Recording(commanded=SURFACES, maker=FOREIGN)
            flight = at_hand(record, aircraft=file, recording=recording)
            return identify_columns(flight, models=MODEL, methods=method, truth=truth)

    return Flown(truth, identify)


def measured_file(folder: Path, rng: np.random.Generator, by: Draw) -> Path:
    """Write the file of a worn aircraft: places as measured, upwash as usual of a boom's vanes."""
    path = drawn_file(folder, rng)
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    sensors, (low, high) = document["sensors"], RANGES["upwash"]
    for names, off in (
        (("vane_a_m", "vane_b_m"), (by["vane_ahead_m"], 0.0, 0.0)),
        (("imu_m",), (by["imu_off_m"],) * 3),
    ):
        for name in names:
            sensors[name] = [x + d for x, d in zip(sensors[name], off, strict=True)]
    sensors["upwash"] = 0.5 * (low + high)
    sensors["upwash_tolerance"] = (high - low) / (high + low) / math.sqrt(3.0)
    path.write_text(dumps(document), encoding="utf-8")
    return path


def twin(air_mps: float, seed: int, method: str | None) -> Flown:
    """Return a flight of the twin through the recorder, tolerances of its files drawn."""
    card = load("demo")
    flight = virtual_flight(replace(card, air=replace(card.air, turbulence_mps=air_mps)), seed)
    truth: Truth = {"first_row_s": 0.0, "maneuver": list(flight.maneuvers)}
    columns, _ = even_columns(flight.table)

    def identify() -> Identification:
        return identify_columns(
            at_hand(columns, aircraft="ultrastick25e"), models=MODEL, methods=method, truth=truth
        )

    return Flown(truth, identify)


WITHOUT_RUDDER = tuple(n for n in COEFFICIENTS if not n.endswith("_dr"))
INDEPENDENT = "independent, file"
_WORLDS: dict[str, tuple[tuple[str, ...], str, Callable[[float, int, str | None], Flown]]] = {
    "trainer": (COEFFICIENTS, INDEPENDENT, functools.partial(independent, TRAINER)),
    "flying wing": (WITHOUT_RUDDER, INDEPENDENT, functools.partial(independent, FLYING_WING)),
    "real records": (COEFFICIENTS, INDEPENDENT, real_records),
    "twin": (COEFFICIENTS, "twin, file, coefficients", twin),
}
CELLS = {
    cell.name: cell
    for cell in (
        Cell(world, air_mps, *_WORLDS[world])
        for world, air_mps in itertools.product(_WORLDS, AIR_MPS)
    )
}
