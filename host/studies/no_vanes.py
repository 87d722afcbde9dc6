"""Without vanes: angles against the air, derivatives against the truth, beside the same flights'
own logs with vanes.

Each flight of the card `demo` is flown once with all tolerances drawn, in calm air or in gusts. Its
own log has vanes; the log that a PX4 plane would have written has none.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from host.sysid.identification_error import IdentificationError
from host.sysid.pipeline.aircraft_data import aircraft_data
from host.sysid.pipeline.flight_preparation import prepare
from host.sysid.pipeline.reading_options import ReadingOptions
from host.twin.flight.fly import FlightRecord, fly
from host.twin.outcome.autopilot_logs import write_autopilot_log
from host.twin.outcome.ideal import true_table
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.testcard.cards import load

import host
from studies.imported_logs import AIRCRAFT, MODELS, own_log, truth

FIRST_SEED = 420  # 400 and 401 were looked at while the reconstruction was written
TURBULENCE_MPS = (0.0, 0.5)
SETTLED_S = 5.0  # behind the launch
# The coefficient of each row and the derivative whose mark it has.
TWIN = {
    "CL_alpha": "Z_alpha", "Cm_alpha": "M_alpha", "Cm_q": "M_q", "Cm_de": "M_de", "Cl_p": "L_p",
    "Cl_da": "L_da", "Cn_beta": "N_beta", "Cn_r": "N_r", "Cn_dr": "N_dr",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Angle:
    """One reconstructed angle of a flight: error against the air, and what was told, deg."""

    turbulence_mps: float
    seed: int
    name: str
    rms_deg: float
    mean_deg: float
    told_deg: float


@dataclass(frozen=True, slots=True)
class Told:
    """One coefficient of a flight without vanes, and its half-width with them (NaN: not told)."""

    turbulence_mps: float
    seed: int
    name: str
    true: float
    value: float
    half_width: float
    mark: str
    with_vanes: float

    @property
    def held(self) -> bool:
        """Whether the interval holds the truth."""
        return abs(self.value - self.true) <= self.half_width


def study(turbulence_mps: float, seeds: range) -> Iterator[Angle | Told]:
    """Fly, hide the vanes, reconstruct and identify."""
    card = load("demo")
    card = replace(card, air=replace(card.air, turbulence_mps=turbulence_mps))
    for seed in seeds:
        record = fly(card, seed=seed)
        data = air_data(record)
        with tempfile.TemporaryDirectory() as folder:
            stem = Path(folder) / "flight"
            own, by = own_log(record, data, stem)
            path = write_autopilot_log("ulog", record, data, stem, airframe="conventional")
            yield from _angles(turbulence_mps, record, data, path)
            yield from _told(turbulence_mps, seed, truth(record, data), path, own, by)


def _angles(
    turbulence_mps: float, record: FlightRecord, data: AirData, path: Path
) -> Iterator[Angle]:
    prepared = prepare(path, ReadingOptions(), aircraft_data(AIRCRAFT))
    if prepared.angles is None:
        return
    true, t = true_table(record, data), prepared.flight.corrected["t_s"]
    begin = record.card.flight.ground_s + SETTLED_S
    aloft = (t > begin) & (t < float(true["t_s"].iloc[-1]) - 1.0)
    for name in ("alpha", "beta"):
        found = getattr(prepared.angles, f"{name}_rad")
        error = np.degrees(found - np.interp(t, true["t_s"], true[f"{name}_rad"]))[aloft]
        told = np.degrees(getattr(prepared.angles, f"{name}_sd_rad"))
        yield Angle(turbulence_mps, record.seed, name, float(np.sqrt(np.mean(error**2))),
                    float(error.mean()), float(told))  # fmt: skip


def _told(
    turbulence_mps: float, seed: int, true: dict[str, float], path: Path, own: Path, by: Path
) -> Iterator[Told]:
    try:
        table = host.identify(path, aircraft=AIRCRAFT, models=MODELS).table
        beside = host.identify(own, aircraft=AIRCRAFT, models=MODELS, calibration=by).table
    except IdentificationError:
        return
    flat, with_vanes = (t.reset_index().set_index("name") for t in (table, beside))
    for name, value in true.items():
        if name in flat.index:
            estimate, half_width = (float(flat[k].to_dict()[name]) for k in ("value", "half_width"))
            width = float(with_vanes["half_width"].to_dict().get(name, np.nan))
            mark = str(flat["verdict"].to_dict()[TWIN[name]])
            yield Told(turbulence_mps, seed, name, value, estimate, half_width, mark, width)


def angle_rows(found: list[Angle]) -> list[tuple[float | str, ...]]:
    """Return for each turbulence and angle: median and worst rms, rms about the mean, told sd."""
    keys = dict.fromkeys((a.turbulence_mps, a.name) for a in found)
    rows: list[tuple[float | str, ...]] = []
    for turbulence, name in keys:
        mine = [a for a in found if (a.turbulence_mps, a.name) == (turbulence, name)]
        rms, mean = np.array([a.rms_deg for a in mine]), np.array([a.mean_deg for a in mine])
        rows.append((
            turbulence, name, float(np.median(rms)), float(rms.max()),
            float(np.median(np.sqrt(rms**2 - mean**2))),
            float(np.median([a.told_deg for a in mine])),
        ))  # fmt: skip
    return rows


def coefficient_rows(found: list[Told]) -> list[tuple[float | str, ...]]:
    """Return for each turbulence and coefficient: held, of, width over that with vanes, estimate
    over truth, and how many are under "trust" or "use with care"."""
    keys = dict.fromkeys((t.turbulence_mps, t.name) for t in found)
    rows: list[tuple[float | str, ...]] = []
    for turbulence, name in keys:
        mine = [t for t in found if (t.turbulence_mps, t.name) == (turbulence, name)]
        rows.append((
            turbulence, name, sum(t.held for t in mine), len(mine),
            float(np.median([t.half_width / t.with_vanes for t in mine])),
            float(np.median([t.half_width / abs(t.true) for t in mine])),
            float(np.median([t.value / t.true for t in mine])),
            sum(t.mark in ("trust", "use with care") for t in mine),
        ))  # fmt: skip
    return rows


def main(flights: int = 6) -> int:
    """Print both tables."""
    found = [
        one
        for turbulence in TURBULENCE_MPS
        for one in study(turbulence, range(FIRST_SEED, FIRST_SEED + flights))
    ]
    angles = angle_rows([a for a in found if isinstance(a, Angle)])
    print("| gusts m/s | angle | median rms deg | worst | about its mean | told sd |")
    for row in angles:
        print("|", " | ".join(x if isinstance(x, str) else f"{x:.2f}" for x in row), "|")
    told = [t for t in found if isinstance(t, Told)]
    print("| gusts m/s | | held | of | width over vanes' | width | over truth | not doubtful |")
    for row in coefficient_rows(told):
        print("|", " | ".join(x if isinstance(x, str) else f"{x:.3g}" for x in row), "|")
    for turbulence in TURBULENCE_MPS:
        mine = [t for t in told if t.turbulence_mps == turbulence]
        print(f"{turbulence:g} m/s: {sum(t.held for t in mine)} of {len(mine)} held")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
