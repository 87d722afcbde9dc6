"""Inputs as people have them, each made of one virtual flight: a name, and who writes it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tests.host.readers import changed_logs as logs

SINCE_1970_US = np.uint64(1_710_773_350_000_000)
MICROS_MAP = '[columns]\nt_s = { from = "us", unit = "us" }\n'


def synthetic_airspeed(path: Path) -> Path:
    """Write a pitot that fails at a third; the autopilot goes on with a computed airspeed."""

    def fails(topics: logs.Topics) -> None:
        air = topics["airspeed_validated", 0]
        late = np.arange(len(air["timestamp"])) > len(air["timestamp"]) // 3
        for key in [k for k in air if k.endswith("airspeed_m_s")]:
            wrong = np.float32(1.25) * np.median(air[key])
            air[key] = np.where(late, wrong, air[key]).astype(np.float32)
        air["airspeed_source"] = np.where(late, 4, 1).astype(np.int8)

    return logs.px4(path, fails)


def unix_time(path: Path) -> Path:
    """Write times since 1970."""

    def since_1970(topics: logs.Topics) -> None:
        for columns in topics.values():
            for key in [k for k in columns if k.startswith("timestamp")]:
                columns[key] = columns[key] + SINCE_1970_US

    return logs.px4(path, since_1970)


def gps_before_only(path: Path) -> Path:
    """Write GPS for the cruise before the test points and for none of them."""

    def moved(name: str, values: NDArray[Any], by_us: int) -> NDArray[Any]:
        return values + np.uint64(by_us) if name.startswith("timestamp") else values

    def lost(topics: logs.Topics) -> None:
        start_us, cruise_us, many = 3_500_000, 1_000_000, 40
        for key, columns in list(topics.items()):
            stamp = columns["timestamp"]
            quiet = (stamp >= start_us) & (stamp < start_us + cruise_us)
            own = {}
            for name, values in columns.items():
                parts = [moved(name, values[quiet], k * cruise_us) for k in range(many)]
                if key[0] != "vehicle_local_position":
                    parts.append(moved(name, values, start_us + many * cruise_us))
                own[name] = np.concatenate(parts)
            topics[key] = own

    return logs.px4(path, lost)


def two_boots(path: Path) -> Path:
    """Write a boot on the bench in front of the flight."""
    bench = logs.ardupilot(path.with_name("bench.part"), logs.bench)
    whole = logs.ardupilot(path.with_name("whole.part"))
    path.write_bytes(bench.read_bytes() + whole.read_bytes())
    return path


def passed_through(path: Path) -> Path:
    """Write outputs that pass the receiver through."""
    change = logs.set_parameters(SERVO1_FUNCTION=1, SERVO2_FUNCTION=1, SERVO4_FUNCTION=1)
    return logs.ardupilot(path, change)


def same_name(path: Path) -> Path:
    """Write a second kind called ATT, 5 Hz of zeros, as a script logs it."""

    def own(kinds: logs.Kinds) -> None:
        t = np.arange(0.0, float(kinds["ATT"][1]["TimeUS"][-1]), 2e5)
        zero = np.zeros(len(t))
        kinds.clear()
        kinds["ATT"] = "Qfff", {"TimeUS": t, "Roll": zero, "Pitch": zero, "Yaw": zero}

    script = bytearray(logs.ardupilot(path.with_name("script.part"), own).read_bytes())
    sync, number = b"\xa3\x95", 200
    script[script.index(sync + b"\x80", 80) + 3] = number
    other = bytes(script).replace(sync + b"\x20", sync + bytes([number]))
    whole = logs.ardupilot(path.with_name("whole.part"))
    path.write_bytes(whole.read_bytes() + other)
    return path


def gimbal(path: Path) -> Path:
    """Write telemetry in which a gimbal of the vehicle sends ATTITUDE too."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    mixed = []
    for k, (stamp, message, frame) in enumerate(logs.decoded(logs.frames())):
        mixed.append((stamp, frame))
        if message.get_type() == "ATTITUDE":
            other = dialect.MAVLink_attitude_message(
                message.time_boot_ms + 4, 0.0, -0.5, 0.3, 0.0, 0.0, 0.0
            )
            mixed.append((stamp + 4000, logs.packed(other, 7 * k, component=154)))
    return logs.telemetry(path, mixed)


def two_flights(path: Path) -> Path:
    """Write telemetry of a station that recorded on while the battery was changed."""
    every = logs.frames()
    later_us = every[-1][0] - every[0][0] + 120_000_000
    return logs.telemetry(path, every + [(stamp + later_us, frame) for stamp, frame in every])


def table(change: Callable[[pd.DataFrame], pd.DataFrame]) -> Callable[[Path], Path]:
    """Return who writes the table, changed."""
    return lambda path: logs.text(path, logs.lines(change(logs.table())))


def header_trailing(path: Path) -> Path:
    """Write a comma behind the last name."""
    names, *rows = logs.lines(logs.table())
    return logs.text(path, [f"{names},", *rows])


def glued_rows(path: Path) -> Path:
    """Write a few cut rows with the next one behind them."""
    every = logs.lines(logs.table())
    for k in (600, 800, 1000):
        every[k] = every[k][: len(every[k]) // 2] + every[k + 1]
        every[k + 1] = ""
    return logs.text(path, [line for line in every if line])


def micros_wrap(path: Path) -> Path:
    """Write 32-bit microseconds that begin again, and the map with them."""
    rows = logs.table()
    us = (np.round(rows["t_s"] * 1e6).astype(np.int64) + 2**32 - 8_000_000) % 2**32
    names = [name for name in rows if name != "t_s"]
    lines = "".join(f'{name} = "{name}"\n' for name in names)
    path.with_suffix(".toml").write_text(MICROS_MAP + lines)
    return logs.text(path, logs.lines(rows.assign(us=us).drop(columns="t_s")))


def swapped(rows: pd.DataFrame) -> pd.DataFrame:
    """Return two surfaces exchanged."""
    return rows.rename(columns={"aileron_rad": "rudder_rad", "rudder_rad": "aileron_rad"})


INPUTS: dict[str, Callable[[Path], Path]] = {
    "px4_same.ulg": logs.px4,
    "px4_synthetic_airspeed.ulg": synthetic_airspeed,
    "px4_unix_time.ulg": unix_time,
    "px4_gps_before_only.ulg": gps_before_only,
    "ap_same.bin": logs.ardupilot,
    "ap_two_boots.bin": two_boots,
    "ap_passthrough.bin": passed_through,
    "ap_same_name.bin": same_name,
    "tlog_same.tlog": lambda path: logs.telemetry(path, logs.frames()),
    "tlog_gimbal.tlog": gimbal,
    "tlog_two_flights.tlog": two_flights,
    "same.csv": table(lambda rows: rows),
    "header_trailing.csv": header_trailing,
    "glued_rows.csv": glued_rows,
    "micros_wrap.csv": micros_wrap,
    "coarse_time.csv": table(lambda rows: rows.assign(t_s=rows["t_s"].round(1))),
    "aileron_rudder_swapped.csv": table(swapped),
}
