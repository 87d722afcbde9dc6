"""Faults of the IMU on the ground."""

from __future__ import annotations

import numpy as np

from host.twin.ground.ground_fault import GroundFault as F
from host.twin.ground.ground_fault import event, one_of, row_after_rest
from host.twin.ground.ground_instrument import GroundFrames
from host.twin.ground.ground_walk import STEP_S, GroundWalk


def _imu_tilted(walk: GroundWalk) -> str:
    walk.turn_deg = walk.turn_deg.copy()
    walk.turn_deg[int(walk.rng.integers(2))] += walk.rng.uniform(8.0, 25.0) * walk.rng.choice(
        (-1.0, 1.0)
    )
    return "imu"


def _imu_frozen(walk: GroundWalk, frames: GroundFrames) -> str:
    first = row_after_rest(walk)
    for name in ("p", "q", "r", "ax", "ay", "az"):
        frames.ident[name][first:] = frames.ident[name][first]
    return "imu"


def _imu_off(walk: GroundWalk, frames: GroundFrames) -> str:
    first = row_after_rest(walk)
    for name in ("p", "q", "r", "ax", "ay", "az"):
        frames.ident[name][first:] = -32768
    return "imu"


def _imu_damaged(walk: GroundWalk, frames: GroundFrames) -> str:
    system, share = frames.slow["system"], walk.rng.uniform(0.01, 0.05)
    name = one_of(walk, ("imu_bad_packets", "imu_lost"))
    bad = np.cumsum(walk.rng.binomial(200, share, len(system)))
    system[name] = bad
    system["imu_packets"] -= bad.astype(np.uint16)
    return "imu"


def _imu_restarts(walk: GroundWalk, frames: GroundFrames) -> str:
    first = row_after_rest(walk)
    for name in ("p", "q", "r", "ax", "ay", "az"):
        frames.ident[name][first : first + 6] = -32768
    return event(walk, frames, "imu_restarted", 0, "imu", at_s=first * STEP_S)


def _imu_slow(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.slow["system"]["imu_packets"] //= 2
    return "imu"


def _accelerometer_weak(walk: GroundWalk, frames: GroundFrames) -> str:
    factor = walk.rng.choice((0.5, 0.85, 1.12, 2.0))
    for name in ("ax", "ay", "az"):
        frames.ident[name] = np.clip(np.round(frames.ident[name] * factor), -32000, 32000)
    return "imu"


def _gyro_zero(walk: GroundWalk, frames: GroundFrames) -> str:
    raw = walk.rng.uniform(1.7, 8.0) * 65.5 * walk.rng.choice((-1.0, 1.0))
    frames.ident[one_of(walk, ("p", "q", "r"))] += np.int16(raw)
    return "gyros"


def _gyro_dead(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.ident[one_of(walk, ("p", "q", "r"))] = int(walk.rng.integers(-20, 20))
    return "gyros"


def _gyro_saturated(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.ident[one_of(walk, ("p", "q", "r"))] = 32767
    bit = frames.schema.bit("valid", "imu_unsaturated")
    frames.ident["valid"] &= np.uint16(0xFFFF ^ bit)
    return "imu"


def _gyro_deaf(walk: GroundWalk, frames: GroundFrames) -> str:
    """Leave the noise of a gyro and take away its rate."""
    name, ident = one_of(walk, ("p", "q", "r")), frames.ident
    ident[name] = np.round(walk.rng.normal(0.0, 3.3, len(ident)))
    return "imu_turned"


def _gyro_reversed(walk: GroundWalk, frames: GroundFrames) -> str:
    name = one_of(walk, ("p", "q", "r"))
    frames.ident[name] = -frames.ident[name]
    return "imu_turned"


def _gyros_swapped(walk: GroundWalk, frames: GroundFrames) -> str:
    """Turn the IMU on its floor: x and y of gyros and accelerometers are exchanged."""
    ident = frames.ident
    for one, other in (("p", "q"), ("ax", "ay")):
        ident[one], ident[other] = ident[other].copy(), ident[one].copy()
    return "imu_turned"


FAULTS: dict[str, F] = {
    "imu_tilted": F("tilted", before=_imu_tilted),
    "imu_stuck": F("frozen", after=_imu_frozen),
    "imu_off": F("stale", after=_imu_off),
    "imu_damaged": F("damaged or lost", after=_imu_damaged),
    "imu_reset": F("restarted", after=_imu_restarts),
    "imu_slow": F("packets a second", after=_imu_slow),
    "accelerometer": F("accelerometer", after=_accelerometer_weak),
    "gyro_zero": F("at rest", after=_gyro_zero),
    "gyro_dead": F("dead axis", after=_gyro_dead),
    "gyro_saturated": F("range's end", after=_gyro_saturated),
    "gyro_deaf": F("", after=_gyro_deaf),
    "gyro_reversed": F("wrong direction", after=_gyro_reversed),
    "imu_mounted_turned": F("", after=_gyros_swapped),
}
