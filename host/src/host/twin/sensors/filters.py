"""Small compiled filters that the sensor models share."""

from __future__ import annotations

import math

import numpy as np

from host.aircraft.airframe import Array
from host.compiled import compiled_fast

# At 1 kHz one Euler step per sample shifts the damping of a 14 Hz vane by 4 %, eight by 0.5 %.
VANE_SUBSTEPS = 8


@compiled_fast
def first_order(x: Array, tau_s: float, step_s: float) -> Array:
    """Return a first-order lag of x (n,), exact for an input straight between samples; starts
    settled.

    An input held over each step would come out half a step later than `tau_s` says.
    """
    y = np.empty_like(x)
    y[0] = x[0]
    go_on_first_order(x, y, 1, x.shape[0], tau_s, step_s)
    return y


@compiled_fast
def go_on_first_order(
    x: Array, y: Array, first: int, last: int, tau_s: float, step_s: float
) -> None:
    """Fill y[first:last] of `first_order`, whose samples before are there."""
    if tau_s <= 0.0:
        y[first:last] = x[first:last]
        return
    keep = math.exp(-step_s / tau_s)
    mean = (1.0 - keep) * tau_s / step_s
    for i in range(first, last):
        y[i] = keep * y[i - 1] + (mean - keep) * x[i - 1] + (1.0 - mean) * x[i]


@compiled_fast
def vane(
    target_rad: Array,
    airspeed_mps: Array,
    frequency_hz_per_mps: float,
    damping: float,
    friction_rad: float,
    reference_mps: float,
    step_s: float,
) -> Array:
    """Return the angle of a vane (n,) that follows the flow.

    Second order with a natural frequency in proportion to airspeed; dry friction holds it within
    `friction_rad` at `reference_mps`, by the inverse of dynamic pressure at other speeds. The flow
    turns evenly between samples: behind a steady turn the vane lags by 2 damping / omega, no more.
    """
    out = np.empty_like(target_rad)
    part_s = step_s / VANE_SUBSTEPS
    last = target_rad.shape[0] - 1
    angle, rate = target_rad[0], 0.0
    for i in range(target_rad.shape[0]):
        out[i] = angle
        turn = (target_rad[min(i + 1, last)] - target_rad[i]) / VANE_SUBSTEPS
        speed = max(airspeed_mps[i], 1.0)
        omega = 2.0 * math.pi * frequency_hz_per_mps * speed
        stiffness = omega * omega
        dry = stiffness * friction_rad * (reference_mps / speed) ** 2
        if airspeed_mps[i] < 1.0:
            angle, rate = target_rad[i], 0.0
            continue
        for k in range(VANE_SUBSTEPS):
            push = stiffness * (target_rad[i] + k * turn - angle)
            rate += part_s * (push - 2.0 * damping * omega * rate)
            # Dry friction takes at most the speed the vane has: then it stands until pushed harder.
            brake = part_s * dry
            if abs(rate) <= brake:
                rate = 0.0
            else:
                rate -= math.copysign(brake, rate)
            angle += part_s * rate
    return out


@compiled_fast
def cross(a: Array, b: Array) -> Array:
    """Return a x b of (n, 3) and (n, 3) or (1, 3); numpy's own takes five times as long."""
    out = np.empty_like(a)
    last = b.shape[0] - 1
    for i in range(a.shape[0]):
        j = min(i, last)
        out[i, 0] = a[i, 1] * b[j, 2] - a[i, 2] * b[j, 1]
        out[i, 1] = a[i, 2] * b[j, 0] - a[i, 0] * b[j, 2]
        out[i, 2] = a[i, 0] * b[j, 1] - a[i, 1] * b[j, 0]
    return out


def delayed(t_s: Array, x: Array, delay_s: float, at_s: Array) -> Array:
    """Return x (n,) or (n, k), `delay_s` late, at the times `at_s`, linear between samples."""
    if x.ndim == 1:
        return np.interp(at_s - delay_s, t_s, x)
    return np.column_stack([np.interp(at_s - delay_s, t_s, x[:, k]) for k in range(x.shape[1])])
