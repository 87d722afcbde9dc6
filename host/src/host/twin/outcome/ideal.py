"""`--firmware none`: the table that a perfect recorder would give, for studies.

Either what the sensors measured (noise, lags, errors of the flight, converted with the nominal
calibration) without any firmware between, or the truth itself.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from host.aircraft.airframe import AILERON, ELEVATOR, Q0, Q3, RUDDER, Array
from host.aircraft.attitude import euler
from host.twin.flight.fly import FlightRecord
from host.twin.flight.stick_commands import IDLE_US, NEUTRAL_US, THROW_US
from host.twin.sensors.analog import CHANNELS, analog, convert, nominal
from host.twin.sensors.imu import imu
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.sensors.sensor_delays import FILTERS, dlpf_for
from host.twin.sensors.ubx import fixes
from host.twin.testcard.cards import AXES

CONVERSIONS = 4  # the recorder sums four conversions of each channel


def times(record: FlightRecord) -> Array:
    """Return the sampling times of the card's rate."""
    step = 1.0 / record.card.flight.rate_hz
    return np.arange(0.02, record.t_s[-1] - 0.02, step)


def true_table(record: FlightRecord, data: AirData | None = None) -> pd.DataFrame:
    """Return the truth in the columns of a decoded log.

    Parameters
    ----------
    record : FlightRecord
    data : AirData, optional
        If it is at hand already.

    Returns
    -------
    DataFrame
        ``t_s``, ``airspeed_mps`` ... ``density_kgpm3`` at the card's rate; SI, radians; specific
        force at the CG.
    """
    data = data or air_data(record)
    at = times(record)

    def pick(column: Array) -> Array:
        return np.interp(at, record.t_s, column)

    angles = [np.unwrap(a) for a in euler(record.states[:, Q0 : Q3 + 1])]
    columns = {
        "t_s": at,
        "airspeed_mps": pick(data.airspeed_mps),
        "alpha_rad": pick(data.alpha_rad),
        "beta_rad": pick(data.beta_rad),
    }
    columns |= {f"{a}_radps": pick(record.states[:, 3 + i]) for i, a in enumerate("pqr")}
    columns |= {f"a{a}_mps2": pick(record.specific_force_mps2[:, i]) for i, a in enumerate("xyz")}
    names = ("phi_rad", "theta_rad", "psi_rad")
    columns |= {name: pick(a) for name, a in zip(names, angles, strict=True)}
    columns |= {
        "elevator_rad": pick(record.states[:, ELEVATOR]),
        "aileron_rad": pick(record.states[:, AILERON]),
        "rudder_rad": pick(record.states[:, RUDDER]),
    }
    columns |= commands(record, at)
    columns |= {
        "qbar_pa": pick(data.qbar_pa),
        "static_pa": pick(data.static_pa),
        "density_kgpm3": pick(data.density_kgpm3),
        "thrust_n": pick(record.thrust_n),
        "rotor_radps": pick(record.states[:, 16]),
    }
    return pd.DataFrame(columns)


def commands(record: FlightRecord, at_s: Array) -> dict[str, Array]:
    """Return throttle (0..1) and commanded surfaces (rad) of the last whole receiver frame."""
    row = np.searchsorted(record.pulse_starts_s + 0.010, at_s, side="right") - 1
    pulses = record.pulses_us[np.maximum(row, 0)]
    limit = record.frame.surface_limit_rad
    out = {"throttle": (pulses[:, 3] - IDLE_US) / (2.0 * THROW_US)}
    for name, column in (("elevator", 1), ("aileron", 0), ("rudder", 2)):
        share = (pulses[:, column] - NEUTRAL_US) / THROW_US
        out[f"{name}_command_rad"] = share * limit[AXES.index(name)]
    return out


