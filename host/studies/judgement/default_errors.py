"""Sensors of a table of which nothing is known: every error drawn from what is usual."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from host.arrays import Array
from host.instrument.instrument_errors import NamedError, usual_errors
from host.physical.recording import FOREIGN

from studies.foreign.instrument import Columns

RATES, FORCES = ("p_radps", "q_radps", "r_radps"), ("ax_mps2", "ay_mps2", "az_mps2")
SURFACES = ("elevator_rad", "aileron_rad", "rudder_rad")
VANES, ATTITUDE = ("alpha_rad", "beta_rad"), ("phi_rad", "theta_rad")
# Places and upwash, which only an aircraft file would tell: even, from and to.
VANE_AHEAD_M = (0.0, 0.4)  # a boom at the nose or the wing of an aircraft of 1.8 m
IMU_OFF_M = (-0.05, 0.05)  # "near the CG"
UPWASH = (0.0, 0.20)  # of a vane a chord ahead of a wing


def with_default_errors(
    true: Columns, rng: np.random.Generator, without: Collection[str] = ()
) -> Columns:
    """Return columns as unknown sensors tell them.

    Parameters
    ----------
    true : dict of (n,) arrays
        Columns of sensors at the CG.
    rng : Generator
    without : collection of str
        Errors that the columns have already; ``places`` and ``upwash`` too.
    """
    errors = usual_errors(FOREIGN)
    found, t = dict(true), true["t_s"]

    def of(name: str) -> float:
        return 0.0 if name in without else drawn(errors[name], rng)

    if "places" not in without:
        found |= at_places(true, float(rng.uniform(*VANE_AHEAD_M)), rng.uniform(*IMU_OFF_M, 3))
    upwash = 0.0 if "upwash" in without else float(rng.uniform(*UPWASH))
    turn = np.cross(np.eye(3), [of("misalignment_rad") for _ in range(3)])
    for names, bias, scale in (
        (RATES, "gyro_bias_radps", "gyro_scale"),
        (FORCES, "accel_bias_mps2", "accel_scale"),
    ):
        turned = np.column_stack([found[n] for n in names]) @ (np.eye(3) + turn)
        for name, values in zip(names, turned.T, strict=True):
            found[name] = values * (1.0 + of(scale)) + of(bias)
    larger = (1.0 + upwash) * (1.0 + of("vane_scale"))
    for name in VANES:
        found[name] = larger * found[name] + of("vane_zero_rad")
    square = found["airspeed_mps"] ** 2 * (1.0 + of("pitot_scale"))
    square = square + 2.0 * of("pitot_zero_pa") / 1.2
    found["airspeed_mps"] = np.sqrt(np.maximum(square, 0.0))
    for name in SURFACES:
        found[name] = found[name] * (1.0 + of("pot_scale")) + of("pot_zero_rad")
    for group in (VANES, ("airspeed_mps",), ATTITUDE):
        late = of("delay_least_s")
        for name in group:
            found[name] = np.interp(t - late, t, found[name])
    return found


def at_places(true: Columns, ahead_m: float, off_m: Array) -> Columns:
    """Return vanes and accelerometers away from the CG."""
    rates = np.column_stack([true[n] for n in RATES])
    force = np.column_stack([true[n] for n in FORCES])
    turning = np.gradient(smooth(rates), true["t_s"], axis=0)
    force = force + np.cross(turning, off_m) + np.cross(rates, np.cross(rates, off_m))
    speed = true["airspeed_mps"]
    return {
        **dict(zip(FORCES, force.T, strict=True)),
        "alpha_rad": true["alpha_rad"] - rates[:, 1] * ahead_m / speed,
        "beta_rad": true["beta_rad"] + rates[:, 2] * ahead_m / speed,
    }


def smooth(rates: Array) -> Array:
    """Return rates over five samples, so that their slope is not their noise."""
    kernel = np.full(5, 0.2)
    return np.column_stack([np.convolve(np.pad(c, 2, "edge"), kernel, "valid") for c in rates.T])


def drawn(error: NamedError, rng: np.random.Generator) -> float:
    """Return one draw of the first sensor's error."""
    width = error.width[0]
    even = error.distribution == "even"
    return float(rng.uniform(-width, width) if even else width * rng.standard_normal())
