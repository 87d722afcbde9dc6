"""The logger's frames of a walk: counts with every tolerance drawn, as the radio sends them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from host.aircraft.airframe import Array
from host.constants import DEG_PER_RAD, GRAVITY_MPS2, RAD_PER_DEG
from host.twin.faults import PITOTS, POTS, RECEIVER, VANES
from host.twin.flight.draws import Draws, draw
from host.twin.flight.stick_commands import NEUTRAL_US, THROW_US
from host.twin.ground.ground_walk import STEP_S, SURFACES, SWITCH_MEGA_US, GroundWalk
from host.twin.sensors.analog import CHANNELS, DRIFT_TAU_S, NOISE_COUNT, nominal
from host.twin.sensors.filters import first_order
from host.wire.framing import SCHEMA_HASH_ID, envelope
from host.wire.schema import Schema
from host.wire.schema_text import packed_schema

START_US = 4_000_000
HASH_EVERY_US = 5_000_000
GYRO_NOISE_DEGPS = 0.05  # MPU-6000 behind its 20 Hz filter
ACCEL_NOISE_MPS2 = 0.02
PRESSURE_NOISE_PA = 3.0
ENGAGE_S = 0.15  # the switch settles, the contact closes
RAIL_DIVIDER, RAIL_FULL = 2.0, 4096.0


@dataclass(slots=True)
class GroundFrames:
    """Frames of a walk, raw; a fault may alter them before they are sent.

    Attributes
    ----------
    schema : Schema
    ident : structured array (n,)
    slow : dict of str to structured array
    kept : (n,) array of bool
        Identification frames that the radio brings.
    """

    schema: Schema
    ident: Any
    slow: dict[str, Any]
    kept: np.ndarray[tuple[int], np.dtype[np.bool_]]

    def timed(self) -> list[tuple[int, bytes]]:
        """Return time (us) and envelope of everything the radio brings, in order."""
        schema_frame = envelope(bytes([SCHEMA_HASH_ID]) + self.schema.hash.to_bytes(4, "little"))
        parts = [
            (START_US + at, schema_frame)
            for at in range(0, len(self.ident) * 50_000, HASH_EVERY_US)
        ]
        offset = int(self.ident["t_us"][0]) - START_US  # a clock that wraps in the walk
        for rows in (self.ident[self.kept], *self.slow.values()):
            times = ((rows["t_us"].astype(np.int64) - offset) % (1 << 32)).tolist()
            parts += [(at, envelope(row.tobytes())) for at, row in zip(times, rows, strict=True)]
        return sorted(parts, key=lambda part: part[0])

    def stream(self, windows: list[tuple[str, int, int]]) -> Iterator[tuple[str, bytes]]:
        """Yield each item of a walk and what the radio brings in its window."""
        parts, at = self.timed(), 0
        for item, _, end in windows:
            first, end_us = at, START_US + end * STEP_S * 1e6
            while at < len(parts) and parts[at][0] < end_us:
                at += 1
            yield item, b"".join(data for _, data in parts[first:at])


def surface_angles(walk: GroundWalk, draws: Draws) -> dict[str, Array]:
    """Return the true angle of each pot's surface, deg: servos with their errors and their lag."""
    out = {}
    for k, surface in enumerate(SURFACES):
        limit = walk.limit_deg(surface)
        share = walk.surface_share[surface] * (1.0 + draws.vector("servo_scale_share")[k])
        asked = limit * walk.stick[surface] * share
        angle = first_order(asked, 0.04, STEP_S) + draws.vector("servo_zero_rad")[k] * DEG_PER_RAD
        out[surface] = angle
    return {
        "pot_elevator": out["elevator"],
        "pot_aileron_left": out["aileron"],
        "pot_aileron_right": -out["aileron"],
        "pot_rudder": out["rudder"],
    }


def ground_frames(walk: GroundWalk) -> GroundFrames:
    """Return the frames of a walk from a healthy logger with drawn tolerances.

    Parameters
    ----------
    walk : GroundWalk
        Its generator goes on.
    """
    rng, schema = walk.rng, packed_schema()
    draws = draw(walk.aircraft, rng, tolerances=True)
    count = len(walk.t_s)
    ident = np.zeros(count, schema.by_name["ident"].dtype)
    ident["id"] = schema.by_name["ident"].id
    ident["t_us"] = START_US + np.round(walk.t_s * 1e6).astype(np.uint32)
    ident["count"] = np.arange(count) * 5
    ident["valid"] = sum(
        schema.bit("valid", name)
        for name in (*VANES, *PITOTS, *POTS, "imu_fresh", "imu_unsaturated", "attitude",
                     "imu_triggered")
    )  # fmt: skip
    _analog(walk, draws, ident)
    _inertial(walk, draws, ident)
    _receiver(walk, ident)
    _relay(schema, ident)
    kept = rng.random(count) >= rng.uniform(0.0, 0.015)
    return GroundFrames(schema, ident, _slow(walk, schema, ident), kept)


