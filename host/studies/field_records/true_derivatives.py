"""What the parameters of a linear model mean on the worn aircraft, by differences of its forces.

The model has no state for the air at the tail, which comes late: late = -wash tau s / (1 + tau s)
times the angle. At the root s of the short period (of the dutch roll) that is a + b s with real a
and b, so that late = a angle + b angle', and a model without the state that has these numbers in
its derivatives has the same root. The first order alone, b = -wash tau, will not do: tau is 0.6 to
0.9 of the time of a radian.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from host.arrays import Array
from host.constants import GRAVITY_MPS2

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
        _add_late_air(found, slope, _Wash(wash, lag, known, airspeed_mps))
    return found


@dataclass(frozen=True, slots=True)
class _Wash:
    """Air that comes late: share of the angle, lag, what of the angle's rate is kinematics."""

    share: float
    lag_s: float
    known: dict[str, float]
    airspeed_mps: float


def _add_late_air(found: dict[str, float], slope: dict[str, float], wash: _Wash) -> None:
    """Add to derivatives what the air at the tail adds to them at the root of its axis."""
    longitudinal = "M" in slope
    rows, states = ("ZM", ("alpha", "q")) if longitudinal else ("YLN", ("beta", "p", "r"))
    names = OF_ROWS["DZM" if longitudinal else "YLN"]
    angle, first = rows[0], states[0]
    rate = {n: wash.known.get(n, 0.0) + found[f"{angle}_{n}"] for n in names}
    # States and what is late behind them; roll and yaw have the bank angle too.
    size = len(states) + 1 + (not longitudinal)
    whole = np.zeros((size, size))
    for i, row in enumerate(rows):
        for j, state in enumerate(states):
            whole[i, j] = rate[state] if i == 0 else found[f"{row}_{state}"]
        whole[i, -1] = slope[row]
    if not longitudinal:
        whole[0, 3], whole[3, 1] = GRAVITY_MPS2 / wash.airspeed_mps, 1.0
    whole[-1] = -wash.share * whole[0]
    whole[-1, -1] -= 1.0 / wash.lag_s
    root = max(np.linalg.eigvals(whole), key=lambda s: s.imag)
    by = -wash.share * wash.lag_s * root / (1.0 + wash.lag_s * root)
    b = float(by.imag / root.imag) if root.imag > 0.0 else -wash.share * wash.lag_s
    a = float(by.real - b * root.real) if root.imag > 0.0 else 0.0
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
