"""The truth files of a flight, against which an identification is judged; it never reads them.

`NAME.truth.npz` holds time series, `NAME.truth.toml` everything that is one number per flight or
per maneuver.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from host.aircraft.airframe import AILERON, ELEVATOR, Q0, Q3, RUDDER, STATES, Array
from host.aircraft.attitude import euler
from host.aircraft.flown_derivatives import FlownCondition, flown_derivatives, flown_modes
from host.aircraft.linearisation import linear_aircraft_derivatives, linearise, modes
from host.aircraft.local_derivatives import local_derivatives
from host.export.toml import dumps
from host.twin.flight.fly import FlightRecord
from host.twin.flight.pilot import Window
from host.twin.sensors.local_flow import AirData
from host.twin.sensors.sensor_delays import dlpf_for, sensor_delays

_TIMES = ("start_s", "input_end_s", "end_s", "pilot_corrects_from_s")
STRIDE = 5  # samples of 1 ms per row of the truth file: 200 Hz


def series(record: FlightRecord, data: AirData, stride: int = STRIDE) -> dict[str, Array]:
    """Return the true time series under names with units, every `stride`-th sample.

    Parameters
    ----------
    record : FlightRecord
    data : AirData
    stride : int

    Returns
    -------
    dict of (m,) arrays
        Time is true time since power-on; forces and rates are those of the CG, body axes.
    """
    phi, theta, psi = euler(record.states[:, Q0 : Q3 + 1])
    columns: dict[str, Array] = {"t_s": record.t_s}
    columns |= {name: record.states[:, i] for i, name in enumerate(STATES)}
    columns |= {
        "phi_rad": phi,
        "theta_rad": theta,
        "psi_rad": np.unwrap(psi),
        "airspeed_mps": data.airspeed_mps,
        "alpha_rad": data.alpha_rad,
        "beta_rad": data.beta_rad,
        "qbar_pa": data.qbar_pa,
        "static_pa": data.static_pa,
        "density_kgpm3": data.density_kgpm3,
        "temperature_k": data.temperature_k,
        "thrust_n": record.thrust_n,
    }
    for i, axis in enumerate("xyz"):
        columns[f"a{axis}_mps2"] = record.specific_force_mps2[:, i]
        columns[f"angular_{axis}_radps2"] = record.angular_acceleration_radps2[:, i]
    names = ("wind_north_mps", "wind_east_mps", "wind_down_mps", "gust_u_mps", "gust_v_mps",
             "gust_w_mps", "gust_p_radps", "gust_q_radps", "gust_r_radps")  # fmt: skip
    columns |= {name: record.air[:, i] for i, name in enumerate(names)}
    return {name: np.ascontiguousarray(column[::stride]) for name, column in columns.items()}


def maneuvers(record: FlightRecord, data: AirData) -> list[dict[str, object]]:
    """Return each maneuver's window, mean condition, local and dimensional derivatives, modes.

    Windows that the flight did not reach are left out.
    """
    found = []
    for window in record.schedule.windows:
        inside = (record.t_s >= window.start_s) & (record.t_s < window.end_s)
        if not inside.any() or window.end_s > record.t_s[-1] + 1.0:
            continue
        found.append(_maneuver(record, data, window, inside))
    return found


def _maneuver(
    record: FlightRecord, data: AirData, window: Window, inside: NDArray[np.bool_]
) -> dict[str, object]:
    frame = record.frame
    speed = data.airspeed_mps[inside]
    rates = data.rates_radps[inside] / (2.0 * speed[:, None])
    at = np.array(
        [
            data.alpha_rad[inside].mean(),
            data.beta_rad[inside].mean(),
            rates[:, 0].mean() * frame.span_m,
            rates[:, 1].mean() * frame.chord_m,
            rates[:, 2].mean() * frame.span_m,
            *(record.states[inside, k].mean() for k in (ELEVATOR, AILERON, RUDDER)),
        ]
    )
    spread = float(np.clip(data.alpha_rad[inside].std(), 0.005, 0.05))
    _, theta, _ = euler(record.states[inside, Q0 : Q3 + 1])
    flown = FlownCondition(
        airspeed_mps=float(speed.mean()),
        alpha_rad=float(at[0]),
        beta_rad=float(at[1]),
        surfaces_rad=(float(at[5]), float(at[6]), float(at[7])),
        thrust_n=float(record.thrust_n[inside].mean()),
        density_kgpm3=float(data.density_kgpm3[inside].mean()),
    )
    dimensional = flown_derivatives(frame, flown, spread)
    return {
        "kind": window.kind,
        "axes": list(window.axes),
        "start_s": window.start_s,
        "input_end_s": window.input_end_s,
        "end_s": window.end_s,
        "pilot_corrects_from_s": window.attention_s,
        "condition": {
            "airspeed_mps": flown.airspeed_mps,
            "density_kgpm3": flown.density_kgpm3,
            "qbar_pa": float(data.qbar_pa[inside].mean()),
            "alpha_rad": flown.alpha_rad,
            "beta_rad": flown.beta_rad,
            "alpha_spread_rad": spread,
            "elevator_rad": flown.surfaces_rad[0],
            "thrust_n": flown.thrust_n,
            "climb_rad": float(theta.mean() - at[0]),
        },
        "derivatives": (
            linear_aircraft_derivatives(frame, record.trim)
            if frame.linear > 0.0
            else local_derivatives(frame, at, spread)
        ),
        "dimensional": dimensional,
        "modes": _modes(record, dimensional, flown),
    }


def _modes(
    record: FlightRecord, dimensional: dict[str, float], flown: FlownCondition
) -> dict[str, object]:
    """Return frequency (rad/s) and damping of each mode, in level flight as the maneuver was."""
    frame = record.frame
    found = (
        modes(linearise(frame, record.trim))
        if frame.linear > 0.0
        else flown_modes(dimensional, flown, frame.gravity_mps2)
    )
    return {
        mode.name.replace(" ", "_"): [float(mode.frequency_radps), mode.damping] for mode in found
    }


def summary(record: FlightRecord, data: AirData, first_row_s: float = 0.0) -> dict[str, object]:
    """Return everything of the truth that is not a time series, ready for TOML.

    Times count from the log's first row, as those of `host maneuvers` and `host identify`.
    """
    frame, card = record.frame, record.card
    return {
        "format": 1,
        "note": "truth of a simulated flight; nothing here comes from a board or an aircraft",
        "card": card.name,
        "title": card.title,
        "aircraft": record.aircraft.name,
        "seed": record.seed,
        "duration_s": float(record.t_s[-1]) if len(record.t_s) else 0.0,
        "launch_s": card.flight.ground_s - first_row_s,
        "ended_on_ground": record.touched_ground,
        "power_on_s": -first_row_s,
        "rate_hz": card.flight.rate_hz,
        "turbulence_mps": card.air.turbulence_mps,
        "flown": {
            "mass_kg": frame.mass_kg,
            "ixx_kgm2": frame.ixx_kgm2,
            "iyy_kgm2": frame.iyy_kgm2,
            "izz_kgm2": frame.izz_kgm2,
            "ixz_kgm2": frame.ixz_kgm2,
            "cg_m": frame.cg_m,
        },
        "trim": {
            "airspeed_mps": record.trim.airspeed_mps,
            "alpha_rad": record.trim.alpha_rad,
            "elevator_rad": float(record.trim.command[0]),
            "throttle": float(record.trim.command[3]),
        },
        "drawn": dict(record.draws.values),
        "delay_s": sensor_delays(
            record.aircraft, record.draws, dlpf_for(record.card.flight.rate_hz)
        ),
        "fault": [
            {
                "kind": f.kind,
                "at_s": f.at_s - first_row_s,
                "duration_s": f.duration_s,
                "value": f.amount,
                "channel": f.channel,
            }
            for f in card.faults
        ],
        "maneuver": counted_from(first_row_s, maneuvers(record, data)),
    }


def counted_from(
    first_row_s: float, windows: Sequence[Mapping[str, object]]
) -> list[dict[str, object]]:
    """Return maneuvers with times that count from the log's first row in place of power-on."""
    return [
        {**w, **{name: float(str(w[name])) - first_row_s for name in _TIMES if name in w}}
        for w in windows
    ]


def write(
    record: FlightRecord, data: AirData, stem: Path, *, first_row_s: float = 0.0
) -> list[Path]:
    """Write `stem`.truth.npz and `stem`.truth.toml; return their paths.

    Parameters
    ----------
    record : FlightRecord
    data : AirData
    stem : Path
    first_row_s : float
        True time since power-on of the log's first row; times in both files count from it.

    Raises
    ------
    OSError
        The folder cannot be written.
    """
    arrays, text = (
        stem.with_name(stem.name + ".truth.npz"),
        stem.with_name(stem.name + ".truth.toml"),
    )
    columns = series(record, data)
    columns["t_s"] = columns["t_s"] - first_row_s
    np.savez(arrays, allow_pickle=False, **columns)
    document = {
        key: value for key, value in summary(record, data, first_row_s).items() if value != []
    }
    text.write_text(dumps(document), encoding="utf-8")
    return [arrays, text]