def _analog(walk: GroundWalk, draws: Draws, ident: Any) -> None:
    scale, rng = nominal(), walk.rng
    true: dict[str, Array] = {}
    for k, name in enumerate(VANES):
        share, zero = draws.vector("vane_scale_share")[k], draws.vector("vane_zero_rad")[k]
        true[name] = walk.vane_deg[name] * RAD_PER_DEG * (1.0 + share) + zero
    for k, (name, side) in enumerate(zip(PITOTS, "ab", strict=True)):
        true[name] = walk.blown_pa[side] * (1.0 + draws.vector("pitot_scale_share")[k])
        drift = draws.vector("pitot_drift_count")[k] * (1.0 - np.exp(-walk.t_s / DRIFT_TAU_S))
        true[name] = true[name] + drift * scale[name][1]
    for k, (name, angle) in enumerate(surface_angles(walk, draws).items()):
        share, zero = draws.vector("pot_scale_share")[k], draws.vector("pot_zero_rad")[k]
        true[name] = angle * RAD_PER_DEG * (1.0 + share) + zero
    for name in CHANNELS:
        zero, slope = scale[name]
        noise = NOISE_COUNT[name.split("_")[0]] * rng.standard_normal((4, len(ident)))
        counts = np.floor(zero + true[name] / slope + noise + 0.5)
        ident[name] = np.clip(counts, 0.0, 1023.0).sum(axis=0).astype(np.uint16)


def _inertial(walk: GroundWalk, draws: Draws, ident: Any) -> None:
    rng, count = walk.rng, len(ident)
    level = rng.uniform(-1.0, 1.0, 2)  # levelled by eye
    rates = np.gradient(walk.turn_deg, STEP_S, axis=1)
    crooked = draws.vector("misalignment_rad")
    roll = (walk.turn_deg[0] + level[0]) * RAD_PER_DEG + crooked[0]
    pitch = (walk.turn_deg[1] + level[1]) * RAD_PER_DEG + crooked[1]
    force = GRAVITY_MPS2 * np.stack(
        [np.sin(pitch), -np.sin(roll) * np.cos(pitch), -np.cos(roll) * np.cos(pitch)]
    )
    bias, scale = draws.vector("gyro_bias_radps"), draws.vector("gyro_scale_share")
    for k, name in enumerate("pqr"):
        value = (1.0 + scale[k]) * rates[k] * RAD_PER_DEG + bias[k]
        value = value + rng.normal(0.0, GYRO_NOISE_DEGPS * RAD_PER_DEG, count)
        ident[name] = np.round(value / 2.664624812204e-4)
    bias, scale = draws.vector("accel_bias_mps2"), draws.vector("accel_scale_share")
    for k, name in enumerate(("ax", "ay", "az")):
        value = (1.0 + scale[k]) * force[k] + bias[k] + rng.normal(0.0, ACCEL_NOISE_MPS2, count)
        ident[name] = np.round(value / 1.197100830078e-3)
    for k, name in enumerate(("phi", "theta", "psi")):
        ident[name] = np.round(walk.turn_deg[k] * 100.0)


def _receiver(walk: GroundWalk, ident: Any) -> None:
    rng, on = walk.rng, walk.transmitter
    widths = {name: NEUTRAL_US + THROW_US * walk.stick[name] for name in SURFACES}
    widths |= {"throttle": walk.throttle_us, "switch": walk.switch_us}
    for name in RECEIVER:
        width = widths[name] + rng.normal(0.0, 0.7, len(ident))
        width = np.where(on, width, walk.preset_us[name] if walk.preset else 0.0)
        ident[f"rc_{name}"] = np.round(np.maximum(width, 0.0) * 2.0)
        if name != "switch":
            ident[f"servo_{name}"] = ident[f"rc_{name}"]


def _relay(schema: Schema, ident: Any) -> None:
    """Let the contact follow the switch."""
    mega = ident["rc_switch"] > 1.9 * SWITCH_MEGA_US  # ticks of half a microsecond
    late = round(ENGAGE_S / STEP_S)
    engaged = mega.copy()
    for k in range(1, late + 1):
        engaged[k:] &= mega[:-k]
    ident["valid"] |= np.where(engaged, schema.bit("valid", "mega_drives"), 0).astype(np.uint16)


