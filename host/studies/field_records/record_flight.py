"""A flight of the worn aircraft: the test inputs of `studies.foreign`, its pilot, its gusts."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from host.arrays import Array
from host.compiled import compiled_fast
from host.constants import GRAVITY_MPS2
from scipy.optimize import fsolve

from studies.field_records.ranges import Draw, scattered
from studies.field_records.worn_aeroplane import (
    DENSITY_KGPM3,
    SERVO_LIMIT_RADPS,
    STATES,
    SURFACES,
    WAY,
    Worn,
    motion,
    play,
    start,
)
from studies.foreign.aeroplane import TRAINER
from studies.foreign.flight import DURATION_S, HANDS_OFF_S, HEIGHT_M, INPUTS, SPEED_MPS
from studies.foreign.gust_field import BEHIND_M, STEP_M, gusts

RATE_HZ = 200  # of the simulation; records have half
STEP_S = 1.0 / RATE_HZ
COMMANDS = np.array([
    (surface, start_s + k * unit_s, start_s + (k + 1) * unit_s, math.radians(degrees) * sign)
    for surface, start_s, unit_s, degrees, signs in INPUTS
    for k, sign in enumerate(signs)
])  # fmt: skip
BUSY = np.array([(s - HANDS_OFF_S[0], s + HANDS_OFF_S[1]) for _, s, *_ in INPUTS])
# Rows of a flight: the 16 states, forces, V, alpha, beta, rates of p q r, surfaces, commands.
COLUMNS = 16 + 6 + 3 + 3 + 3


def drawn_aircraft(rng: np.random.Generator, by: Draw) -> Worn:
    """Return the aircraft of a flight, in trim at the speed of the flight."""
    plane = dataclasses.replace(TRAINER, **scattered(rng, TRAINER))
    force = 0.5 * DENSITY_KGPM3 * SPEED_MPS**2 * plane.area
    weight = plane.mass * GRAVITY_MPS2

    def left(x: Array, /) -> list[float]:
        alpha, thrust = float(x[0]), float(x[1])
        CL = plane.CL_0 + plane.CL_alpha * alpha
        CD = plane.CD_0 + plane.CD_CL2 * CL**2
        return [
            thrust * math.cos(alpha) - force * CD,
            force * CL + thrust * math.sin(alpha) - weight,
        ]

    alpha, thrust = (float(v) for v in fsolve(left, np.array([0.05, 3.0])))
    CL = plane.CL_0 + plane.CL_alpha * alpha
    own = {name: float(getattr(plane, name)) for name in Worn._fields if hasattr(plane, name)}
    return Worn(
        **own,
        trim_alpha=alpha,
        trim_lift=CL,
        trim_de=-0.03,
        throttle=thrust / (plane.static_thrust * (1.0 - SPEED_MPS / plane.pitch_speed)),
        lift_loss=by["lift_loss"],
        moment_change=by["moment_change"],
        downwash=by["downwash"],
        sidewash=by["sidewash"],
        tail_arm=by["tail_arm_chords"] * plane.chord,
        wash_lag=by["wash_lag"],
        servo=by["servo_radps"],
    )


def fly(a: Worn, by: Draw, rng: np.random.Generator) -> Array:
    """Return the rows of a flight at 200 Hz, (n, COLUMNS)."""
    air = gusts(rng, by["gust_mps"], "dryden", None)
    field = np.column_stack([air.u, air.v, air.w])
    rows = np.empty((round(DURATION_S * RATE_HZ), COLUMNS))
    width = math.radians(by["free_play_deg"])
    _fly(a, start(a, SPEED_MPS, HEIGHT_M), field, COMMANDS, BUSY, width, rows)
    return rows


@compiled_fast
def _fly(
    a: Worn, x: Array, field: Array, commands: Array, busy: Array, width: float, rows: Array
) -> None:
    surfaces = x[SURFACES : SURFACES + 3].copy()
    command, gust, trial = np.zeros(3), np.zeros(3), np.zeros(STATES)
    k1, k2, k3, k4 = np.zeros(22), np.zeros(22), np.zeros(22), np.zeros(22)
    for i in range(rows.shape[0]):
        t = i * STEP_S
        command[0], command[1], command[2] = a.trim_de, 0.0, 0.0
        for j in range(commands.shape[0]):
            if commands[j, 1] <= t < commands[j, 2]:
                command[int(commands[j, 0])] += commands[j, 3]
        alone = False
        for j in range(busy.shape[0]):
            alone = alone or busy[j, 0] < t < busy[j, 1]
        if not alone:
            command[0] += 0.5 * (x[7] - a.trim_alpha) + 0.08 * x[4]
            command[1] -= 0.5 * x[6] + 0.06 * x[3]
        place = (x[WAY] + BEHIND_M) / STEP_M
        at = int(place)
        for j in range(3):
            gust[j] = field[at, j] + (place - at) * (field[at + 1, j] - field[at, j])
            rate = a.servo * (command[j] - x[SURFACES + j])
            rate = min(max(rate, -SERVO_LIMIT_RADPS), SERVO_LIMIT_RADPS)
            x[SURFACES + j] += STEP_S * rate
            surfaces[j] = play(surfaces[j], x[SURFACES + j], width)
        motion(a, x, surfaces, gust, k1)
        rows[i, :16] = x
        rows[i, 16:22] = k1[16:22]
        rows[i, 22:25] = k1[3:6]
        rows[i, 25:28] = surfaces
        rows[i, 28:31] = command
        for j in range(STATES):
            trial[j] = x[j] + 0.5 * STEP_S * k1[j]
        motion(a, trial, surfaces, gust, k2)
        for j in range(STATES):
            trial[j] = x[j] + 0.5 * STEP_S * k2[j]
        motion(a, trial, surfaces, gust, k3)
        for j in range(STATES):
            trial[j] = x[j] + STEP_S * k3[j]
        motion(a, trial, surfaces, gust, k4)
        for j in range(STATES):
            x[j] += STEP_S / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j])
