"""Records cut to one doublet, 1.5 to 5 s: do the intervals hold that an answer says to rely on?

Roll and dutch roll are fitted to what four lateral states did: a trainer, another simulator's
trainer, a light aircraft and an airliner, in calm air and in side gusts of 0.3 m/s, each record
begins with its doublet. One row a derivative goes to a file that a later run continues.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from host.arrays import Array
from host.compiled import prefer_machine_code
from host.constants import GRAVITY_MPS2
from host.errors import IdentificationError
from host.physical.recording import FOREIGN, Recording
from host.sysid.answer import CAREFUL, TRUSTED
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.models import Trim, template
from host.sysid.pipeline import at_hand, identify_columns
from scipy import signal

from studies.foreign.flight import derivatives
from studies.stored_rows import flown_rows, seeded_run
from studies.wrong_flights import AIRSPEED_MPS, AMPLITUDE_RAD, NOISE_SD, TRUTH

COLUMNS = (
    "seed", "aircraft", "air", "model", "length_s", "name", "true", "estimate", "half_width", "mark"
)  # fmt: skip
FIRST_SEED = 25100  # those below were looked at
DT_S, LEAD_S, EDGE_S = 0.02, 0.2, 0.04
LENGTHS_S = (1.5, 3.0, 5.0)
AIRS = {"calm": 0.0, "gusts of 0.3 m/s": 0.3}
GUST_LENGTH_M = 17.0
MODELS = {
    "roll": ("aileron_rad", 0.3, ("L_p", "L_da")),
    "dutch-roll": ("rudder_rad", 0.5, ("N_beta", "N_r", "N_dr")),
    "lateral": ("rudder_rad", 0.5, ("N_beta", "N_r", "N_dr")),
}


@dataclass(frozen=True)
class Aircraft:
    """A linear lateral aircraft about level flight."""

    airspeed_mps: float
    truth: dict[str, float]

    @property
    def trim(self) -> Trim:
        """Level flight at this speed."""
        return Trim(self.airspeed_mps, 0.06, 0.06)


@cache
def fleet() -> dict[str, Aircraft]:
    """Return the aircraft by name.

    The light aircraft is Nelson's NAVION (Flight Stability and Automatic Control, 176 ft/s), the
    airliner of the size of the DC-8 on its approach.
    """
    zero = dict.fromkeys(TRUTH["lateral"], 0.0)
    found = derivatives(18.0)
    other = zero | {k: found[k] for k in found if k in zero} | {"Y_beta": -0.62, "Y_dr": 0.2}
    navion = zero | {
        "Y_beta": -0.254, "Y_dr": 0.071, "L_beta": -16.0, "L_p": -8.4, "L_r": 2.19, "L_da": 29.0,
        "L_dr": 2.55, "N_beta": 4.49, "N_p": -0.35, "N_r": -0.76, "N_da": -0.222, "N_dr": -4.6,
    }  # fmt: skip
    airliner = zero | {
        "Y_beta": -0.111, "Y_dr": 0.024, "L_beta": -1.33, "L_p": -0.95, "L_r": 0.61, "L_da": 0.73,
        "L_dr": 0.19, "N_beta": 0.76, "N_p": -0.12, "N_r": -0.27, "N_da": -0.05, "N_dr": -0.39,
    }  # fmt: skip
    return {
        "trainer": Aircraft(AIRSPEED_MPS, TRUTH["lateral"]),
        "other trainer": Aircraft(18.0, other),
        "light aircraft": Aircraft(53.6, navion),
        "airliner": Aircraft(74.0, airliner),
    }


def record(
    aircraft: Aircraft, intensity_mps: float, model_name: str, length_s: float, seed: int
) -> tuple[dict[str, Array], DetectedManeuver]:
    """Return the columns of one record, flown by `scipy.signal.lsim`, and its maneuver."""
    surface, unit_s, _ = MODELS[model_name]
    rng = np.random.default_rng([25, seed, *model_name.encode(), round(10 * length_s)])
    t = DT_S * np.arange(round(length_s / DT_S))
    model = template("lateral", aircraft.trim)
    A, B, C, D = model.matrices(np.array([aircraft.truth[p.name] for p in model.parameters]))
    corners_s = LEAD_S + unit_s * np.arange(3)
    ramps = [np.interp(t, corner + np.array([0.0, EDGE_S]), [0.0, 1.0]) for corner in corners_s]
    u = np.zeros((len(t), 2))
    size_rad = AMPLITUDE_RAD[surface]
    u[:, model.inputs.index(surface)] = size_rad * (ramps[0] - 2.0 * ramps[1] + ramps[2])
    vane = model.states.index("beta_rad")
    gust = _gust(rng, len(t), aircraft.airspeed_mps, intensity_mps)
    system = (A, np.column_stack([B, A[:, vane]]), C, np.column_stack([D, C[:, vane]]))
    y = np.real(signal.lsim(system, np.column_stack([u, gust]), t)[1])
    still = np.zeros(len(t))
    columns = {
        "t_s": t, "airspeed_mps": still + aircraft.airspeed_mps, "q_radps": still,
        "alpha_rad": still + 0.06, "theta_rad": still + 0.06, "ax_mps2": still + 0.6,
        "az_mps2": still - GRAVITY_MPS2,
    }  # fmt: skip
    for k, name in enumerate(model.outputs):
        columns[name] = y[:, k] + NOISE_SD[name] * rng.standard_normal(len(t))
    columns |= dict(zip(model.inputs, u.T, strict=True))
    end_s = float(t[-1])
    last_s = min(float(corners_s[-1]), end_s)
    return columns, DetectedManeuver(
        surface, "doublet", LEAD_S, last_s, end_s, size_rad, 2, given=True
    )


def _gust(rng: np.random.Generator, samples: int, airspeed_mps: float, sd_mps: float) -> Array:
    """Return a side gust of first order over the airspeed, rad, (samples,)."""
    pole = np.exp(-DT_S * airspeed_mps / GUST_LENGTH_M)
    white = rng.standard_normal(samples + 2000) * np.sqrt(1.0 - pole**2)
    gust = signal.lfilter([1.0], [1.0, -pole], white)[2000:]
    return np.asarray(gust * sd_mps / airspeed_mps)


def rows_of(
    seed: int, name: str, air: str, model_name: str, length_s: float
) -> Iterator[dict[str, object]]:
    """Fly once, identify, and return a row of each derivative; without estimate if refused."""
    aircraft = fleet()[name]
    columns, maneuver = record(aircraft, AIRS[air], model_name, length_s, seed)
    key = (seed, name, air, model_name, length_s)
    try:
        flown = at_hand(columns, windows=(maneuver,), recording=Recording(maker=FOREIGN))
        found = identify_columns(flown, models=model_name)
    except IdentificationError:
        yield dict(zip(COLUMNS, (*key, "refused"), strict=False))
        return
    [answer] = found.linear
    half, marks = answer.result.half_width(), found.verdicts[0].marks
    for one in MODELS[model_name][2]:
        k = answer.result.index(one)
        row = (*key, one, aircraft.truth[one], answer.result.estimate[k], half[k], marks[one])
        yield dict(zip(COLUMNS, row, strict=True))


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line for each aircraft, air and model, then what all come to."""
    lines = [
        "aircraft        air               model       relied on   of them hold   all hold  refused"
    ]
    relied_all, held_all = 0, 0
    for name in dict.fromkeys(r["aircraft"] for r in rows):
        for air in AIRS:
            for model in MODELS:
                some = [
                    r for r in rows if (r["aircraft"], r["air"], r["model"]) == (name, air, model)
                ]
                answered = [r for r in some if r["name"] != "refused"]
                relied = [r for r in answered if r["mark"] in (TRUSTED, CAREFUL)]
                held, held_relied = sum(map(_held, answered)), sum(map(_held, relied))
                relied_all, held_all = relied_all + len(relied), held_all + held_relied
                lines.append(
                    f"{name:16s}{air:18s}{model:11s}{len(relied):4d} of {len(answered):3d}"
                    f"  {held_relied:5d} of {len(relied):3d}"
                    f"  {held:5d} of {len(answered):3d}  {len(some) - len(answered):3d}"
                )
    share = 100.0 * held_all / max(relied_all, 1)
    return [*lines, f"of {relied_all} relied on {held_all} hold ({share:.1f} %)"]


def _held(row: dict[str, str]) -> bool:
    true, estimate, half = (float(row[k]) for k in ("true", "estimate", "half_width"))
    return abs(estimate - true) <= half


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    run = seeded_run(
        "short_records", __doc__, arguments, flights=10, first_seed=FIRST_SEED, each="of each kind"
    )
    keys = (
        (seed, name, air, model, length_s)
        for seed in run.seeds
        for name in fleet()
        for air in AIRS
        for model in MODELS
        for length_s in LENGTHS_S
    )
    return run.report(flown_rows(run.rows, COLUMNS, keys, rows_of), table)


if __name__ == "__main__":
    prefer_machine_code()
    sys.exit(main())