def _slow(walk: GroundWalk, schema: Schema, ident: Any) -> dict[str, Any]:
    rng, end_s = walk.rng, len(ident) * STEP_S
    found = {}
    for name, every_s in (("baro", 0.2), ("gps", 0.2), ("system", 1.0), ("config", 5.0),
                          ("identity", 5.0), ("event", math.inf)):  # fmt: skip
        at = np.arange(rng.uniform(0.1, min(every_s, 3.0)), end_s, every_s)
        rows = np.zeros(0 if math.isinf(every_s) else len(at), schema.by_name[name].dtype)
        rows["id"] = schema.by_name[name].id
        rows["t_us"] = START_US + np.round(at[: len(rows)] * 1e6).astype(np.uint32)
        found[name] = rows
    _outside(walk, schema, found)
    _health(walk, schema, ident, found["system"])
    config = found["config"]
    config["rate_hz"], config["aircraft"] = 100, walk.aircraft.name.encode()
    config["switch_direct_max_us"], config["switch_mega_min_us"] = 1400, 1600
    config["throttle_idle_max_us"] = 1200
    config["gps_source"] = schema.number("gps_source", "ubx")
    found["identity"]["board"], found["identity"]["firmware"] = b"mega2560", b"1.0.0"
    return found


def _outside(walk: GroundWalk, schema: Schema, found: dict[str, Any]) -> None:
    rng, baro, gps = walk.rng, found["baro"], found["gps"]
    pressure = rng.uniform(93_000.0, 103_000.0) + rng.normal(0.0, PRESSURE_NOISE_PA, len(baro))
    baro["static_pressure"] = np.round(pressure / 0.0625)
    baro["raw_pressure"] = np.round(pressure * 3.0)
    baro["temperature"] = round(rng.uniform(-2.0, 33.0) * 100.0)
    gps["itow_ms"] = 288_000_000 + 200 * np.arange(len(gps))
    gps["latitude"] = round(rng.uniform(-60.0, 60.0) * 1e7)
    gps["longitude"] = round(rng.uniform(-180.0, 180.0) * 1e7)
    gps["fix"] = schema.number("gps_fix", "fix_3d")
    gps["satellites"] = rng.integers(7, 13)
    gps["h_accuracy"] = round(rng.uniform(1.5, 5.0) * 100.0)
    gps["ground_speed"] = np.round(np.abs(rng.normal(0.0, 0.1, len(gps))) * 100.0)


def _health(walk: GroundWalk, schema: Schema, ident: Any, system: Any) -> None:
    rng, seconds = walk.rng, np.arange(len(system))
    system["uptime_s"] = 20 + seconds
    sensors = ("imu", "baro", "gps", "receiver", "card", "telemetry")
    system["sensors"] = sum(schema.bit("sensors", name) for name in sensors)
    system["imu_packets"] = 200 * seconds
    system["rc_frame_us"] = 20_000
    rows = np.minimum((system["t_us"] - START_US) // 50_000, len(ident) - 1)
    drives = (ident["valid"][rows] & schema.bit("valid", "mega_drives")) != 0
    lost = ~walk.transmitter[rows]
    words = np.where(drives, "mega", np.where(lost, "direct_receiver_lost", "direct_switch"))
    system["drive"] = [schema.number("drive", str(word)) for word in words]
    supply_v = 5.0 * (1.0 + rng.uniform(-0.02, 0.02)) * (1.0 + rng.normal(0.0, 0.01))
    rest_v, sag_v = rng.uniform(5.0, 6.0), rng.uniform(0.02, 0.15)
    speed = np.abs([np.gradient(walk.stick[name], STEP_S) for name in SURFACES]).sum(axis=0)
    put_rail(system, rest_v - sag_v * np.minimum(speed[rows] / 4.0, 1.0), supply_v)


def working(walk: GroundWalk, system: Any) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return a mask of the frames `system` during which all servos are moving."""
    rows = walk.rows("supply")
    t_s = (system["t_us"] - START_US) * 1e-6
    return np.asarray((t_s > rows.start * STEP_S + 1.0) & (t_s < rows.stop * STEP_S - 0.5))


def put_rail(system: Any, rail_v: Any, supply_v: Any) -> None:
    """Set both voltages of frames `system`."""
    system["avcc_mv"] = np.round(np.asarray(supply_v) * 1e3)
    system["rail"] = np.round(np.asarray(rail_v) / RAIL_DIVIDER / supply_v * RAIL_FULL)
