"""Sensors of an autopilot that flies in place of our logger: IMU, attitude, air data, GPS.

Errors and delays are those drawn for our instrument on the same flight, so that both logs differ
in rates and formats only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.aircraft.airframe import DOWN, NORTH, Q0, Q3, Array, U
from host.aircraft.attitude import to_body
from host.constants import METRES_PER_DEG
from host.physical.airdata import STANDARD_PRESSURE_PA
from host.twin.flight.draws import PITOT_PA_PER_COUNT
from host.twin.flight.fly import STEP_S, FlightRecord
from host.twin.sensors.filters import delayed, first_order
from host.twin.sensors.imu import imu
from host.twin.sensors.local_flow import AirData, local_velocity
from host.twin.sensors.sensor_delays import sensor_delays

DLPF = 3  # 42 Hz, as autopilots filter their IMU by default: 4.8 ms
BARO_NOISE_PA, PITOT_NOISE_PA = 3.0, 1.5  # MS5611 and MS4525DO at the rates below
SPEED_NOISE_MPS = 0.1
FIRST_S = 0.05
# An autopilot logs its outputs in the loop that sets them: here when the rudder's pulse has ended,
# 6 ms into the receiver's frame.
FIRST_OUTPUT_S = 0.046
HOME_DEG = (30.1, 31.4)
SEA_LEVEL_DENSITY_KGPM3 = 1.225


@dataclass(frozen=True, slots=True)
class Rates:
    """How often each sensor is logged, Hz."""

    imu: float
    attitude: float
    airspeed: float
    baro: float
    gps: float
    outputs: float


@dataclass(frozen=True, slots=True)
class Senses:
    """Samples of every sensor, each at its own instants (s since power-on).

    Attributes
    ----------
    imu_s, rates_radps, force_mps2
        (m,), (m, 3), (m, 3).
    attitude_s, attitude_rad
        (k,), (k, 3): phi, theta, psi of the estimator.
    airspeed_s, indicated_mps, differential_pa
    baro_s, static_pa, temperature_degc
    gps_s, velocity_mps, latitude_deg, longitude_deg, height_m
    outputs_s
        When outputs are logged.
    """

    imu_s: Array
    rates_radps: Array
    force_mps2: Array
    attitude_s: Array
    attitude_rad: Array
    airspeed_s: Array
    indicated_mps: Array
    differential_pa: Array
    baro_s: Array
    static_pa: Array
    temperature_degc: Array
    gps_s: Array
    velocity_mps: Array
    latitude_deg: Array
    longitude_deg: Array
    height_m: Array
    outputs_s: Array


def autopilot_senses(record: FlightRecord, data: AirData, rates: Rates) -> Senses:
    """Return the measurements of the sensors of an autopilot on a flight.

    Parameters
    ----------
    record : FlightRecord
    data : AirData
    rates : Rates
    """
    rng = np.random.default_rng([record.seed, 20])
    noisy = 1.0 if record.card.sensors.noise else 0.0
    imu_s = _instants(record, rates.imu)
    fast = imu(record, data, imu_s, DLPF, rng)
    every = max(1, round(rates.imu / rates.attitude))
    late = sensor_delays(record.aircraft, record.draws, DLPF)
    airspeed_s, baro_s, gps_s = (
        _instants(record, rate) for rate in (rates.airspeed, rates.baro, rates.gps)
    )
    place = record.aircraft.vector("sensors.pitot_a_m") - record.frame.cg_m
    along = np.maximum(local_velocity(data, place)[:, U], 0.0)
    pressure = first_order(0.5 * data.density_kgpm3 * along**2, late["dp_a"], STEP_S)
    scale = 1.0 + float(record.draws.vector("pitot_scale_share")[0])
    differential = scale * delayed(record.t_s, pressure, 0.0, airspeed_s)
    differential += PITOT_PA_PER_COUNT * float(record.draws.vector("pitot_drift_count")[0])
    differential += noisy * PITOT_NOISE_PA * rng.standard_normal(len(airspeed_s))
    indicated = np.sqrt(2.0 * np.maximum(differential, 0.0) / SEA_LEVEL_DENSITY_KGPM3)
    static = delayed(record.t_s, data.static_pa, 0.0, baro_s) + record.draws.scalar(
        "baro_offset_pa"
    )
    static += noisy * BARO_NOISE_PA * rng.standard_normal(len(baro_s))
    velocity = np.einsum("nji,nj->ni", to_body(record.states[:, Q0 : Q3 + 1]), record.states[:, :3])
    north = delayed(record.t_s, record.states[:, NORTH : DOWN + 1], late["gps"], gps_s)
    speed = delayed(record.t_s, velocity, late["gps"], gps_s)
    speed[gps_s < record.card.flight.ground_s] = 0.0
    speed += noisy * SPEED_NOISE_MPS * rng.standard_normal(speed.shape)
    metres = METRES_PER_DEG
    return Senses(
        imu_s=imu_s,
        rates_radps=fast.rates_radps,
        force_mps2=fast.force_mps2,
        attitude_s=imu_s[::every],
        attitude_rad=fast.attitude_rad[::every],
        airspeed_s=airspeed_s,
        indicated_mps=indicated,
        differential_pa=differential,
        baro_s=baro_s,
        static_pa=static,
        temperature_degc=np.interp(baro_s, record.t_s, data.temperature_k) - 273.15,
        gps_s=gps_s,
        velocity_mps=speed,
        latitude_deg=HOME_DEG[0] + north[:, 0] / metres,
        longitude_deg=HOME_DEG[1] + north[:, 1] / (metres * np.cos(np.deg2rad(HOME_DEG[0]))),
        height_m=-north[:, 2],
        outputs_s=_instants(record, rates.outputs, FIRST_OUTPUT_S),
    )


def pressure_height_m(static_pa: Array) -> Array:
    """Return height above the first pressure, m, as a barometer of an autopilot says it."""
    share = static_pa / float(np.median(static_pa[:10])) if len(static_pa) else STANDARD_PRESSURE_PA
    return np.asarray(44_330.0 * (1.0 - share**0.190263))


def _instants(record: FlightRecord, rate_hz: float, first_s: float = FIRST_S) -> Array:
    return np.arange(first_s, record.t_s[-1] - 0.02, 1.0 / rate_hz)
