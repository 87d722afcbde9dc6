"""What the parameters of a linear model mean on the worn aircraft, by differences of its forces.

The model has no state for the air at the tail, which comes late: late = -wash tau s / (1 + tau s)
times the angle. In an oscillation at the natural frequency of the short period (of the dutch roll)
that is a angle + b angle' with two numbers, and the truth is the model that has them in its
derivatives: it answers an input of that frequency as the aircraft does. At frequencies near zero
alone, b = -wash tau, will not do: tau is 0.4 to 0.7 of the time of a radian.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from host.arrays import Array

from studies.field_records.worn_aeroplane import EPSILON, SIGMA, STATES, Worn, motion

WIDTH = 1e-4
NAMES = ("V", "alpha", "beta", "p", "q", "r", "de", "da", "dr")
OF_ROWS = {"DZM": ("V", "alpha", "q", "de"), "YLN": ("beta", "p", "r", "da", "dr")}


def true_derivatives(a: Worn, airspeed_mps: float, alpha_rad: float, de: float) -> dict[str, float]:
    """Return ``D_V`` ... ``N_dr`` at a condition, SI and radians."""
    point = np.array([airspeed_mps, alpha_rad, 0.0, 0.0, 0.0, 0.0, de, 0.0, 0.0])
    found = {}
    for rows, names in OF_ROWS.items():
        for name in names:
            shift = np.where(np.array(NAMES) == name, WIDTH, 0.0)
            up, down = (forces(a, x, airspeed_mps) for x in (point + shift, point - shift))
            for row in rows:
                found[f"{row}_{name}"] = (up[row] - down[row]) / (2.0 * WIDTH)
    lag = a.wash_lag * a.tail_arm / airspeed_mps
    pitch = {"alpha": 0.0, "q": 1.0}
    side = {"beta": 0.0, "p": math.sin(alpha_rad), "r": -math.cos(alpha_rad)}
    for rows, wash, known, which in (
        ("DZM", a.downwash, pitch, 0),
        ("YLN", a.sidewash, side, 1),
    ):
        late = np.eye(2)[which] * WIDTH
        up, down = (forces(a, point, airspeed_mps, x) for x in (late, -late))
        slope = {row: (up[row] - down[row]) / (2.0 * WIDTH) for row in rows}
        _add_late_air(found, slope, _Wash(wash, lag, known))
    return found


@dataclass(frozen=True, slots=True)
class _Wash:
    """Air that comes late: share of the angle, lag, what of the angle's rate is kinematics."""

    share: float
    lag_s: float
    known: dict[str, float]


def _add_late_air(found: dict[str, float], slope: dict[str, float], wash: _Wash) -> None:
    """Add to derivatives what late air adds to them at the natural frequency of their axis."""
    longitudinal = "M" in slope
    names = OF_ROWS["DZM" if longitudinal else "YLN"]
    angle, first = ("Z", "alpha") if longitudinal else ("Y", "beta")
    rate = {n: wash.known.get(n, 0.0) + found[f"{angle}_{n}"] for n in names}
    # Without what is late: stiffness and damping of the two equations of the oscillation.
    turn, moment = ("q", "M") if longitudinal else ("r", "N")
    stiff = found[f"{angle}_{first}"] * found[f"{moment}_{turn}"]
    stiff -= rate[turn] * found[f"{moment}_{first}"]
    lag = wash.lag_s * math.sqrt(max(stiff, 1.0))
    a = -wash.share * lag**2 / (1.0 + lag**2)
    b = -wash.share * wash.lag_s / (1.0 + lag**2)
    late = {
        n: a * (n == first) + b * (rate[n] + slope[angle] * a * (n == first))
        / (1.0 - b * slope[angle])
        for n in names
    }  # fmt: skip
    for row, of in slope.items():
        for name in names:
            found[f"{row}_{name}"] += of * late[name]


def forces(a: Worn, point: Array, trim_mps: float, late: Array | None = None) -> dict[str, float]:
    """Return specific forces by path axes, Z and Y over the trim's airspeed, and angular
    accelerations."""
    speed, alpha, beta, p, q, r = (float(x) for x in point[:6])
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    behind = np.zeros(2) if late is None else late
    x, out = np.zeros(STATES), np.zeros(22)
    x[:6] = speed * ca * cb, speed * sb, speed * sa * cb, p, q, r
    x[7] = alpha
    x[EPSILON] = a.downwash * (alpha - a.trim_alpha) + behind[0]
    x[SIGMA] = a.sidewash * beta + behind[1]
    motion(a, x, point[6:9], np.zeros(3), out)
    ax, ay, az = out[16:19].tolist()
    along = ax * ca + az * sa
    return {
        "D": along * cb + ay * sb,
        "Z": (az * ca - ax * sa) / trim_mps,
        "Y": (ay * cb - along * sb) / trim_mps,
        "L": float(out[3]),
        "M": float(out[4]),
        "N": float(out[5]),
    }


def short_period_radps(d: dict[str, float]) -> float:
    """Return the natural frequency of alpha and q alone."""
    return math.sqrt(max(d["Z_alpha"] * d["M_q"] - d["M_alpha"] * (1.0 + d["Z_q"]), 1.0))
