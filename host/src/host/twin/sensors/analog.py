"""Vanes, pitots and pots as voltages on the converter's inputs.

Counts of a 10-bit ratiometric converter, not yet rounded: the converter rounds when it converts.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass

import numpy as np

from host.aircraft.airframe import AILERON, ELEVATOR, RUDDER, Array
from host.resources import resource
from host.twin.faults import PITOTS, POTS, VANES, Fault
from host.twin.flight.fly import STEP_S, FlightRecord
from host.twin.sensors.filters import delayed, first_order, vane
from host.twin.sensors.local_flow import AirData, local_velocity
from host.twin.sensors.sensor_delays import dlpf_for, nominal_vane_s, sensor_delays

CHANNELS = (*VANES, *PITOTS, *POTS)
# Far enough beyond the converter's range that its noise cannot bring it back.
OPEN_COUNT, SHORT_COUNT = 1040.0, -16.0
# Noise before the converter, counts rms: MA3 analogue 0.12 deg (data sheet) is 0.34 counts;
# MPXV7002 and pots have 2 mV of broadband noise, and a count is 4.9 mV.
NOISE_COUNT = {"alpha": 0.34, "beta": 0.34, "dp": 0.4, "pot": 0.4}
DRIFT_TAU_S = 60.0  # warm-up of the pressure sensor


@dataclass(frozen=True, slots=True)
class Analog:
    """Converter inputs on the 1 kHz grid.

    Attributes
    ----------
    counts : (n, 10) array
        `CHANNELS`, without the converter's noise and rounding.
    noise_count : (10,) array
        Standard deviation of each conversion.
    """

    counts: Array
    noise_count: Array


def nominal() -> dict[str, tuple[float, float]]:
    """Return zero (counts) and slope (SI per count) of each channel from the default
    calibration."""
    table = tomllib.loads(resource("default.toml").read_text(encoding="utf-8"))["channel"]
    return {name: (float(table[name]["zero"]), float(table[name]["slope"])) for name in CHANNELS}


def analog(record: FlightRecord, data: AirData) -> Analog:
    """Return the outputs of the analogue sensors.

    Parameters
    ----------
    record : FlightRecord
    data : AirData

    Returns
    -------
    Analog
    """
    switches, draws, plane = record.card.sensors, record.draws, record.aircraft
    scale = nominal()
    t = record.t_s
    counts = np.empty((len(t), len(CHANNELS)))
    cg = record.frame.cg_m

    def place(name: str) -> Array:
        if not switches.position:
            return np.zeros(3)
        return plane.vector(f"sensors.{name}_m") + draws.vector(f"{name}_m") - cg

    frequency = plane.scalar("sensors.vane_frequency_hz_per_mps")
    damping = plane.scalar("sensors.vane_damping")
    friction = plane.scalar("sensors.vane_friction_rad") if switches.vane_friction else 0.0
    reference = plane.scalar("trim.airspeed_mps")
    upwash = plane.scalar("sensors.upwash") if switches.position else 0.0
    late = sensor_delays(plane, draws, dlpf_for(record.card.flight.rate_hz))
    for side in (0, 1):
        flow = local_velocity(data, place(f"vane_{'ab'[side]}"))
        speed = np.linalg.norm(flow, axis=1)
        lift = 1.0 + upwash * (1.0 + draws.vector("upwash_share")[side])
        moving = speed > 0.5
        alpha = np.where(moving, np.arctan2(lift * flow[:, 2], flow[:, 0]), 0.0)
        # A fin on an upright axis sees the flank angle atan(v/u), not asin(v/V).
        flank = np.where(moving, np.arctan2(flow[:, 1], flow[:, 0]), 0.0)
        for angle, k in ((alpha, side), (flank, 2 + side)):
            if switches.vane_dynamics:
                # A slower vane is one of lower frequency.
                own = frequency * nominal_vane_s(plane) / late[CHANNELS[k]]
                stuck = friction * (1.0 + float(draws.vector("vane_friction_share")[k]))
                angle = vane(angle, speed, own, damping, stuck, reference, STEP_S)
            zero, slope = scale[CHANNELS[k]]
            share = 1.0 + float(draws.vector("vane_scale_share")[k])
            counts[:, k] = zero + (share * angle + draws.vector("vane_zero_rad")[k]) / slope
        flow = local_velocity(data, place(f"pitot_{'ab'[side]}"))
        pressure = 0.5 * data.density_kgpm3 * (flow**2).sum(axis=1)
        pressure = first_order(pressure, late[CHANNELS[4 + side]], STEP_S)
        zero, slope = scale[CHANNELS[4 + side]]
        share = 1.0 + float(draws.vector("pitot_scale_share")[side])
        drift = draws.vector("pitot_drift_count")[side] * (1.0 - np.exp(-t / DRIFT_TAU_S))
        counts[:, 4 + side] = zero + share * pressure / slope
        if switches.pitot_drift:
            counts[:, 4 + side] += drift
    aileron = record.states[:, AILERON]
    surfaces = (record.states[:, ELEVATOR], aileron, -aileron, record.states[:, RUDDER])
    for i, angle in enumerate(surfaces):
        zero, slope = scale[CHANNELS[6 + i]]
        share = 1.0 + float(draws.vector("pot_scale_share")[i])
        counts[:, 6 + i] = zero + (share * angle + draws.vector("pot_zero_rad")[i]) / slope
    noise = np.array([NOISE_COUNT[name.split("_")[0]] for name in CHANNELS])
    for fault in record.card.faults:
        _break(fault, t, counts, scale)
    return Analog(counts, noise if switches.noise else np.zeros_like(noise))


def _break(fault: Fault, t: Array, counts: Array, scale: dict[str, tuple[float, float]]) -> None:
    sensor, _, what = fault.kind.partition("_")
    first = {"vane": 0, "pitot": len(VANES), "pot": len(VANES) + len(PITOTS)}.get(sensor)
    inside = fault.inside(t)
    if first is None or not inside.any():
        return
    k = first + fault.place
    if what in ("stuck", "blocked"):
        counts[inside, k] = counts[int(np.argmax(inside)), k]
    elif what == "open":
        counts[inside, k] = OPEN_COUNT
    elif what == "short":
        counts[inside, k] = SHORT_COUNT
    elif what == "swapped":
        counts[inside, k] = 2.0 * scale[CHANNELS[k]][0] - counts[inside, k]


def convert(source: Analog, t_s: Array, at_s: Array, rng: np.random.Generator) -> Array:
    """Convert all channels at the times `at_s` (m,): rounded and clipped counts (m, 10).

    Parameters
    ----------
    source : Analog
    t_s : (n,) array
        Its time grid.
    at_s : (m,) array
    rng : numpy Generator
    """
    volts = delayed(t_s, source.counts, 0.0, at_s)
    volts = volts + rng.standard_normal(volts.shape) * source.noise_count
    return np.clip(np.floor(volts + 0.5), 0.0, 1023.0)
