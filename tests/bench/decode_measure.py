"""One measurement in a process of its own: `python -m tests.bench.decode_measure WHAT FILE`.

Prints one line of JSON: seconds without imports, rows (samples) and columns, peak memory.
A cold process per run, because memory once touched makes every later run look faster.
"""

import argparse
import contextlib
import importlib
import io
import json
import resource
import runpy
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.bench.decode_logs import dataflash_messages

Columns = dict[str, NDArray[np.float64]]
Made = tuple[int, int]  # rows and columns

# Zero and slope that stand for a calibration on the peers' and on numpy's side: two operations
# per value, as for ours.
ZERO, SLOPE = 12.5, 1.7e-3
# Fields of the identification frame that are channels; count, age, sequence and valid are not.
INERTIAL = ("p", "q", "r", "ax", "ay", "az", "phi", "theta", "psi")
VANES = ("alpha_a", "alpha_b", "beta_a", "beta_b", "dp_a", "dp_b")
POTS = ("pot_elevator", "pot_aileron_left", "pot_aileron_right", "pot_rudder")
SERVOS = ("servo_aileron", "servo_elevator", "servo_rudder", "servo_throttle")
RECEIVER = ("rc_aileron", "rc_elevator", "rc_rudder", "rc_throttle", "rc_switch")
CHANNELS = (*INERTIAL, *VANES, *POTS, *SERVOS, *RECEIVER)


def scaled(raw: NDArray[np.generic]) -> NDArray[np.float64]:
    """Return (raw - zero) * slope as float64."""
    value = raw.astype(np.float64)
    value -= ZERO
    value *= SLOPE
    return value


def columns_ours(path: Path) -> Made:
    """Our log to calibrated float64 columns, every CRC checked."""
    from host.log import read_log

    return _size(read_log(path).channels())


def table_ours(path: Path) -> Made:
    """Our log to the whole synchronous table: delays removed, air data, barometer, GPS."""
    from host.log import read_log

    table = read_log(path).table()
    return len(table), table.shape[1]


def columns_numpy(path: Path) -> Made:
    """The limit: bare identification frames, no blocks, no CRC, the same channels scaled."""
    from tests.protocol.log_writer import layouts, schema_text

    frames = np.fromfile(path, layouts(schema_text())["ident"])
    columns = {name: scaled(frames[name]) for name in CHANNELS}
    columns["t_s"] = frames["t_us"] * 1e-6
    return _size(columns)


def columns_pyulog(path: Path) -> Made:
    """ULog to the same columns."""
    return _size(_pyulog(path))


def columns_pymavlink(path: Path) -> Made:
    """DataFlash to the same columns."""
    return _size(_pymavlink(path))


def csv_ours(path: Path) -> Made:
    """`host decode --to csv`: the whole table."""
    return _decode(path, "csv")


def parquet_ours(path: Path) -> Made:
    """`host decode --to parquet`: the whole table."""
    return _decode(path, "parquet")


def csv_pyulog(path: Path) -> Made:
    """ULog to the same columns, then pandas to CSV."""
    return _write(_pyulog(path), "csv")


def csv_pymavlink(path: Path) -> Made:
    """DataFlash to the same columns, then pandas to CSV."""
    return _write(_pymavlink(path), "csv")


def csvtool_pyulog(path: Path) -> Made:
    """ulog2csv of the identification topic, the barometer and GPS: raw counts."""
    from pyulog.ulog2csv import convert_ulog2csv

    with tempfile.TemporaryDirectory() as folder:
        convert_ulog2csv(str(path), "ident,baro,gps", folder, ",", None, None)
        (made,) = Path(folder).glob("*_ident_0.csv")
        return _csv_size(made)


def csvtool_pymavlink(path: Path) -> Made:
    """Mavlogdump --format csv: it takes one type of message, so a third of the channels."""
    script = Path(sys.executable).parent / "mavlogdump.py"
    sys.argv = [str(script), "--format", "csv", "--types", "ID0", str(path)]
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "ID0.csv"
        with made.open("w") as file, contextlib.redirect_stdout(file):
            runpy.run_path(str(script), run_name="__main__")
        return _csv_size(made)


