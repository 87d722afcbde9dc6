"""A trainer of 4 kg as six equations of motion in body axes, written apart from the package.

A flying wing of 1.6 kg, without rudder and with little of what damps a tail, flies by the same.

Constant coefficients, lift and drag in wind axes, a parabolic polar, thrust that falls with the
airspeed, servos of first order with a rate limit. Nothing of the package but gravity is
used, so that an error shared by simulator and estimator shows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from host.constants import GRAVITY_MPS2
from numpy.typing import NDArray
from scipy.optimize import fsolve

from studies.foreign.gust_field import GustLists, Gusts, at

DENSITY_KGPM3 = 1.2
Speed = TypeVar("Speed", float, NDArray[np.float64])
SERVO_RADPS, SERVO_LIMIT_RADPS = 40.0, 5.0


@dataclass(frozen=True)
class Trainer:
    """Mass, inertia, sizes (SI) and coefficients (per rad; rates by b/2V and c/2V)."""

    mass: float = 4.0
    area: float = 0.55
    span: float = 1.8
    chord: float = 0.31
    ixx: float = 0.25
    iyy: float = 0.28
    izz: float = 0.48
    ixz: float = 0.02
    CL_0: float = 0.25
    CL_alpha: float = 4.9
    CL_q: float = 6.5
    CL_de: float = 0.40
    CD_0: float = 0.040
    CD_CL2: float = 0.065
    Cm_0: float = 0.03
    Cm_alpha: float = -0.75
    Cm_q: float = -11.0
    Cm_de: float = -1.0
    CY_beta: float = -0.50
    CY_p: float = -0.05
    CY_r: float = 0.30
    CY_dr: float = 0.15
    Cl_beta: float = -0.06
    Cl_p: float = -0.50
    Cl_r: float = 0.12
    Cl_da: float = 0.20
    Cl_dr: float = 0.008
    Cn_beta: float = 0.08
    Cn_p: float = -0.04
    Cn_r: float = -0.12
    Cn_da: float = -0.008
    Cn_dr: float = -0.07
    static_thrust: float = 22.0
    pitch_speed: float = 34.0


TRAINER = Trainer()
# Elevons: together they are the elevator, against each other the ailerons.
FLYING_WING = Trainer(
    mass=1.6, area=0.45, span=1.5, chord=0.30, ixx=0.075, iyy=0.030, izz=0.100, ixz=0.001,
    CL_0=0.12, CL_alpha=4.2, CL_q=2.8, CL_de=0.70, CD_0=0.018, CD_CL2=0.070,
    Cm_0=0.015, Cm_alpha=-0.42, Cm_q=-2.6, Cm_de=-0.48,
    CY_beta=-0.22, CY_p=-0.04, CY_r=0.08, CY_dr=0.0,
    Cl_beta=-0.07, Cl_p=-0.42, Cl_r=0.09, Cl_da=0.22, Cl_dr=0.0,
    Cn_beta=0.045, Cn_p=-0.025, Cn_r=-0.045, Cn_da=-0.010, Cn_dr=0.0,
    static_thrust=12.0, pitch_speed=32.0,
)  # fmt: skip


def trimmed(speed_mps: float, a: Trainer = TRAINER) -> tuple[float, float, float]:
    """Return angle of attack, elevator and throttle of level flight."""
    force = 0.5 * DENSITY_KGPM3 * speed_mps**2 * a.area

    def left(x: NDArray[np.float64], /) -> list[float]:
        alpha, de, throttle = (float(v) for v in x)
        CL = a.CL_0 + a.CL_alpha * alpha + a.CL_de * de
        CD = a.CD_0 + a.CD_CL2 * CL**2
        thrust = thrust_n(throttle, speed_mps, a)
        weight = a.mass * GRAVITY_MPS2
        return [
            force * (CL * math.sin(alpha) - CD * math.cos(alpha))
            + thrust
            - weight * math.sin(alpha),
            weight * math.cos(alpha) - force * (CD * math.sin(alpha) + CL * math.cos(alpha)),
            a.Cm_0 + a.Cm_alpha * alpha + a.Cm_de * de,
        ]

    alpha, de, throttle = fsolve(left, np.array([0.05, 0.0, 0.4]))
    return float(alpha), float(de), float(throttle)


def thrust_n(throttle: float, airspeed_mps: Speed, a: Trainer = TRAINER) -> Speed:
    """Return thrust along x: it falls with the airspeed."""
    return a.static_thrust * throttle * (1.0 - airspeed_mps / a.pitch_speed)


class Motion(NamedTuple):
    """Rates of all states at one instant, and what is measured."""

    rates: tuple[float, ...]
    airspeed: float
    alpha: float
    beta: float
    force: tuple[float, float, float]  # specific, m/s2


def motion(
    x: list[float],
    command: tuple[float, float, float],
    throttle: float,
    air: Gusts | GustLists,
    *,
    turns: bool,
    spread: bool,
    a: Trainer = TRAINER,
) -> Motion:
    """Return the motion at a state.

    Parameters
    ----------
    x : list of float
        u v w p q r phi theta psi, way through the air, height, gusts as the tail meets them (3),
        elevator, aileron, rudder.
    command : tuple of float
        Commands of the three servos.
    throttle : float
    air : Gusts or GustLists
    turns : bool
        Gusts are given in body axes, and so turn with the aircraft; else in earth axes.
    spread : bool
        The air pitches, yaws and rolls (MIL-F-8785C, 3.7.5); else gusts act on a point.
    a : Trainer
    """
    u, v, w, p, q, r, phi, theta, psi, way, _, tail_u, tail_v, tail_w, de, da, dr = x
    cf, sf, ct, st = math.cos(phi), math.sin(phi), math.cos(theta), math.sin(theta)
    gu, gv, gw = at(air.u, way), at(air.v, way), at(air.w, way)
    reach = 4.0 * a.span / math.pi
    p_air = at(air.p, way) if spread else 0.0
    changes = (gu - tail_u, gv - tail_v, gw - tail_w)
    _, side, down = changes
    if not turns:  # the air turns about the aircraft's axes, wherever it heads
        headed = cf, sf, ct, st, math.cos(psi), math.sin(psi)
        gu, gv, gw = _to_body((gu, gv, gw), headed)
        _, side, down = _to_body(changes, headed)
    q_air, r_air = (down / reach, -side / reach) if spread else (0.0, 0.0)
    ua, va, wa = u - gu, v - gv, w - gw
    V = math.sqrt(ua * ua + va * va + wa * wa)
    alpha, beta = math.atan2(wa, ua), math.asin(va / V)
    pa, qa, ra = p - p_air, q + q_air, r + r_air
    ps, qs, rs = 0.5 * a.span / V * pa, 0.5 * a.chord / V * qa, 0.5 * a.span / V * ra
    force = 0.5 * DENSITY_KGPM3 * V * V * a.area
    CL = a.CL_0 + a.CL_alpha * alpha + a.CL_q * qs + a.CL_de * de
    CD = a.CD_0 + a.CD_CL2 * CL * CL
    CY = a.CY_beta * beta + a.CY_p * ps + a.CY_r * rs + a.CY_dr * dr
    ca, sa = math.cos(alpha), math.sin(alpha)
    ax = (force * (CL * sa - CD * ca) + thrust_n(throttle, V, a)) / a.mass
    ay = force * CY / a.mass
    az = -force * (CD * sa + CL * ca) / a.mass
    roll = (
        force
        * a.span
        * (a.Cl_beta * beta + a.Cl_p * ps + a.Cl_r * rs + a.Cl_da * da + a.Cl_dr * dr)
    )
    pitch = force * a.chord * (a.Cm_0 + a.Cm_alpha * alpha + a.Cm_q * qs + a.Cm_de * de)
    yaw = (
        force
        * a.span
        * (a.Cn_beta * beta + a.Cn_p * ps + a.Cn_r * rs + a.Cn_da * da + a.Cn_dr * dr)
    )
    roll += a.ixz * p * q - (a.izz - a.iyy) * q * r
    yaw += -a.ixz * q * r - (a.iyy - a.ixx) * p * q
    pitch += -(a.ixx - a.izz) * p * r - a.ixz * (p * p - r * r)
    det = a.ixx * a.izz - a.ixz**2
    turning = q * sf + r * cf
    rates = (
        ax - GRAVITY_MPS2 * st - q * w + r * v,
        ay + GRAVITY_MPS2 * sf * ct - r * u + p * w,
        az + GRAVITY_MPS2 * cf * ct - p * v + q * u,
        (a.izz * roll + a.ixz * yaw) / det,
        pitch / a.iyy,
        (a.ixz * roll + a.ixx * yaw) / det,
        p + turning * st / ct,
        q * cf - r * sf,
        turning / ct,
        V,
        u * st - v * sf * ct - w * cf * ct,
        changes[0] * V / reach,
        changes[1] * V / reach,
        changes[2] * V / reach,
        _servo_rate(command[0] - de),
        _servo_rate(command[1] - da),
        _servo_rate(command[2] - dr),
    )
    return Motion(rates, V, alpha, beta, (ax, ay, az))


def _servo_rate(error_rad: float) -> float:
    return max(-SERVO_LIMIT_RADPS, min(SERVO_LIMIT_RADPS, SERVO_RADPS * error_rad))


def _to_body(
    earth: tuple[float, float, float], headed: tuple[float, float, float, float, float, float]
) -> tuple[float, float, float]:
    """Return a vector of earth axes in body axes, by cosine and sine of each angle."""
    north, east, down = earth
    cf, sf, ct, st, cp, sp = headed
    return (
        ct * cp * north + ct * sp * east - st * down,
        (sf * st * cp - cf * sp) * north + (sf * st * sp + cf * cp) * east + sf * ct * down,
        (cf * st * cp + sf * sp) * north + (cf * st * sp - sf * cp) * east + cf * ct * down,
    )
