"""The pilot's hands and what the radio makes of them: sticks, pulse widths, servo commands.

Parts of the flight's kernel; `held` (9,) is what they remember between receiver frames: the sticks
(elevator, aileron, rudder, throttle), how far each wanders, and the pitch attitude to hold.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from host.aircraft.airframe import DOWN, EAST, NORTH, Q0, Q1, Q2, Q3, Array
from host.aircraft.rigid_body import rotate_to_body, rotate_to_ned
from host.compiled import compiled_part
from host.constants import GRAVITY_MPS2
from host.twin.flight.pilot import NOWHERE_M, Orders

# Futaba: neutral 1520 us, +-400 us full throw.
NEUTRAL_US = 1520.0
THROW_US = 400.0
IDLE_US = 1120.0
STEER_RAD = 0.35  # bank with which the pilot steers at the aim, where a turn has none of its own
GAP_US = 300.0  # between the pulses of a sequential receiver
LINK_OK, LINK_LOST, LINK_PRESET = 0, 1, 2  # state of the radio in one receiver frame


class Hands(NamedTuple):
    """Numbers of pilot, radio and servos that the kernel needs."""

    bank_gain: float
    pitch_gain: float
    height_gain_radpm: float
    speed_gain_smpm: float
    delay_steps: int
    remnant_rad: float
    jitter_us: float
    period_steps: int
    ground_steps: int
    cut_step: int
    height_m: float
    servo_gain: Array  # elevator, aileron, rudder: real deflection over commanded deflection
    servo_zero_rad: Array
    servo_late_us: float


class Radio(NamedTuple):
    """What the radio and the logger do: `link` (frames,) says how the radio does, `preset_us` (5,)
    what the receiver puts out without it, `added_us` (n, 3) or (0, 3) what the logger adds to
    aileron, elevator and rudder.
    """

    link: NDArray[np.int64]
    preset_us: Array
    added_us: Array


@compiled_part
def attitude_held(hands: Hands, orders: Orders, wind: Array, s: Array, i: int, held: Array) -> None:
    """Move the sticks towards what is wanted at step i, by the state s that is seen."""
    phi = math.atan2(
        2 * (s[Q2] * s[Q3] + s[Q0] * s[Q1]),
        s[Q0] ** 2 - s[Q1] ** 2 - s[Q2] ** 2 + s[Q3] ** 2,
    )
    sine = min(max(-2 * (s[Q1] * s[Q3] - s[Q0] * s[Q2]), -1.0), 1.0)
    theta = math.asin(sine)
    # A pilot judges airspeed by sound and response, so gusts are left out.
    su, sv, sw = rotate_to_body(s, wind[0], wind[1], wind[2])
    seen = math.sqrt((s[0] - su) ** 2 + (s[1] - sv) ** 2 + (s[2] - sw) ** 2)
    weight = orders.attention[i]
    slow = orders.airspeed_mps[i] - seen
    wish = held[8]
    if i < hands.cut_step:
        wish += min(max(hands.height_gain_radpm * (hands.height_m + s[DOWN]), -0.15), 0.15)
    else:
        wish += min(max(-0.2 - 0.03 * slow, -0.5), 0.1)
    held[0] += weight * hands.pitch_gain * (wish - theta)
    bank = orders.bank_rad[i]
    if len(orders.aim_m) > 0 and orders.aim_m[i, 0] < NOWHERE_M:
        north, east, _ = rotate_to_ned(s, s[0], s[1], s[2])
        to_north, to_east = orders.aim_m[i, 0] - s[NORTH], orders.aim_m[i, 1] - s[EAST]
        off = math.atan2(to_east, to_north) - math.atan2(east, north)
        off = math.atan2(math.sin(off), math.cos(off))
        most = bank if bank > 0.0 else STEER_RAD
        circle_m = 2.0 * seen**2 / (GRAVITY_MPS2 * math.tan(most))
        # An aim that was passed a moment ago is not turned back to.
        if abs(off) < 0.5 * math.pi or math.hypot(to_north, to_east) > circle_m:
            bank = min(max(off, -most), most)
        else:
            bank = 0.0
    held[1] += weight * hands.bank_gain * (bank - phi)
    held[3] += weight * hands.speed_gain_smpm * slow


@compiled_part
def sticks_moved(
    hands: Hands,
    orders: Orders,
    trimmed: Array,
    limit_rad: Array,
    wind: Array,
    states: Array,
    x: Array,
    i: int,
    noise: Array,
    held: Array,
) -> None:
    """Put the sticks where a new receiver frame at step i finds them; the pilot sees late."""
    flying = i >= hands.ground_steps
    for k in range(4):
        held[4 + k] += 0.02 * (-held[4 + k] + hands.remnant_rad * 10.0 * noise[4 + k])
        held[k] = trimmed[k] + orders.program[i, k] + held[4 + k] * (1.0 if flying else 0.0)
    if flying:
        j = max(i - hands.delay_steps, hands.ground_steps)
        attitude_held(hands, orders, wind, states[j] if j < i else x, i, held)
    for k in range(3):
        held[k] = min(max(held[k], -limit_rad[k]), limit_rad[k])
    held[3] = min(max(held[3], 0.0), 1.0)
    if not flying:
        held[3] = 0.0


@compiled_part
def pulse_widths(
    hands: Hands,
    radio: Radio,
    limit_rad: Array,
    held: Array,
    switch_us: float,
    noise: Array,
    row: int,
    pulses_us: Array,
) -> None:
    """Write the widths of one receiver frame (5,): aileron, elevator, rudder, throttle, switch."""
    # Trim tabs were set before the test: neutral is where the surface stands straight.
    zero = hands.servo_zero_rad
    pulses_us[0] = NEUTRAL_US + THROW_US * (held[1] - zero[1]) / limit_rad[1]
    pulses_us[1] = NEUTRAL_US + THROW_US * (held[0] - zero[0]) / limit_rad[0]
    pulses_us[2] = NEUTRAL_US + THROW_US * (held[2] - zero[2]) / limit_rad[2]
    pulses_us[3] = IDLE_US + 2.0 * THROW_US * held[3]
    pulses_us[4] = switch_us
    for k in range(5):
        pulses_us[k] += hands.jitter_us * noise[8 + k]
        if radio.link[row] == LINK_PRESET:
            pulses_us[k] = radio.preset_us[k]


@compiled_part
def servo_commands(
    hands: Hands,
    radio: Radio,
    limit_rad: Array,
    pulses_us: Array,
    since_us: float,
    row: int,
    i: int,
    command: Array,
) -> None:
    """Command each servo whose pulse of this frame has ended `since_us` after its start."""
    end = 0.0
    for k in range(4):
        end += pulses_us[k]
        if radio.link[row] == LINK_LOST:
            command[3] = 0.0  # without pulses a servo stays, a speed controller stops
        elif k == 3:
            if since_us >= end:
                command[3] = (pulses_us[3] - IDLE_US) / (2.0 * THROW_US)
        elif since_us >= end + hands.servo_late_us:
            j = 1 - k if k < 2 else 2  # the receiver's first channel is the aileron
            width_us = pulses_us[k] + (radio.added_us[i, k] if len(radio.added_us) > 0 else 0.0)
            asked_rad = (width_us - NEUTRAL_US) / THROW_US * limit_rad[j]
            asked_rad += hands.servo_zero_rad[j]
            command[j] = hands.servo_gain[j] * asked_rad
        end += GAP_US
    if i >= hands.cut_step or i < hands.ground_steps:
        command[3] = 0.0