def parquet_pyulog(path: Path) -> Made:
    """ULog to the same columns, then pandas to Parquet."""
    return _write(_pyulog(path), "parquet")


def parquet_pymavlink(path: Path) -> Made:
    """DataFlash to the same columns, then pandas to Parquet."""
    return _write(_pymavlink(path), "parquet")


def _decode(path: Path, kind: str) -> Made:
    from host.decode.decoding import decode
    from host.decode.writing import Request
    from host.physical.columns import COLUMNS

    with tempfile.TemporaryDirectory() as folder:
        done = decode(Request(path, output=str(Path(folder) / f"table.{kind}")))
        return int(done.summary["rows"]), len(COLUMNS)


def _pyulog(path: Path) -> Columns:
    from pyulog import ULog

    data = ULog(str(path)).get_dataset("ident").data
    columns = {name: scaled(data[name]) for name in CHANNELS}
    columns["t_s"] = data["timestamp"] * 1e-6
    return columns


def _pymavlink(path: Path) -> Columns:
    from pymavlink.DFReader import DFReader_binary

    reader = DFReader_binary(str(path))
    wanted = {message.name: message for message in dataflash_messages()}
    rows: dict[str, list[list[float]]] = {name: [] for name in wanted}
    while (message := reader.recv_msg()) is not None:
        name = message.fmt.name
        if name in rows:
            rows[name].append(message._elements)
    columns = {}
    for name, message_of in wanted.items():
        if message_of.frame != "ident":
            continue
        values = np.array(rows[name], np.float64)
        for number, field in enumerate(message_of.fields):
            if field in CHANNELS:
                columns[field] = scaled(values[:, number + 1])
        columns["t_s"] = values[:, 0] * 1e-6
    return columns


def _write(columns: Columns, kind: str) -> Made:
    import pandas as pd

    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / f"table.{kind}"
        table = pd.DataFrame(columns)
        if kind == "csv":
            table.to_csv(target, index=False)
        else:
            table.to_parquet(target)
    return _size(columns)


def _size(columns: Columns) -> Made:
    return len(columns["t_s"]), len(columns)


def _csv_size(path: Path) -> Made:
    with path.open() as file:
        columns = file.readline().count(",") + 1
        return sum(1 for _ in file), columns


# What is imported before the clock starts.
IMPORTS = {
    "ours": (
        *("host.log", "host.decode.decoding", "host.export.csv", "host.export.parquet"),
        "pandas",
    ),
    "numpy": (),
    "pyulog": ("pyulog", "pyulog.ulog2csv", "pandas", "pyarrow.parquet"),
    "pymavlink": ("pymavlink.DFReader", "pymavlink.mavutil", "pandas", "pyarrow.parquet"),
}
IN_MEMORY = (columns_ours, table_ours, columns_numpy, columns_pyulog, columns_pymavlink)
TO_CSV = (csv_ours, csv_pyulog, csv_pymavlink, csvtool_pyulog, csvtool_pymavlink)
TO_PARQUET = (parquet_ours, parquet_pyulog, parquet_pymavlink)
MEASURES: dict[str, Callable[[Path], Made]] = {
    function.__name__: function for function in (*IN_MEMORY, *TO_CSV, *TO_PARQUET)
}


def main() -> None:
    """Run one measurement and print it."""
    parser = argparse.ArgumentParser(prog="decode_measure", description=__doc__)
    parser.add_argument("what", choices=sorted(MEASURES))
    parser.add_argument("file", type=Path)
    options = parser.parse_args()
    for module in IMPORTS[options.what.split("_")[1]]:
        importlib.import_module(module)
    with options.file.open("rb") as file:  # a warm cache for everybody
        while file.read(1 << 22):
            pass
    silent = io.StringIO()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with contextlib.redirect_stdout(silent), contextlib.redirect_stderr(silent):
        cpu, wall = time.process_time(), time.perf_counter()
        rows, columns = MEASURES[options.what](options.file)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(
        json.dumps(
            {
                "wall_s": wall,
                "cpu_s": cpu,
                "rows": rows,
                "columns": columns,
                "peak_mb": peak / 1024,
                "base_mb": before / 1024,
            }
        )
    )


if __name__ == "__main__":
    main()
