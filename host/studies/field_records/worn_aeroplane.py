"""An aircraft that no linear model has: bent curves, a tail in the wake of the wing, free play.

Six equations of motion in body axes like those of `studies.foreign`, and besides them two states of
the air at the tail. The equations are machine code where numba is installed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from host.arrays import Array
from host.compiled import compiled_fast
from host.constants import GRAVITY_MPS2

DENSITY_KGPM3 = 1.2
STATES = 16  # u v w p q r phi theta psi height, epsilon sigma, elevator aileron rudder, way
EPSILON, SIGMA, SURFACES, WAY = 10, 11, 12, 15
FIVE_DEG = math.radians(5.0)
SERVO_LIMIT_RADPS = 5.0


class Worn(NamedTuple):
    """Mass, inertia, sizes, coefficients about the trim, and what bends them."""

    mass: float
    area: float
    span: float
    chord: float
    ixx: float
    iyy: float
    izz: float
    ixz: float
    CL_alpha: float
    CL_q: float
    CL_de: float
    CD_0: float
    CD_CL2: float
    Cm_alpha: float
    Cm_q: float
    Cm_de: float
    CY_beta: float
    CY_p: float
    CY_r: float
    CY_dr: float
    Cl_beta: float
    Cl_p: float
    Cl_r: float
    Cl_da: float
    Cl_dr: float
    Cn_beta: float
    Cn_p: float
    Cn_r: float
    Cn_da: float
    Cn_dr: float
    static_thrust: float
    pitch_speed: float
    trim_alpha: float
    trim_lift: float
    trim_de: float
    throttle: float
    lift_loss: float
    moment_change: float
    downwash: float
    sidewash: float
    tail_arm: float
    wash_lag: float
    servo: float


@compiled_fast
def bent(change: float, share: float) -> float:
    """Return a curve through 0 whose slope is 1 there and 1 + share 5 deg away, straight beyond
    10 deg."""
    inside = min(max(change, -2.0 * FIVE_DEG), 2.0 * FIVE_DEG)
    curve = inside + share * inside**3 / (3.0 * FIVE_DEG**2)
    return curve + (change - inside) * max(1.0 + 4.0 * share, 0.1)


@compiled_fast
def motion(a: Worn, x: Array, surfaces: Array, gust: Array, out: Array) -> None:
    """Write the rates of the first 12 states and of the way, then specific force (3), V, alpha,
    beta.

    Parameters
    ----------
    a : Worn
    x : (16,) array
    surfaces : (3,) array
        Elevator, aileron, rudder as the air meets them.
    gust : (3,) array
        In body axes, m/s.
    out : (22,) array
    """
    u, v, w, p, q, r, phi, theta = x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7]
    cf, sf, ct, st = math.cos(phi), math.sin(phi), math.cos(theta), math.sin(theta)
    ua, va, wa = u - gust[0], v - gust[1], w - gust[2]
    V = math.sqrt(ua * ua + va * va + wa * wa)
    alpha, beta = math.atan2(wa, ua), math.asin(va / V)
    ps, qs, rs = 0.5 * a.span / V * p, 0.5 * a.chord / V * q, 0.5 * a.span / V * r
    force = 0.5 * DENSITY_KGPM3 * V * V * a.area
    change = alpha - a.trim_alpha
    de, da, dr = surfaces[0], surfaces[1], surfaces[2]
    # What the tails would carry of the air that has not come to them yet.
    late = x[EPSILON] - a.downwash * change
    aside = x[SIGMA] - a.sidewash * beta
    tail = -a.Cm_q * a.chord / (2.0 * a.tail_arm)  # of pitching moment per angle at the tail
    fin = -a.Cn_r * a.span / (2.0 * a.tail_arm)
    CL = (
        a.trim_lift
        + a.CL_alpha * bent(change, -a.lift_loss)
        + a.CL_q * qs
        + a.CL_de * (de - a.trim_de)
        - tail * a.chord / a.tail_arm * late
    )
    CD = a.CD_0 + a.CD_CL2 * CL * CL
    CY = (
        a.CY_beta * beta + a.CY_p * ps + a.CY_r * rs + a.CY_dr * dr
        + fin * a.span / a.tail_arm * aside
    )  # fmt: skip
    ca, sa = math.cos(alpha), math.sin(alpha)
    thrust = a.static_thrust * a.throttle * (1.0 - V / a.pitch_speed)
    ax = (force * (CL * sa - CD * ca) + thrust) / a.mass
    ay = force * CY / a.mass
    az = -force * (CD * sa + CL * ca) / a.mass
    roll = force * a.span * (
        a.Cl_beta * beta + a.Cl_p * ps + a.Cl_r * rs + a.Cl_da * da + a.Cl_dr * dr
    )  # fmt: skip
    pitch = force * a.chord * (
        a.Cm_alpha * bent(change, a.moment_change) + a.Cm_q * qs + a.Cm_de * (de - a.trim_de)
        + tail * late
    )  # fmt: skip
    yaw = force * a.span * (
        a.Cn_beta * beta + a.Cn_p * ps + a.Cn_r * rs + a.Cn_da * da + a.Cn_dr * dr - fin * aside
    )  # fmt: skip
    roll += a.ixz * p * q - (a.izz - a.iyy) * q * r
    yaw += -a.ixz * q * r - (a.iyy - a.ixx) * p * q
    pitch += -(a.ixx - a.izz) * p * r - a.ixz * (p * p - r * r)
    det = a.ixx * a.izz - a.ixz * a.ixz
    turning = q * sf + r * cf
    lag = a.wash_lag * a.tail_arm / V
    out[0] = ax - GRAVITY_MPS2 * st - q * w + r * v
    out[1] = ay + GRAVITY_MPS2 * sf * ct - r * u + p * w
    out[2] = az + GRAVITY_MPS2 * cf * ct - p * v + q * u
    out[3] = (a.izz * roll + a.ixz * yaw) / det
    out[4] = pitch / a.iyy
    out[5] = (a.ixz * roll + a.ixx * yaw) / det
    out[6] = p + turning * st / ct
    out[7] = q * cf - r * sf
    out[8] = turning / ct
    out[9] = u * st - v * sf * ct - w * cf * ct
    out[EPSILON] = -late / lag
    out[SIGMA] = -aside / lag
    out[WAY] = V
    out[16], out[17], out[18] = ax, ay, az
    out[19], out[20], out[21] = V, alpha, beta


@compiled_fast
def play(before: float, servo: float, width: float) -> float:
    """Return where a surface is behind a linkage with free play of this full width."""
    return min(max(before, servo - 0.5 * width), servo + 0.5 * width)


def start(a: Worn, speed_mps: float, height_m: float) -> Array:
    """Return the state in trim."""
    x = np.zeros(STATES)
    x[0], x[2] = speed_mps * math.cos(a.trim_alpha), speed_mps * math.sin(a.trim_alpha)
    x[7], x[9], x[SURFACES] = a.trim_alpha, height_m, a.trim_de
    return x
