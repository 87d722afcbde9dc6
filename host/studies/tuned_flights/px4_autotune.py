"""Gains as PX4's fixed-wing autotune makes them of an aircraft: its published rule, noise left out.

A discrete model of two poles is fitted to torque and rate behind the autotune's filters; the rule
(fw_autotune_attitude_control.cpp, lib/pid_design: Yamamoto, Fujii & Kaneda 1998) makes gains of it.
The model answers one aircraft without noise: better than a log would give it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from host.arrays import Array
from host.control.autopilots.px4 import share_per_torque
from host.control.plant import Plant
from host.control.scenarios import Problem, draw
from scipy.signal import butter, lfilter

HIGH_PASS_HZ, LOW_PASS_HZ = 0.5, 40.0  # of the autotune, and IMU_GYRO_CUTOFF
SECONDS, HOLD_S, SEED = 20.0, 0.15, 48
RISE_S, DETUNING, INTEGRAL_SHARE = 0.2, 0.4, 5.0  # of the rule
LARGEST_ERROR_RAD = math.radians(60.0)  # that full output answers
ATTITUDE_PS = (1.0, 5.0)


def autotuned(problem: Problem) -> dict[str, float]:
    """Return the gains that the autotune makes of a problem's mean aircraft at its trim."""
    axis, drive = problem.axis, problem.actuator
    known = replace(
        problem,
        axis=replace(axis, covariance=np.zeros_like(axis.covariance)),
        actuator=replace(drive, travel_share=0.0, bandwidth_share=0.0, delay_sd_s=0.0),
        airspeeds_mps=(axis.trim.airspeed_mps,),
    )
    ((mean,),) = draw(known, seed=0, count=1).of_speed
    share = share_per_torque(axis.axis, {})
    return gains(fitted(mean.plant, share), problem.period_s)


def fitted(plant: Plant, torque_share: float) -> Array:
    """Return a1, a2, b0, b1, b2 of the rate's answer to torque.

    Parameters
    ----------
    plant : Plant
        From share of travel to angle and rate.
    torque_share : float
        Share of travel per unit of torque.
    """
    steps = round(SECONDS / plant.period_s)
    held = round(HOLD_S / plant.period_s)
    rng = np.random.default_rng(SEED)
    torque = np.repeat(rng.choice([-0.1, 0.1], steps // held + 1), held)[:steps]
    state, rate = np.zeros(len(plant.a)), np.empty(steps)
    for k in range(steps):
        rate[k] = plant.c[1] @ state
        state = plant.a @ state + plant.b[:, 0] * torque[k] * torque_share
    rate_hz = 1.0 / plant.period_s
    low, high = butter(2, LOW_PASS_HZ, fs=rate_hz), butter(1, HIGH_PASS_HZ, "high", fs=rate_hz)
    for b, a in (low, high):
        torque, rate = lfilter(b, a, torque), lfilter(b, a, rate)
    rows = np.column_stack([-rate[2:-1], -rate[1:-2], torque[2:-1], torque[1:-2], torque[:-3]])
    return np.asarray(np.linalg.lstsq(rows, rate[3:], rcond=None)[0])


def gains(model: Array, period_s: float) -> dict[str, float]:
    """Return FF, P, I, D and TC of a model: P and I for unit static gain, as PX4 saves them.

    Parameters
    ----------
    model : Array
        a1, a2, b0, b1, b2 per unit of torque.
    period_s : float
    """
    a1, a2 = model[:2].tolist()
    feed_forward = (1.0 + a1 + a2) / float(model[2:].sum())
    total = float(model[2:].sum()) * feed_forward
    rho, mu = period_s / RISE_S, 0.25
    p1, p2 = -2.0 * math.exp(-rho / (2.0 * mu)), math.exp(-rho / mu)
    e1 = 1.0 - a1 + p1
    f0 = -a1 * e1 + a1 - a2 + e1 + p2
    f1 = a1 * e1 - a2 * e1 + a2
    f2 = a2 * e1
    p = -(f1 + 2.0 * f2) / (DETUNING + (e1 + 1.0) * total)
    i = -(f0 + f1 + f2) / (period_s * (f1 + 2.0 * f2)) / INTEGRAL_SHARE
    attitude = min(max(1.0 / (LARGEST_ERROR_RAD * (p + feed_forward)), ATTITUDE_PS[0]),
                   ATTITUDE_PS[1])  # fmt: skip
    return {"FF": feed_forward, "P": p, "I": p * i, "D": 0.0, "TC": 1.0 / attitude}
