"""GPS messages of a u-blox 6: NAV-POSLLH, NAV-VELNED and NAV-SOL of each epoch.

u-blox 6 receiver description, GPS.G6-SW-10018, chapter 35. Checksum: 8-bit Fletcher.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

import numpy as np

from host.twin.airframe import DOWN, NORTH, Array
from host.twin.delays import dlpf_for, sensor_delays
from host.twin.flight import STEP_S, FlightRecord

RATE_HZ = 5.0
EARTH_RADIUS_M = 6_371_000.0
POSITION_NOISE_M = 0.4  # epoch to epoch; the slow error is drawn once per flight
VELOCITY_NOISE_MPS = 0.1  # u-blox 6 data sheet
GEOID_M = 15.0
WEEK = 1876  # the week of the second flight's year, 2015


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


def epochs(record: FlightRecord, rng: np.random.Generator) -> list[Epoch]:
    """Return every epoch of a flight with noise and latency.

    Parameters
    ----------
    record : FlightRecord
    rng : numpy Generator
    """
    switches, flight = record.card.sensors, record.card.flight
    at = np.arange(0.2, record.t_s[-1] - 0.01, 1.0 / RATE_HZ)
    place = record.states[:, NORTH : DOWN + 1]
    velocity = np.gradient(place, STEP_S, axis=0)
    # The launch is a cut, not a motion.
    cut = np.abs(record.t_s - flight.ground_s) < 3 * STEP_S
    velocity[cut] = 0.0
    noise = rng.standard_normal((len(at), 6)) * (1.0 if switches.noise else 0.0)
    slow = record.draws.vector("field_m")
    late = 0.0
    if switches.gps_latency:
        late = sensor_delays(record.aircraft, record.draws, dlpf_for(flight.rate_hz))["gps"]
    dark = [(f.at_s, f.at_s + f.duration_s) for f in record.card.faults if f.kind == "gps_off"]
    found = []
    for i, t in enumerate(at):
        if any(first <= t + late < last for first, last in dark):
            continue
        k = min(round(float(t) / STEP_S), len(place) - 1)
        spot = place[k] + slow + noise[i, :3] * POSITION_NOISE_M * np.array([1.0, 1.0, 2.0])
        speed = velocity[k] + noise[i, 3:] * VELOCITY_NOISE_MPS
        found.append(Epoch(float(t) + late, _messages(record, float(t), spot, speed)))
    return found


def _messages(record: FlightRecord, t_s: float, spot: Array, speed: Array) -> bytes:
    flight = record.card.flight
    itow_ms = 288_000_000 + round(t_s * 1000.0)
    latitude = flight.latitude_deg + math.degrees(spot[0] / EARTH_RADIUS_M)
    longitude = flight.longitude_deg + math.degrees(
        spot[1] / (EARTH_RADIUS_M * math.cos(math.radians(flight.latitude_deg)))
    )
    height_mm = round((-spot[2] + 20.0) * 1000.0)
    ground = math.hypot(speed[0], speed[1])
    course = math.degrees(math.atan2(speed[1], speed[0])) % 360.0
    posllh = struct.pack(
        "<IiiiiII", itow_ms, round(longitude * 1e7), round(latitude * 1e7),
        height_mm + round(GEOID_M * 1000.0), height_mm, 2500, 4000,
    )  # fmt: skip
    velned = struct.pack(
        "<IiiiIIiII", itow_ms, *(round(v * 100.0) for v in speed),
        round(float(np.linalg.norm(speed)) * 100.0), round(ground * 100.0), round(course * 1e5),
        30, 50_000,
    )  # fmt: skip
    sol = struct.pack(
        "<IihBBiiiIiiiIHBBI", itow_ms, 0, WEEK, 3, 0x0D, 0, 0, 0, 250, 0, 0, 0, 30, 150, 0, 9, 0
    )
    return packet(0x02, posllh) + packet(0x12, velned) + packet(0x06, sol)
