"""What one sine on one surface says of an aircraft in gusts, and how far it moves it.

Each moment equation is a regression in the frequency domain: a tone of amplitude a over T seconds
adds ``a^2 T Re(G G*) / S`` to the information on the derivatives of a row, with G what the row's
regressors answer to the surface at that frequency and S the spectrum of the row's disturbance:
Dryden gusts (MIL-F-8785C 3.7.2) and sensor noise. Information is linear in a^2, so that a design
is a choice of powers (Mehra, IEEE TAC 19, 1974; Klein & Morelli, Aircraft System Identification,
ch. 9).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from host.aircraft.airframe import Array
from host.aircraft.file import Aircraft
from host.aircraft.linearisation import linearise
from host.aircraft.trim import solve
from host.arrays import IntArray

ComplexArray = NDArray[np.complex128]
SAMPLE_S, FRAME_S = 0.01, 0.020
GYRO_NOISE_RADPS, VANE_NOISE_RAD = 0.0008, 0.0008  # white, at 100 Hz
LENGTH_M = 100.0  # of the gusts, at 100 m of height
# Variance of L_p and L_da as the default method states it, over that of this theory: 4 to 9 on
# three flights; of the other rows 0.3 to 2.
ROLL_EXCESS = 6.0
BLOCKS = {"longitudinal": ("elevator",), "lateral": ("aileron", "rudder")}
# Largest changes from trim that one point may make: those of a trainer's first test flights.
LIMITS = {
    "longitudinal": {"alpha_rad": 3.5, "theta_rad": 12.0, "q_radps": 60.0},
    "lateral": {"beta_rad": 6.0, "phi_rad": 30.0, "p_radps": 120.0, "r_radps": 60.0},
}  # degrees
# Derivatives of the verdict, as rows and columns of a block's equations.
WANTED = {
    "longitudinal": ((0, 0), (1, 0), (1, 1), (1, 2)),  # Z_alpha; M_alpha, M_q, M_de
    "lateral": ((0, 1), (0, 3), (1, 0), (1, 2), (1, 4)),  # L_p, L_da; N_beta, N_r, N_dr
}


@dataclass(frozen=True, slots=True)
class ToneTable:
    """Tones of one block of axes on one aircraft; arrays over tones first.

    Attributes
    ----------
    axis : (k,) array of int
        Which of the block's surfaces.
    frequency_hz : (k,) array
    information : (k, rows, n, n) array
        Information of unit amplitude (rad) over one second.
    value : (rows, n) array
        The derivatives themselves; nuisance parameters among them.
    response : (k, channels) complex array
        Response of the channels of `LIMITS` and of the surface and its rate, over their limits.
    """

    axis: IntArray
    frequency_hz: Array
    information: Array
    value: Array
    response: ComplexArray


def tone_table(
    aircraft: Aircraft, block: str, airspeed_mps: float, gusts_mps: float, frequency_hz: Array
) -> ToneTable:
    """Return information and response of tones on every surface of a block.

    Parameters
    ----------
    aircraft : Aircraft
    block : str
        A key of `BLOCKS`.
    airspeed_mps, gusts_mps : float
        Trim, and standard deviation of the vertical gust.
    frequency_hz : (m,) array
    """
    frame = aircraft.airframe()
    linear = linearise(frame, solve(frame, airspeed_mps))
    long = block == "longitudinal"
    a = linear.longitudinal_a if long else linear.lateral_a
    b = linear.longitudinal_b if long else linear.lateral_b
    place = 1 if long else 0  # of the velocity across the flow
    scale = np.ones(4)
    scale[place] = 1.0 / airspeed_mps  # w and v as alpha and beta
    a, b = scale[:, None] * a / scale, scale[:, None] * b
    omega = np.tile(2.0 * math.pi * frequency_hz, b.shape[1])
    axis = np.repeat(np.arange(b.shape[1]), len(frequency_hz))
    s = 1j * omega
    # A servo of first order behind a pulse that is held over a frame.
    drive = np.exp(-0.5 * s * FRAME_S) / (1.0 + s / frame.servo_bandwidth_radps)
    inverse = np.linalg.inv(s[:, None, None] * np.eye(4) - a)
    states = np.einsum("kij,jk->ki", inverse, b[:, axis]) * drive[:, None]
    surfaces = drive[:, None] * np.eye(b.shape[1])[axis]
    columns = [place, 2] if long else [0, 1, 2]  # alpha, q; beta, p, r
    regressors = np.hstack([states[:, columns], surfaces])
    rows = (1, 2)  # forces across and pitch; roll and yaw
    value = np.array([np.concatenate([a[row, columns], b[row]]) for row in rows])
    noise = _disturbance(a, rows, columns, omega, airspeed_mps, gusts_mps, frame.span_m)
    each = np.real(regressors[:, :, None] * np.conj(regressors[:, None, :]))
    return ToneTable(
        axis, omega / (2.0 * math.pi), each[:, None] / noise[:, :, None, None], value,
        _responses(aircraft, block, states, drive, axis, omega),
    )  # fmt: skip


def _disturbance(
    a: Array, rows: tuple[int, ...], columns: list[int], omega: Array, speed: float, gusts: float,
    span_m: float,
) -> Array:  # fmt: skip
    """Return one-sided spectra of the disturbance of each row, per Hz (k, rows)."""
    x = LENGTH_M * omega / speed
    across = gusts**2 * 2.0 * LENGTH_M / speed * (1.0 + 3.0 * x**2) / (1.0 + x**2) ** 2
    near = 1.0 + (4.0 * span_m * omega / math.pi / speed) ** 2  # gusts smaller than the span
    turning = across * (omega / speed) ** 2 / near
    length = (math.pi * LENGTH_M / 4.0 / span_m) ** (1.0 / 3.0) / LENGTH_M
    rolling = 2.0 * math.pi / speed * 0.8 * gusts**2 * length / near
    gyro, vane = (2.0 * SAMPLE_S * sd**2 for sd in (GYRO_NOISE_RADPS, VANE_NOISE_RAD))
    found = []
    for row in rows:
        total = a[row, columns[0]] ** 2 * (across / speed**2 + vane) + omega**2 * gyro
        for k, column in enumerate(columns[1:]):
            roll = len(columns) == 3 and k == 0
            total += a[row, column] ** 2 * (rolling if roll else turning)
        found.append(total * (ROLL_EXCESS if len(columns) == 3 and row == 1 else 1.0))
    return np.array(found).T


def _responses(
    aircraft: Aircraft,
    block: str,
    states: ComplexArray,
    drive: ComplexArray,
    axis: IntArray,
    omega: Array,
) -> ComplexArray:
    names = ("u", "alpha_rad", "q_radps", "theta_rad")
    names = names if block == "longitudinal" else ("beta_rad", "p_radps", "r_radps", "phi_rad")
    parts: list[ComplexArray] = [
        states[:, names.index(n)] / math.radians(x) for n, x in LIMITS[block].items()
    ]
    rate = aircraft.scalar("servo.rate_limit_radps")
    for k, surface in enumerate(BLOCKS[block]):
        own: ComplexArray = np.where(axis == k, drive, 0.0 + 0.0j)
        parts += [own / (0.5 * aircraft.scalar(f"surfaces.{surface}_limit_rad"))]
        parts += [1j * omega * own / (0.5 * rate)]
    return np.array(parts).T
