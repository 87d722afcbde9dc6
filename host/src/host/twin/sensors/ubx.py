"""GPS messages of a u-blox 6: NAV-POSLLH, NAV-VELNED and NAV-SOL of each epoch.

u-blox 6 receiver description, GPS.G6-SW-10018, chapter 35. Checksum: 8-bit Fletcher.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

import numpy as np

from host.aircraft.airframe import DOWN, NORTH, Array
from host.constants import EARTH_RADIUS_M
from host.twin.faults import Fault
from host.twin.flight.fly import STEP_S, FlightRecord
from host.twin.sensors.sensor_delays import dlpf_for, sensor_delays

RATE_HZ = 5.0
POSITION_NOISE_M = 0.4  # epoch to epoch; the slow error is drawn once per flight
VELOCITY_NOISE_MPS = 0.1  # u-blox 6 data sheet
GEOID_M = 15.0
WEEK = 1876  # the week of the second flight's year, 2015
ROLLED_WEEK = 1024
WEEK_MS = 7 * 86_400_000
FIRST_ITOW_MS = 288_000_000
GARBAGE_SHARE = 0.1  # of the bytes, one bit each
FAR_DEG = 100.0  # 1e9 in the message's unit of 1e-7 deg


@dataclass(frozen=True, slots=True)
class Epoch:
    """One solution: when its first byte leaves the receiver, and the bytes."""

    t_s: float
    message: bytes


def packet(kind: int, payload: bytes) -> bytes:
    """Return one message of class NAV with sync, length and checksum."""
    body = struct.pack("<BBH", 0x01, kind, len(payload)) + payload
    a = b = 0
    for byte in body:
        a = (a + byte) & 0xFF
        b = (b + a) & 0xFF
    return b"\xb5\x62" + body + bytes((a, b))


@dataclass(frozen=True, slots=True)
class Fixes:
    """Solutions of the receiver: instants, latency, positions and velocities.

    Attributes
    ----------
    t_s : (n,) array
    late_s : float
    place_m, velocity_mps : (n, 3) arrays
        North, east, down; with noise.
    """

    t_s: Array
    late_s: float
    place_m: Array
    velocity_mps: Array


def fixes(record: FlightRecord, rng: np.random.Generator) -> Fixes:
    """Return every solution of a flight, faults left out.

    Parameters
    ----------
    record : FlightRecord
    rng : numpy Generator
    """
    switches, flight = record.card.sensors, record.card.flight
    at = np.arange(0.2, record.t_s[-1] - 0.01, 1.0 / RATE_HZ)
    place = record.states[:, NORTH : DOWN + 1]
    velocity = np.gradient(place, STEP_S, axis=0)
    # The jump from the stand to flight is no motion, so it must not show as velocity.
    velocity[np.abs(record.t_s - flight.ground_s) < 3 * STEP_S] = 0.0
    noise = rng.standard_normal((len(at), 6)) * (1.0 if switches.noise else 0.0)
    late = 0.0
    if switches.gps_latency:
        late = sensor_delays(record.aircraft, record.draws, dlpf_for(flight.rate_hz))["gps"]
    k = np.minimum(np.rint(at / STEP_S).astype(np.int64), len(place) - 1)
    wander = noise[:, :3] * POSITION_NOISE_M * np.array([1.0, 1.0, 2.0])
    return Fixes(
        t_s=at,
        late_s=late,
        place_m=place[k] + record.draws.vector("field_m") + wander,
        velocity_mps=velocity[k] + noise[:, 3:] * VELOCITY_NOISE_MPS,
    )


def epochs(record: FlightRecord, rng: np.random.Generator) -> list[Epoch]:
    """Return every epoch of a flight with noise and latency.

    Parameters
    ----------
    record : FlightRecord
    rng : numpy Generator
    """
    seen = fixes(record, rng)
    late = seen.late_s
    found = []
    for i, (t, spot, speed) in enumerate(
        zip(seen.t_s, seen.place_m, seen.velocity_mps, strict=True)
    ):
        wrong = [f for f in record.card.faults if f.at_s <= t + late < f.end_s]
        if any(f.kind == "gps_off" for f in wrong):
            continue
        message = _messages(record, float(t), spot, speed, wrong)
        if any(f.kind == "gps_garbage" for f in wrong):
            # A stream of its own: the epochs behind it stay as they were.
            own = np.random.default_rng([record.seed, 14, i])
            hit = own.random(len(message)) < GARBAGE_SHARE
            flips = np.where(hit, 0x10, 0).astype(np.uint8)
            message = (np.frombuffer(message, dtype=np.uint8) ^ flips).tobytes()
        found.append(Epoch(float(t) + late, message))
    return found


def _messages(
    record: FlightRecord, t_s: float, spot: Array, speed: Array, wrong: list[Fault]
) -> bytes:
    flight = record.card.flight
    kinds = {f.kind for f in wrong}
    itow_ms, week = FIRST_ITOW_MS + round(t_s * 1000.0), WEEK
    for fault in record.card.faults:
        if fault.kind == "gps_rollover":
            # The ten bits of the week on air run over: receivers of that time go back 1024 weeks.
            itow_ms = round((t_s - fault.at_s) * 1000.0) % WEEK_MS
            week = ROLLED_WEEK if t_s >= fault.at_s else ROLLED_WEEK + 1023
    latitude = flight.latitude_deg + math.degrees(spot[0] / EARTH_RADIUS_M)
    longitude = flight.longitude_deg + math.degrees(
        spot[1] / (EARTH_RADIUS_M * math.cos(math.radians(flight.latitude_deg)))
    )
    if "gps_far" in kinds:
        latitude = longitude = FAR_DEG
    height_mm = round((-spot[2] + 20.0) * 1000.0)
    ground = math.hypot(speed[0], speed[1])
    course = math.degrees(math.atan2(speed[1], speed[0])) % 360.0
    return solution(
        itow_ms,
        (round(longitude * 1e7), round(latitude * 1e7)),
        (height_mm + round(GEOID_M * 1000.0), height_mm),
        tuple(round(v * 100.0) for v in (*speed, float(np.linalg.norm(speed)), ground)),
        course_1e5deg=round(course * 1e5),
        week=week,
        fixed="gps_no_fix" not in kinds,
    )


def solution(
    itow_ms: int,
    place_1e7deg: tuple[int, int],
    heights_mm: tuple[int, int],
    speeds_cmps: tuple[int, ...],
    *,
    course_1e5deg: int = 0,
    accuracy_mm: int = 2500,
    week: int = WEEK,
    fixed: bool = True,
    satellites: int = 9,
) -> bytes:
    """Return the three messages of a solution: NAV-POSLLH, NAV-VELNED and NAV-SOL.

    Parameters
    ----------
    itow_ms : int
    place_1e7deg : tuple of int
        Longitude and latitude.
    heights_mm : tuple of int
        Above the ellipsoid, and above mean sea level.
    speeds_cmps : tuple of int
        North, east, down, in space, over ground.
    course_1e5deg, accuracy_mm, week : int
    fixed : bool
    satellites : int
    """
    posllh = struct.pack("<IiiiiII", itow_ms, *place_1e7deg, *heights_mm, accuracy_mm, 4000)
    velned = struct.pack("<IiiiIIiII", itow_ms, *speeds_cmps, course_1e5deg, 30, 50_000)
    fix, flags = (3, 0x0D) if fixed else (0, 0)
    sol = struct.pack(
        "<IihBBiiiIiiiIHBBI",
        itow_ms, 0, week, fix, flags, 0, 0, 0, 250, 0, 0, 0, 30, 150, 0, satellites, 0,
    )  # fmt: skip
    return packet(0x02, posllh) + packet(0x12, velned) + packet(0x06, sol)
