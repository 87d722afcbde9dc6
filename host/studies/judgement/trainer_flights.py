"""Flights of the independent simulator, analysed with a file, without one, with perfect sensors."""

from __future__ import annotations

import functools
import math
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from host.arrays import Array
from host.export.toml import dumps
from host.instrument.instrument_errors import usual_errors
from host.physical.recording import FOREIGN, Recording
from host.sysid.pipeline import Identification, at_hand, identify_columns

import host
from studies import independent
from studies.foreign.aeroplane import TRAINER, Trainer, motion, trimmed
from studies.foreign.flight import INPUTS, INPUTS_OF, SPEED_MPS, Air, Input, fly
from studies.foreign.gust_field import Gusts
from studies.foreign.instrument import SENSORS_FILE, Columns, drawn_file, with_sensor_errors
from studies.judgement.default_errors import with_default_errors
from studies.judgement.judged_rows import COEFFICIENTS, Flown, Truth

AXES = ("elevator", "aileron", "rudder")
RESPONSE_S = 3.0
WIDTH = 1e-4
POINT = ("V", "alpha", "beta", "p", "q", "r", "de", "da", "dr")
OF_ROWS = {"DZM": ("V", "alpha", "q", "de"), "YLN": ("beta", "p", "r", "da", "dr")}
STILL = Gusts(*(np.zeros(8192) for _ in range(4)))
MEAN_OF = ("airspeed_mps", "alpha_rad", "elevator_rad")
DRAW = 45
NEXT_TO_NONE = 0.01  # of the usual errors: deviations are divided by


def air_of(seed: int) -> Air:
    """Return the air of a flight: calm and each kind of gusts in turn."""
    every = list(independent.cells().values())
    return every[seed % len(every)]


def without_file(seed: int) -> Flown:
    """Return a flight of unknown sensors."""
    measured, true = _flown(seed)
    # Places turn forces by the true rates' slopes, so noise comes last.
    noise = {n: measured[n] - true[n] for n in true}
    wrong = with_default_errors(true, np.random.default_rng([DRAW, seed]))
    table = {n: wrong[n] + noise[n] for n in wrong}
    truth = truth_of(true)

    def identify() -> Identification:
        flight = at_hand(table, recording=Recording(maker=FOREIGN))
        return identify_columns(flight, truth=truth)

    return Flown(truth, identify)


def perfect_sensors(seed: int) -> Flown:
    """Return a flight of sensors without errors but noise, which its instrument says."""
    measured, true = _flown(seed)
    truth = truth_of(true)
    errors = usual_errors(FOREIGN).scaled(NEXT_TO_NONE)

    def identify() -> Identification:
        flight = at_hand(measured, recording=Recording(maker=FOREIGN), errors=errors)
        return identify_columns(flight, truth=truth)

    return Flown(truth, identify)


def with_file(seed: int, models: str | None = None) -> Flown:
    """Return a flight of which a file and a calibration tell the errors that are drawn."""
    measured, true = _flown(seed)
    rng = np.random.default_rng([DRAW, seed])
    table = with_sensor_errors(measured, rng)
    truth = truth_of(true)

    def identify() -> Identification:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "truth.toml"
            path.write_text(dumps(truth), encoding="utf-8")
            return host.identify(
                pd.DataFrame(table),
                aircraft=drawn_file(Path(folder), rng),
                calibration=SENSORS_FILE,
                models=models,
                truth=path,
            )

    return Flown(truth, identify)


@functools.lru_cache(maxsize=1)
def _flown(seed: int) -> tuple[Columns, Columns]:
    return fly(air_of(seed), seed)


def truth_of(true: Columns, a: Trainer = TRAINER) -> Truth:
    """Return a truth as `host simulate` writes it: every maneuver at its mean condition."""
    coefficients = {n: float(getattr(a, n, 0.0)) for n in COEFFICIENTS}

    def local(speed: float, alpha: float, de: float) -> dict[str, dict[str, float]]:
        CL = a.CL_0 + a.CL_alpha * alpha + a.CL_de * de
        drag = {f"CD_{k}": 2.0 * a.CD_CL2 * CL * coefficients[f"CL_{k}"] for k in ("alpha", "de")}
        return {
            "derivatives": coefficients | drag,
            "dimensional": dimensional(functools.partial(_forces, a, speed), speed, alpha, de),
        }

    return truth_document(true, local, INPUTS_OF[a])


def truth_document(
    true: Columns,
    local: Callable[[float, float, float], dict[str, dict[str, float]]],
    inputs: Sequence[Input] = INPUTS,
) -> Truth:
    """Return the truth of inputs as `studies.foreign.flight` has them.

    Parameters
    ----------
    true : dict of (n,) arrays
    local : callable
        Given mean airspeed, angle of attack and elevator, the derivatives there.
    inputs : sequence of Input
    """
    t, found = true["t_s"], []
    for surface, start_s, unit_s, _, signs in inputs:
        end_s = start_s + unit_s * len(signs)
        inside = (t >= start_s) & (t < end_s + RESPONSE_S)
        mean = (
            float(true[n][inside].mean()) for n in ("airspeed_mps", "alpha_rad", "elevator_rad")
        )
        found.append({
            "axes": [AXES[surface]], "start_s": start_s, "input_end_s": end_s,
            "end_s": end_s + RESPONSE_S, **local(*mean),
        })  # fmt: skip
    return {"first_row_s": 0.0, "maneuver": found}


def dimensional(
    forces: Callable[[Array], dict[str, float]], speed: float, alpha: float, de: float
) -> dict[str, float]:
    """Return dimensional derivatives by central differences of forces at a condition."""
    point = np.array([speed, alpha, 0.0, 0.0, 0.0, 0.0, de, 0.0, 0.0])
    found: dict[str, float] = {}
    for rows, names in OF_ROWS.items():
        for name in names:
            shift = np.where(np.array(POINT) == name, WIDTH, 0.0)
            up, down = forces(point + shift), forces(point - shift)
            found |= {f"{row}_{name}": (up[row] - down[row]) / (2.0 * WIDTH) for row in rows}
    return found


def _forces(a: Trainer, trim_mps: float, point: Array) -> dict[str, float]:
    """Return specific forces by path axes, Z and Y over the airspeed, and angular accelerations."""
    speed, alpha, beta, p, q, r, de, da, dr = (float(x) for x in point)
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    x = [speed * ca * cb, speed * sb, speed * sa * cb, p, q, r, 0.0, alpha, 0.0, 0.0, 0.0]
    x += [0.0, 0.0, 0.0, de, da, dr]
    _, _, throttle = _trim(a)
    now = motion(x, (de, da, dr), throttle, STILL, turns=True, spread=False, a=a)
    ax, ay, az = now.force
    along = ax * ca + az * sa
    return {
        "D": along * cb + ay * sb,
        "Z": (az * ca - ax * sa) / trim_mps,
        "Y": (ay * cb - along * sb) / trim_mps,
        "L": now.rates[3],
        "M": now.rates[4],
        "N": now.rates[5],
    }


@functools.cache
def _trim(a: Trainer) -> tuple[float, float, float]:
    return trimmed(SPEED_MPS, a)
