"""The flight's kernel: aircraft, air, pilot and radio from one millisecond to the next."""

from __future__ import annotations

import math

import numpy as np

from host.aircraft.air import Atmosphere, Turbulence, density_kgpm3, gust_step
from host.aircraft.airframe import DOWN, STATE_COUNT, Airframe, Array, P
from host.aircraft.rigid_body import gust_in_body, rotate_to_body, step
from host.compiled import compiled_fast
from host.twin.flight.pilot import Orders
from host.twin.flight.stick_commands import (
    Hands,
    Radio,
    pulse_widths,
    servo_commands,
    sticks_moved,
)


@compiled_fast
def fly_steps(
    frame: Airframe,
    hands: Hands,
    orders: Orders,
    radio: Radio,
    atmosphere: Atmosphere,
    turbulence: Turbulence,
    trimmed: Array,
    launch: Array,
    rest: Array,
    wind: Array,
    noise: Array,
    stick_noise: Array,
    step_s: float,
    first: int,
    last: int,
    x: Array,
    z: Array,
    held: Array,
    command: Array,
    states: Array,
    more: Array,
    air: Array,
    pulses_us: Array,
) -> int:
    """Integrate steps first..last; return how many were flown before the ground was touched.

    `rest` (m, 17) are the states on the ground, the last one for as long as it lasts.
    `more` (n, 8) takes specific force, angular acceleration, thrust, density; `held` is as in
    `stick_commands`, the rest as in `FlightRecord`.
    """
    work = np.empty((5, STATE_COUNT + 4))
    now, gust = np.zeros(9), np.zeros(6)
    limit_rad = frame.surface_limit_rad
    for i in range(first, last):
        if i == hands.ground_steps:
            x[:] = launch
            command[:] = trimmed
        flying = i >= hands.ground_steps
        if flying and x[DOWN] > 0.0:
            return i
        rho = density_kgpm3(atmosphere, -x[DOWN])
        for k in range(3):
            now[k] = wind[k]
        wu, wv, ww = rotate_to_body(x, wind[0], wind[1], wind[2])
        ua, va, wa = x[0] - wu - now[3], x[1] - wv - now[4], x[2] - ww - now[5]
        speed = math.sqrt(ua * ua + va * va + wa * wa)
        if turbulence.sigma_w_mps > 0.0 and flying:
            gust_step(turbulence, z, noise[i], speed, frame.span_m, step_s, gust)
            now[3], now[4], now[5] = gust_in_body(x, gust, wind)
            now[6:] = gust[3:]

        row = i // hands.period_steps
        if i % hands.period_steps == 0:  # a new receiver frame
            sticks_moved(
                hands, orders, trimmed, limit_rad, wind, states, x, i, stick_noise[row], held
            )
            pulse_widths(
                hands,
                radio,
                limit_rad,
                held,
                orders.switch_us[i],
                stick_noise[row],
                row,
                pulses_us[row],
            )
        since_us = (i % hands.period_steps) * step_s * 1e6
        servo_commands(hands, radio, limit_rad, pulses_us[row], since_us, row, i, command)

        states[i] = x
        air[i] = now
        more[i, 7] = rho
        if flying:
            step(frame, x, command, now, rho, step_s, work)
            more[i, 0:3] = work[0, STATE_COUNT : STATE_COUNT + 3]
            more[i, 3:6] = work[0, P : P + 3]
            more[i, 6] = work[0, STATE_COUNT + 3]
        else:
            x[:] = rest[min(i, len(rest) - 1)]
            gx, gy, gz = rotate_to_body(x, 0.0, 0.0, frame.gravity_mps2)
            more[i, 0], more[i, 1], more[i, 2] = -gx, -gy, -gz
            more[i, 3:7] = 0.0
    return last
