"""Linear flights of a small aircraft whose model is right, or wrong in one known way.

The truth is a template at 17 m/s with the derivatives of a trainer of 1.8 kg; four maneuvers of an
axis, the last for prediction. What is wrong is in the flight, never in the model that is fitted,
but for a missing derivative.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from host.arrays import Array
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.models import LinearModel, Trim, template
from scipy import signal

from studies.coverage import coloured_noise
from studies.inputs import steps

AIRSPEED_MPS = 17.0
DT_S = 0.02
MANEUVER_S, MANEUVERS = 6.0, 4
FINE = 4  # steps of integration per sample
TRUTH = {
    "short-period": {
        "Z_alpha": -6.5, "Z_q": -0.08, "Z_de": -0.55, "M_alpha": -150.0, "M_q": -12.0,
        "M_de": -130.0,
    },
    "lateral": {
        "Y_beta": -0.65, "Y_p": 0.02, "Y_r": 0.03, "Y_da": 0.05, "Y_dr": 0.25, "L_beta": -40.0,
        "L_p": -16.0, "L_r": 4.0, "L_da": 150.0, "L_dr": 5.0, "N_beta": 30.0, "N_p": -1.2,
        "N_r": -2.2, "N_da": -6.0, "N_dr": -28.0,
    },
}  # fmt: skip
PRINCIPAL = {
    "short-period": ("Z_alpha", "M_alpha", "M_q", "M_de"),
    "lateral": ("L_p", "L_da", "N_beta", "N_r", "N_dr"),
}
NOISE_SD = {
    "alpha_rad": 0.002, "q_radps": 0.005, "az_mps2": 0.1, "beta_rad": 0.002, "p_radps": 0.007,
    "r_radps": 0.005, "phi_rad": 0.004, "ay_mps2": 0.05,
}  # fmt: skip
COLOUR = {"white": np.zeros(0), "coloured": np.array([0.9])}
GUST_RAD, GUST_S = 0.012, 1.0  # deviation (0.2 m/s) and time scale of vertical and side gusts
AMPLITUDE_RAD = {"elevator_rad": 0.06, "aileron_rad": 0.07, "rudder_rad": 0.10}
LAG_S = 0.05  # of a servo that the position does not show
AIRSPEED_ERROR = 0.10
# What softens M_alpha and N_beta: moment over that of the linear aircraft falls by this share at
# 0.1 rad.
SOFTENING = {"short-period": ("q_radps", "alpha_rad"), "lateral": ("r_radps", "beta_rad")}
SOFTENING_SHARE, SOFTENING_RAD = 0.4, 0.1
MISSING = {"short-period": "Z_de", "lateral": "L_r"}
FAULTS = ("none", "missing derivative", "hidden lag", "non-linearity", "airspeed 10 % wrong")
NOISES = ("white", "coloured", "gust")


@dataclass(frozen=True)
class LinearFlight:
    """Columns of a flight, its maneuvers, and what is fitted to it."""

    columns: dict[str, Array]
    windows: tuple[DetectedManeuver, ...]
    model: LinearModel | None  # in place of the template, where a derivative is missing
    truth: Mapping[str, float]  # of the derivatives that have one


def fly(name: str, fault: str, noise: str, seed: int, *, scale: float = 1.0) -> LinearFlight:
    """Return one flight.

    Parameters
    ----------
    name : str
        Template.
    fault, noise : str
        One of `FAULTS` and one of `NOISES`.
    seed : int
    scale : float
        Scale of noise and gusts: with next to none a fit shows its limit.
    """
    rng = np.random.default_rng([14, seed, *name.encode(), *fault.encode(), *noise.encode()])
    trim = Trim(AIRSPEED_MPS, 0.06, 0.06)
    model = template(name, trim)
    u, windows = _card(model)
    gust = _gust(rng, len(u)) * (scale if noise == "gust" else 0.0)
    y = _simulated(model, name, u, gust, fault)
    deviation = np.array([NOISE_SD[o] for o in model.outputs])
    y += scale * coloured_noise(rng, COLOUR.get(noise, COLOUR["white"]), len(y), deviation)
    known = AIRSPEED_MPS * (1.0 + (AIRSPEED_ERROR if fault == FAULTS[4] else 0.0))
    columns = {"t_s": DT_S * np.arange(len(u)), "airspeed_mps": np.full(len(u), known)}
    columns |= {"theta_rad": np.full(len(u), trim.theta_rad), "ax_mps2": np.zeros(len(u))}
    columns |= {"alpha_rad": np.full(len(u), trim.alpha_rad)}
    columns |= {o: y[:, k] for k, o in enumerate(model.outputs)}
    columns |= {i: u[:, k] for k, i in enumerate(model.inputs)}
    columns["alpha_rad"] = columns["alpha_rad"] + (
        trim.alpha_rad if name == "short-period" else 0.0
    )
    truth = dict(TRUTH[name])
    own = None
    if fault == "missing derivative":
        del truth[MISSING[name]]
        own = without(template(name, trim), MISSING[name])
    if fault == "non-linearity":
        row, _ = SOFTENING[name]
        del truth[{"q_radps": "M_alpha", "r_radps": "N_beta"}[row]]
    return LinearFlight(columns, windows, own, truth)


def without(model: LinearModel, name: str) -> LinearModel:
    """Return a model that lacks a derivative."""
    return replace(
        model,
        name=f"{model.name} without {name}",
        terms=tuple(t for t in model.terms if t.parameter != name),
        parameters=tuple(p for p in model.parameters if p.name != name),
    )


def _card(model: LinearModel) -> tuple[Array, tuple[DetectedManeuver, ...]]:
    """Return the inputs of the card and its maneuvers, (samples, inputs)."""
    parts, windows, begin = [], [], 0.0
    for axis, name in enumerate(model.inputs):
        unit_s = 0.14 if name == "elevator_rad" else 0.3
        for k in range(MANEUVERS):
            size = AMPLITUDE_RAD[name] * (1.0 - 2.0 * (k % 2))
            pattern = [(n * unit_s, s * size) for n, s in ((3, 1), (2, -1), (1, 1), (1, -1))]
            part = np.zeros((round(MANEUVER_S / DT_S), len(model.inputs)))
            part[:, axis] = steps([(float(a), float(b)) for a, b in pattern], DT_S, MANEUVER_S)[
                :, 0
            ]
            parts.append(part)
            windows.append(
                DetectedManeuver(
                    name, "3-2-1-1", begin + 1.0, begin + 1.0 + 7 * unit_s,
                    begin + MANEUVER_S - DT_S, abs(size), 4,
                )
            )  # fmt: skip
            begin += MANEUVER_S
    return np.vstack(parts), tuple(windows)


def _gust(rng: np.random.Generator, samples: int) -> Array:
    """Return a first-order gust angle of `GUST_RAD` at the fine step, (samples x FINE,)."""
    pole = np.exp(-DT_S / FINE / GUST_S)
    white = rng.standard_normal(samples * FINE + 2000) * GUST_RAD * np.sqrt(1.0 - pole**2)
    return np.asarray(signal.lfilter([1.0], [1.0, -pole], white)[2000:])


def _simulated(model: LinearModel, name: str, u: Array, gust: Array, fault: str) -> Array:
    """Return the outputs of the true aircraft by Runge-Kutta, each maneuver from rest."""
    A, B, C, D = model.matrices(np.array([TRUTH[name][p.name] for p in model.parameters]))
    vane = model.states.index("alpha_rad" if "alpha_rad" in model.states else "beta_rad")
    row, state = (model.states.index(s) for s in SOFTENING[name])
    stiffness = A[row, state]
    dt_s, per = DT_S / FINE, round(MANEUVER_S / DT_S)
    states, inputs = B.shape
    x = np.zeros(states + inputs)  # states, then surfaces behind the servos
    y = np.zeros((len(u), len(C)))

    def rate(x: Array, commanded: Array, wind: float) -> Array:
        air, late = x[:states], x[states:]
        held = late if fault == "hidden lag" else commanded
        out = A @ air + B @ held + A[:, vane] * wind
        if fault == "non-linearity":
            met = air[state] + (wind if state == vane else 0.0)
            softened = SOFTENING_SHARE * min((met / SOFTENING_RAD) ** 2, 1.5)
            out[row] -= stiffness * met * softened
        return np.concatenate([out, (commanded - late) / LAG_S])

    for k in range(len(u)):
        if k % per == 0:
            x = np.zeros(states + inputs)
        met = x[:states].copy()
        met[vane] += gust[k * FINE]
        y[k] = C @ met + D @ (x[states:] if fault == "hidden lag" else u[k])
        slope = ((u[k + 1] if k + 1 < len(u) else u[k]) - u[k]) / FINE
        for f in range(FINE):
            w = float(gust[k * FINE + f])
            begin, middle, end = (u[k] + slope * (f + part) for part in (0.0, 0.5, 1.0))
            k1 = rate(x, begin, w)
            k2 = rate(x + 0.5 * dt_s * k1, middle, w)
            k3 = rate(x + 0.5 * dt_s * k2, middle, w)
            k4 = rate(x + dt_s * k3, end, w)
            x = x + dt_s * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
    return y
