"""A flight of the trainer: four test inputs of the elevator, three of aileron and rudder each.

The flying wing has no rudder, and six inputs of the ailerons.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from host.constants import GRAVITY_MPS2
from numpy.typing import NDArray

from studies.foreign.aeroplane import DENSITY_KGPM3, FLYING_WING, TRAINER, Trainer, motion, trimmed
from studies.foreign.gust_field import Gusts, gusts

STEP_S, SUBSTEPS = 0.01, 2
SPEED_MPS, HEIGHT_M = 18.0, 60.0
COLUMNS = (
    "t_s", "airspeed_mps", "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps", "phi_rad",
    "theta_rad", "psi_rad", "ax_mps2", "ay_mps2", "az_mps2", "elevator_rad", "aileron_rad",
    "rudder_rad", "altitude_m",
)  # fmt: skip
# White noise of ideally placed sensors, one deviation.
NOISE = {
    "airspeed_mps": 0.15, "alpha_rad": 0.0025, "beta_rad": 0.0025,
    "p_radps": 0.003, "q_radps": 0.003, "r_radps": 0.003,
    "phi_rad": 0.004, "theta_rad": 0.004, "psi_rad": 0.01,
    "ax_mps2": 0.06, "ay_mps2": 0.06, "az_mps2": 0.1,
}  # fmt: skip
# Surface (0 elevator, 1 aileron, 2 rudder), start, unit (s), amplitude (deg), signs of the units.
LONG, SHORT = (1, 1, 1, -1, -1, 1, -1), (1, -1)
INPUTS = (
    *((0, 4.0 + 10.0 * k, 0.25, 3.0, LONG) for k in range(3)), (0, 34.0, 0.35, 3.0, SHORT),
    *((1, 43.0 + 9.0 * k, 0.40, 4.0, SHORT) for k in range(3)),
    *((2, 70.0 + 10.0 * k, 0.80, 6.0, SHORT) for k in range(3)),
)  # fmt: skip
WING_INPUTS = (
    *INPUTS[:7], *((1, 70.0 + 10.0 * k, 0.60, 4.0, SHORT) for k in range(3)),
)  # fmt: skip
INPUTS_OF = {TRAINER: INPUTS, FLYING_WING: WING_INPUTS}
DURATION_S = 100.0
HANDS_OFF_S = (1.0, 6.5)  # before and after the beginning of an input; the pilot levels else


@dataclass(frozen=True)
class Air:
    """One cell: form and deviation of the gusts; whether they turn, and act along the aircraft."""

    form: str = "dryden"
    intensity_mps: float = 0.0
    turns: bool = True
    spread: bool = False


def fly(
    air: Air, seed: int, a: Trainer = TRAINER
) -> tuple[dict[str, NDArray[np.float64]], dict[str, NDArray[np.float64]]]:
    """Return the columns as measured and as they were, each (samples,)."""
    rng = np.random.default_rng(seed)
    field = gusts(rng, air.intensity_mps, air.form, a.span if air.spread else None)
    true = _flown(air, field, a) if air.intensity_mps else dict(_calm(air, a))
    measured = {
        name: values + NOISE.get(name, 0.0) * rng.standard_normal(len(values))
        for name, values in true.items()
    }
    return measured, true


@functools.cache
def _calm(air: Air, a: Trainer) -> dict[str, NDArray[np.float64]]:
    """Return the true columns in air that does not move: the same of every seed, read-only."""
    true = _flown(air, gusts(np.random.default_rng(0), 0.0, air.form, None), a)
    for values in true.values():
        values.flags.writeable = False
    return true


def _flown(air: Air, gusts_met: Gusts, plane: Trainer) -> dict[str, NDArray[np.float64]]:
    """Return the true columns."""
    field = gusts_met.lists()
    alpha, de, throttle = trimmed(SPEED_MPS, plane)
    at = functools.partial(motion, turns=air.turns, spread=air.spread, a=plane)
    inputs = INPUTS_OF[plane]
    x = [SPEED_MPS * np.cos(alpha), 0.0, SPEED_MPS * np.sin(alpha), *[0.0] * 4, alpha, 0.0, 0.0]
    x = [float(value) for value in (*x, HEIGHT_M, *[0.0] * 3, de, 0.0, 0.0)]
    step = STEP_S / SUBSTEPS
    half, sixth = 0.5 * step, step / 6.0
    rows = []
    for sample in range(round(DURATION_S / STEP_S)):
        t = sample * STEP_S
        command = _pilot(t, x, alpha, de, inputs)

        def rates(
            state: list[float], wanted: tuple[float, float, float] = command
        ) -> tuple[float, ...]:
            return at(state, wanted, throttle, field).rates

        now = at(x, command, throttle, field)
        rows.append((t, now.airspeed, now.alpha, now.beta, *x[3:9], *now.force, *x[14:17], x[10]))
        for substep in range(SUBSTEPS):
            a = rates(x) if substep else now.rates
            b = rates([s + half * k for s, k in zip(x, a, strict=True)])
            c = rates([s + half * k for s, k in zip(x, b, strict=True)])
            d = rates([s + step * k for s, k in zip(x, c, strict=True)])
            x = [
                s + sixth * (ka + 2.0 * kb + 2.0 * kc + kd)
                for s, ka, kb, kc, kd in zip(x, a, b, c, d, strict=True)
            ]
    return dict(zip(COLUMNS, np.array(rows).T, strict=True))


def derivatives(airspeed_mps: float) -> dict[str, float]:
    """Return the dimensional derivatives at an airspeed; thrust balances drag."""
    a, V = TRAINER, airspeed_mps
    force = 0.5 * DENSITY_KGPM3 * V**2 * a.area
    drag = a.CD_0 + a.CD_CL2 * (a.mass * GRAVITY_MPS2 / force) ** 2
    chord, span = 0.5 * a.chord / V, 0.5 * a.span / V
    found = {
        "Z_alpha": -force * (a.CL_alpha + drag) / (a.mass * V),
        "M_alpha": force * a.chord * a.Cm_alpha / a.iyy,
        "M_q": force * a.chord * a.Cm_q * chord / a.iyy,
        "M_de": force * a.chord * a.Cm_de / a.iyy,
    }
    det = a.ixx * a.izz - a.ixz**2
    for label, by in (("beta", 1.0), ("p", span), ("r", span), ("da", 1.0), ("dr", 1.0)):
        roll, yaw = (force * a.span * by * getattr(a, f"{k}_{label}") for k in ("Cl", "Cn"))
        found[f"L_{label}"] = (a.izz * roll + a.ixz * yaw) / det
        found[f"N_{label}"] = (a.ixz * roll + a.ixx * yaw) / det
    return found


Input = tuple[int, float, float, float, tuple[int, ...]]


def _pilot(
    t: float, x: list[float], theta: float, de: float, inputs: Sequence[Input]
) -> tuple[float, float, float]:
    command, busy = [de, 0.0, 0.0], False
    before, after = HANDS_OFF_S
    for surface, start_s, unit_s, degrees, signs in inputs:
        busy |= -before < t - start_s < after
        unit = int((t - start_s) // unit_s)
        if 0 <= unit < len(signs):
            command[surface] += signs[unit] * float(np.deg2rad(degrees))
    if not busy:
        command[0] += 0.5 * (x[7] - theta) + 0.08 * x[4]
        command[1] -= 0.5 * x[6] + 0.06 * x[3]
    return command[0], command[1], command[2]
