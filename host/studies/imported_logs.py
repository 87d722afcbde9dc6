"""The same flights as our logger, a PX4 and an ArduPilot plane had logged them: the same answer?

Vanes are in our own log only. Every flight of the card `demo` is flown once with all tolerances
drawn; its own log is identified with vanes, its imports without, by the same two models.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from host.errors import IdentificationError
from host.twin.flight.fly import FlightRecord, fly
from host.twin.outcome.autopilot_logs import NAMES, write_autopilot_log
from host.twin.outcome.autopilot_outputs import AIRFRAMES
from host.twin.outcome.truth_files import maneuvers
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.testcard.cards import load

import host

AIRCRAFT = "ultrastick25e"
FIRST_SEED = 11560  # those before were looked at while readers and estimators were written
MODELS = ("short-period", "lateral")
AXIS = {
    "CL_alpha": "elevator", "Cm_alpha": "elevator", "Cm_q": "elevator", "Cm_de": "elevator",
    "Cl_p": "aileron", "Cl_da": "aileron", "Cn_beta": "rudder", "Cn_r": "rudder",
    "Cn_dr": "rudder",
}  # fmt: skip
OWN = "own log, vanes"


@dataclass(frozen=True, slots=True)
class Estimate:
    """One coefficient of one flight from one log: truth, estimate and 95 % half-width."""

    source: str
    seed: int
    name: str
    true: float
    value: float
    half_width: float

    @property
    def held(self) -> bool:
        """Whether the interval holds the truth."""
        return abs(self.value - self.true) <= self.half_width

    def agrees(self, other: Estimate) -> bool:
        """Whether two estimates differ by less than their joint interval."""
        joint = float(np.hypot(self.half_width, other.half_width))
        return abs(self.value - other.value) <= joint


def study(seeds: range) -> Iterator[Estimate]:
    """Fly, write, import and identify; yield every coefficient that was estimated."""
    for seed in seeds:
        record = fly(load("demo"), seed=seed)
        data = air_data(record)
        true = truth(record, data)
        with tempfile.TemporaryDirectory() as folder:
            stem = Path(folder) / "flight"
            own, by = own_log(record, data, stem)
            yield from _estimates(OWN, seed, own, true, by)
            for kind in NAMES:
                for airframe in AIRFRAMES:
                    path = write_autopilot_log(kind, record, data, stem, airframe=airframe)
                    yield from _estimates(f"{kind}, {airframe}", seed, path, true, None)


def own_log(record: FlightRecord, data: AirData, stem: Path) -> tuple[Path, Path]:
    recording = sitl.record(
        stimuli(record, data),
        rate_hz=sitl.recorder_rate_hz(record.card.flight.rate_hz),
        aircraft=record.aircraft.name,
        seed=record.seed,
    )
    log, text = stem.with_suffix(".own.bin"), stem.with_suffix(".toml")
    log.write_bytes(recording.log)
    text.write_text(calibration(record.aircraft, record.draws.errors), encoding="utf-8")
    return log, text


def truth(record: FlightRecord, data: AirData) -> dict[str, float]:
    """Return each coefficient as the mean over the maneuvers of its axis."""
    every = maneuvers(record, data)
    found = {}
    for name, axis in AXIS.items():
        values = [
            float(m["derivatives"][name])  # type: ignore[index]
            for m in every
            if axis in m["axes"]  # type: ignore[operator]
        ]
        found[name] = float(np.mean(values))
    return found


def _estimates(
    source: str, seed: int, path: Path, true: dict[str, float], by: Path | None
) -> Iterator[Estimate]:
    try:
        answer = host.identify(path, aircraft=AIRCRAFT, models=MODELS, calibration=by)
    except IdentificationError:
        return
    table = answer.table.reset_index()
    intervals = dict(zip(table["name"], zip(table["value"], table["half_width"], strict=True),
                    strict=True))  # fmt: skip
    for name, value in true.items():
        if name in intervals:
            estimate, half_width = intervals[name]
            yield Estimate(source, seed, name, value, float(estimate), float(half_width))


def rows(found: list[Estimate]) -> list[tuple[str | int | float, ...]]:
    """Return a row for each source: how much was estimated, held, agrees, how wide, how wrong."""
    own = {(t.seed, t.name): t for t in found if t.source == OWN}
    result: list[tuple[str | int | float, ...]] = []
    for source in dict.fromkeys(t.source for t in found):
        mine = [t for t in found if t.source == source]
        pairs = [(t, own[t.seed, t.name]) for t in mine if (t.seed, t.name) in own]
        result.append((
            source,
            len(mine),
            100.0 * float(np.mean([t.held for t in mine])),
            100.0 * float(np.mean([a.agrees(b) for a, b in pairs])) if pairs else float("nan"),
            float(np.median([a.half_width / b.half_width for a, b in pairs])) if pairs else 1.0,
            100.0 * float(np.median([abs(t.value / t.true - 1.0) for t in mine])),
        ))  # fmt: skip
    return result