def measured_table(record: FlightRecord, data: AirData | None = None) -> pd.DataFrame:
    """Return the measured values of the sensors, in the columns of a decoded log.

    Parameters
    ----------
    record : FlightRecord
    data : AirData, optional

    Returns
    -------
    DataFrame
        As `true_table`, without thrust and rotor; vanes and pitots per side (``alpha_a_rad``
        ...) and their mean, pots. Rates and specific forces at the IMU; time is true, as after a
        correction by GPS.
    """
    data = data or air_data(record)
    at = times(record)
    rng = np.random.default_rng([record.seed, 10])
    source = analog(record, data)
    counts = np.mean(
        [convert(source, record.t_s, at + k * 1.1e-3, rng) for k in range(CONVERSIONS)], axis=0
    )
    scale = nominal()
    si = {name: (counts[:, k] - scale[name][0]) * scale[name][1] for k, name in enumerate(CHANNELS)}
    sample = imu(record, data, at, dlpf_for(record.card.flight.rate_hz), rng)
    gyro_late, force_late = (late for _, late in FILTERS[sample.dlpf])
    if not record.card.sensors.imu_filter:
        gyro_late = force_late = 0.0
    # The nominal delays are taken out, as decoding does.
    vane_at, rate_at = at + 1.65e-3, at - gyro_late

    def on(times_s: Array, column: Array) -> Array:
        return np.interp(at, times_s, column)

    density = np.interp(at, record.t_s, data.density_kgpm3)
    qbar = 0.5 * (si["dp_a"] + si["dp_b"])
    columns: dict[str, Array] = {
        "t_s": at,
        "airspeed_mps": np.sqrt(2.0 * np.maximum(on(vane_at, qbar), 0.0) / density),
        "alpha_rad": on(vane_at, 0.5 * (si["alpha_a"] + si["alpha_b"])),
        "beta_rad": on(vane_at, 0.5 * (si["beta_a"] + si["beta_b"])),
    }
    columns |= {f"{a}_radps": on(rate_at, sample.rates_radps[:, i]) for i, a in enumerate("pqr")}
    columns |= {
        f"a{a}_mps2": on(at - force_late, sample.force_mps2[:, i]) for i, a in enumerate("xyz")
    }
    for i, name in enumerate(("phi_rad", "theta_rad", "psi_rad")):
        columns[name] = np.unwrap(sample.attitude_rad[:, i])
    columns["elevator_rad"] = on(vane_at, si["pot_elevator"])
    columns["aileron_rad"] = on(vane_at, 0.5 * (si["pot_aileron_left"] - si["pot_aileron_right"]))
    columns["rudder_rad"] = on(vane_at, si["pot_rudder"])
    columns |= commands(record, at)
    columns |= {
        "qbar_pa": on(vane_at, qbar),
        "static_pa": np.interp(at, record.t_s, data.static_pa),
        "density_kgpm3": density,
    }
    for name in CHANNELS[:6]:
        unit = "pa" if name.startswith("dp") else "rad"
        columns[f"{name}_{unit}"] = on(vane_at, si[name])
    # By these columns a table counts as our logger's: pots, and who drives the servos.
    columns |= {
        "elevator_pot_rad": columns["elevator_rad"],
        "aileron_left_rad": on(vane_at, si["pot_aileron_left"]),
        "aileron_right_rad": on(vane_at, si["pot_aileron_right"]),
        "rudder_pot_rad": columns["rudder_rad"],
        "mega_drives": np.ones(len(at)),
    }
    return pd.DataFrame(columns)


def gps_columns(record: FlightRecord) -> dict[str, Array]:
    """Return GPS velocity at the rows of `measured_table`: linear between fixes as they arrive.

    Parameters
    ----------
    record : FlightRecord

    Returns
    -------
    dict
        ``v_north_mps``, ``v_east_mps``, ``v_down_mps``; NaN before the first fix.
    """
    at = times(record)
    seen = fixes(record, np.random.default_rng([record.seed, 15]))
    arrived = seen.t_s + seen.late_s
    names = ("v_north_mps", "v_east_mps", "v_down_mps")
    return {
        name: np.interp(at, arrived, v, left=np.nan, right=np.nan)
        for name, v in zip(names, seen.velocity_mps.T, strict=True)
    }
