"""Logs and tables as the field has them: one virtual flight's, read, changed and written again."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
from host.export.dataflash_writer import Records, write_dataflash
from host.export.ulog_writer import topic, write_ulog
from host.readers.dataflash_binary import read_records
from numpy.typing import NDArray

from tests.host.readers.autopilot_flights import truth, write

Columns = dict[str, NDArray[Any]]
Topics = dict[tuple[str, int], Columns]
SYSTEM, AUTOPILOT = 1, 1
COLUMNS = (
    "t_s", "airspeed_mps", "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps", "ax_mps2",
    "ay_mps2", "az_mps2", "phi_rad", "theta_rad", "elevator_rad", "aileron_rad", "rudder_rad",
)  # fmt: skip


@cache
def _bytes(kind: str) -> bytes:
    with TemporaryDirectory() as folder:
        return write(kind, Path(folder)).read_bytes()


@cache
def _ulog() -> tuple[Topics, dict[str, float]]:
    """Return topics by name and instance, and the parameters, of the virtual flight's ULog."""
    from pyulog import ULog

    with TemporaryDirectory() as folder:
        log = ULog(str(write("ulog", Path(folder))))
    found: Topics = {}
    for one in log.data_list:
        columns: Columns = {}
        for key, values in one.data.items():
            base, bracket, _ = key.partition("[")
            if bracket:
                before = columns.get(base)
                column = values[:, None]
                columns[base] = column if before is None else np.hstack([before, column])
            else:
                columns[key] = values
        found[one.name, one.multi_id] = columns
    return found, dict(log.initial_parameters)


def px4(
    path: Path,
    change: Callable[[Topics], None] = lambda _: None,
    parameters: Mapping[str, float] | None = None,
) -> Path:
    """Write the flight as PX4 logs it, its topics changed."""
    topics, said = _ulog()
    own = {key: dict(columns) for key, columns in topics.items()}
    change(own)
    typed = {
        k: int(v) if isinstance(v, int | np.integer) else float(v)
        for k, v in {**said, **(parameters or {})}.items()
    }
    write_ulog(
        path,
        [topic(name, instance, **columns) for (name, instance), columns in own.items()],
        parameters=typed,
        information={"sys_name": "PX4", "ver_hw": "SIMULATED", "ver_sw_branch": "v1.16"},
    )
    return path


Kinds = dict[str, tuple[str, Columns]]


@cache
def _dataflash() -> Kinds:
    with TemporaryDirectory() as folder:
        found = read_records(write("dataflash", Path(folder)))
        return {
            kind.name: (kind.letters, found.rows(kind, found.places[number]))
            for number, kind in found.kinds.items()
            if kind.name != "FMT" and len(found.places[number])
        }


def ardupilot(path: Path, change: Callable[[Kinds], None] = lambda _: None) -> Path:
    """Write the flight as ArduPilot logs it, its kinds of records changed."""
    kinds = {name: (letters, dict(fields)) for name, (letters, fields) in _dataflash().items()}
    change(kinds)
    write_dataflash(path, [Records(name, letters, f) for name, (letters, f) in kinds.items()])
    return path


def bench(kinds: Kinds) -> None:
    """Keep the first two seconds, in which nothing moves."""
    for name, (letters, fields) in list(kinds.items()):
        early = np.flatnonzero(fields["TimeUS"] < 2e6)
        kinds[name] = letters, {key: values[early] for key, values in fields.items()}
        if not len(early):
            del kinds[name]


def set_parameters(**values: float) -> Callable[[Kinds], None]:
    """Return a change that gives parameters other values."""

    def change(kinds: Kinds) -> None:
        letters, fields = kinds["PARM"]
        names = [bytes(n).decode().strip("\0") for n in fields["Name"]]
        new = np.array(fields["Value"])
        for name, value in values.items():
            new[names.index(name)] = value
        kinds["PARM"] = letters, {**fields, "Value": new}

    return change


def frames() -> list[tuple[int, bytes]]:
    """Return the ground station's time, us, and the bytes of each frame of the telemetry log."""
    data, at, found = _bytes("tlog"), 0, []
    while at < len(data):
        (stamp,) = struct.unpack(">Q", data[at : at + 8])
        size = data[at + 9] + (12 if data[at + 8] == 0xFD else 8)
        found.append((stamp, data[at + 8 : at + 8 + size]))
        at += 8 + size
    return found


def telemetry(path: Path, every: list[tuple[int, bytes]]) -> Path:
    """Write frames as a ground station records them."""
    path.write_bytes(b"".join(struct.pack(">Q", stamp) + frame for stamp, frame in every))
    return path


def decoded(every: list[tuple[int, bytes]]) -> list[tuple[int, Any, bytes]]:
    """Return time, message and bytes of frames."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    parser = dialect.MAVLink(None, srcSystem=SYSTEM, srcComponent=AUTOPILOT)
    return [(stamp, parser.decode(bytearray(frame)), frame) for stamp, frame in every]


def packed(message: Any, number: int, component: int = AUTOPILOT) -> bytes:
    """Return the frame of a message that a component of the vehicle sends."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    link = dialect.MAVLink(None, srcSystem=SYSTEM, srcComponent=component)
    link.seq = number % 256
    return bytes(message.pack(link))


def table() -> pd.DataFrame:
    """Return the flight as a self-made logger writes it, SI columns at 100 Hz."""
    whole = truth()
    step = round(0.01 / float(np.median(np.diff(whole["t_s"]))))
    rows = whole[[name for name in COLUMNS if name in whole]].iloc[:: max(step, 1)]
    rng = np.random.default_rng(5)
    noisy = rows + rng.normal(0.0, 1e-3, rows.shape)
    return noisy.assign(t_s=rows["t_s"]).reset_index(drop=True)


def lines(rows: pd.DataFrame) -> list[str]:
    """Return a table as lines of text, names first."""
    return rows.to_csv(index=False, float_format="%.6f").splitlines()


def text(path: Path, every: list[str]) -> Path:
    """Write lines."""
    path.write_text("\n".join(every) + "\n")
    return path


def as_text(path: Path, binary: Path) -> Path:
    """Write a DataFlash log in its text form, records in order of time."""
    found = read_records(binary)
    every: list[tuple[float, str]] = []
    head = []
    for number, kind in found.kinds.items():
        columns = found.rows(kind, found.places[number])
        if kind.name == "FMT" or not len(found.places[number]):
            continue
        head.append(f"FMT, {number}, {kind.length}, {kind.name}, {kind.letters}, {kind.columns}")
        for row in zip(*(values.tolist() for values in columns.values()), strict=True):
            words = [v.decode().strip("\0") if isinstance(v, bytes) else repr(v) for v in row]
            every.append((float(row[0]), ", ".join([kind.name, *words])))
    every.sort(key=lambda one: one[0])
    return text(path, [*head, *(line for _, line in every)])
