"""A flight as a ground station records it from an ArduPilot plane over a fast link."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from host.aircraft.airframe import Array
from host.constants import GRAVITY_MPS2
from host.export.tlog_writer import TlogWriter
from host.twin.flight.fly import FlightRecord
from host.twin.outcome.ardupilot_log import FIRMWARE, ardupilot_parameters
from host.twin.outcome.autopilot_outputs import ardupilot_pulses, demands
from host.twin.sensors.autopilot_sensors import Rates, Senses, autopilot_senses, pressure_height_m
from host.twin.sensors.local_flow import AirData

# As with SRn_RAW_SENS, SRn_EXTRA1 and SRn_RC_CHAN at 50 over USB or WiFi; a radio at 57600 baud
# brings a fifth of it.
RATES = Rates(imu=50.0, attitude=50.0, airspeed=10.0, baro=10.0, gps=5.0, outputs=50.0)
EPOCH_S = 1.7e9
LINK_S, LINK_JITTER_S = 0.020, 0.005
PLANE, ARDUPILOT = 1, 3
REAL32 = 9
MOST_INT16 = 32767


def write_mavlink_log(
    record: FlightRecord, data: AirData, path: Path, *, airframe: str = "conventional"
) -> Senses:
    """Write a telemetry log of a flight; return what its sensors said.

    Parameters
    ----------
    record : FlightRecord
    data : AirData
    path : Path
    airframe : str
        One of `autopilot_outputs.AIRFRAMES`.

    Raises
    ------
    UsageError
        If there is no such airframe.
    OSError
        The file cannot be written.
    """
    senses = autopilot_senses(record, data, RATES)
    writer = TlogWriter()
    d = writer.dialect
    rng = np.random.default_rng([record.seed, 21])

    def late(t_s: Array) -> list[float]:
        return list(EPOCH_S + t_s + LINK_S + LINK_JITTER_S * rng.random(len(t_s)))

    parameters = ardupilot_parameters(airframe)
    writer.add(late(np.zeros(1)), [d.MAVLink_statustext_message(6, FIRMWARE.encode())])
    writer.add(
        late(np.full(len(parameters), 0.01)),
        [
            d.MAVLink_param_value_message(name.encode(), value, REAL32, len(parameters), k)
            for k, (name, value) in enumerate(parameters.items())
        ],
    )
    beats = np.arange(0.0, record.t_s[-1], 1.0)
    writer.add(
        late(beats), [d.MAVLink_heartbeat_message(PLANE, ARDUPILOT, 0, 0, 4, 3)] * len(beats)
    )
    milli_g = np.clip(np.round(senses.force_mps2 / GRAVITY_MPS2 * 1e3), -MOST_INT16, MOST_INT16)
    milli_rad = np.clip(np.round(senses.rates_radps * 1e3), -MOST_INT16, MOST_INT16)
    raw = np.column_stack([milli_g, milli_rad]).astype(int).tolist()
    writer.add(
        late(senses.imu_s),
        [
            d.MAVLink_raw_imu_message(us, *row, 0, 0, 0)
            for us, row in zip(_whole(senses.imu_s * 1e6), raw, strict=True)
        ],
    )
    turned = senses.attitude_rad.tolist()
    speeds = np.column_stack(
        [np.interp(senses.attitude_s, senses.imu_s, senses.rates_radps[:, k]) for k in range(3)]
    ).tolist()
    writer.add(
        late(senses.attitude_s),
        [
            d.MAVLink_attitude_message(ms, *a, *w)
            for ms, a, w in zip(_whole(senses.attitude_s * 1e3), turned, speeds, strict=True)
        ],
    )
    pulses = np.column_stack(
        ardupilot_pulses(demands(record, senses.outputs_s, airframe), airframe)
    )
    filled = np.zeros((len(pulses), 8), dtype=int)
    filled[:, : pulses.shape[1]] = pulses
    writer.add(
        late(senses.outputs_s),
        [
            d.MAVLink_servo_output_raw_message(us, 0, *row)
            for us, row in zip(_whole(senses.outputs_s * 1e6), filled.tolist(), strict=True)
        ],
    )
    _add_slow(writer, senses, late)
    writer.write(path)
    return senses


def _add_slow(writer: TlogWriter, senses: Senses, late: Callable[[Array], list[float]]) -> None:
    d = writer.dialect
    height = np.interp(senses.airspeed_s, senses.baro_s, pressure_height_m(senses.static_pa))
    writer.add(
        late(senses.airspeed_s),
        [
            d.MAVLink_vfr_hud_message(v, v, 0, 0, h, 0.0)
            for v, h in zip(senses.indicated_mps.tolist(), height.tolist(), strict=True)
        ],
    )
    differential = np.interp(senses.baro_s, senses.airspeed_s, senses.differential_pa)
    writer.add(
        late(senses.baro_s),
        [
            d.MAVLink_scaled_pressure_message(ms, p / 100.0, q / 100.0, round(100.0 * t))
            for ms, p, q, t in zip(_whole(senses.baro_s * 1e3), senses.static_pa.tolist(),
                                   differential.tolist(), senses.temperature_degc.tolist(),
                                   strict=True)
        ],
    )  # fmt: skip
    speed = np.round(senses.velocity_mps * 100.0).astype(int).tolist()
    writer.add(
        late(senses.gps_s),
        [
            d.MAVLink_global_position_int_message(
                ms, round(lat * 1e7), round(lon * 1e7), round(h * 1e3), round(h * 1e3), *v, 0
            )
            for ms, lat, lon, h, v in zip(_whole(senses.gps_s * 1e3), senses.latitude_deg.tolist(),
                                          senses.longitude_deg.tolist(), senses.height_m.tolist(),
                                          speed, strict=True)
        ],
    )  # fmt: skip


def _whole(values: Array) -> list[int]:
    return [round(v) for v in values.tolist()]
