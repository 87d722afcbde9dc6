"""What forged logs cost: processor time and memory of hostile files against a clean log's.

    python -m tests.protocol.costs --blocks 2000 32768

Files of the original logger's rows are held against a clean file of such rows. Each file is read
in a process of its own: `read_log`, its table, its ledger, the summary. Exit code 1 if one takes
more than 20 times the clean file's time, or more than 300 MB plus eight times its size. Times are
of the processor, so that a busy machine spoils them less; `make test` has none.
"""

import argparse
import json
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from tests.protocol.flights import large_log, simple_log
from tests.protocol.forging import sealed
from tests.protocol.log_writer import BLOCK, HEADER, MAGIC, ROOM

MOST_TIMES = 20.0
MOST_BYTES, MOST_PER_BYTE = 300 << 20, 8
READ = """
import json, pathlib, resource, sys, time, warnings
import pandas, scipy.io
from host.decode.log_summary import summarise
from host.errors import HostError
from host.log import read_log
from host.original.rows import read_rows
from host.original.row_table import make_table
from host.physical.calibration import load_calibration
calibration = load_calibration()
warnings.simplefilter("ignore")
began = time.process_time()
try:
    if sys.argv[1].endswith(".txt"):
        rows = read_rows(pathlib.Path(sys.argv[1]))
        table = pandas.DataFrame(make_table(rows, calibration).columns)
        end = f"{rows.variant}, {len(table)} rows"
    else:
        log = read_log(sys.argv[1], calibration=calibration)
        table = log.table()
        said = summarise(log)
        end = f"{log.complete}, {len(table)} rows, {len(log.loss.losses)} losses"
except HostError as error:
    end = type(error).__name__
took = time.process_time() - began
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10
print(json.dumps({"s": took, "bytes": peak, "end": end}))
"""

# As the original logger printed them, and the shortest that are read.
PRINTED_ROW = (
    b"RLL:0.07,PCH:0.08,YAW:0.33,altitude:-0.50,velocity:0.00,elev:-683,ail:-713,rdr:-713,"
    b"alpha:-737,beta:-690,AN0:0.13,AN1:-0.62,AN2:0.22,AN3:17.78, AN4:-0.08,AN5:8190.33,"
    b"lat:0.00,lon:0.00,gpsalt:17.00 , gpsgc0.00,gpsgs0.00, fix:0,numsat:0,elevs:0,ails:0, "
    b"ruds:0,throts:0\n"
)
SHORT_ROW = b"RLL:0.07,PCH:0.08,YAW:0.33,AN0:0.13,AN1:0.22,AN2:1.00\n"
FLIGHT = simple_log(8.0)
BASE = FLIGHT.data()
ROWS = {name: FLIGHT.truth(name)[0] for name in FLIGHT.layouts}


def blocks(
    count: int,
    payload: Callable[[int], bytes],
    *,
    sequence: Callable[[int], int] = lambda at: at,
    file_id: Callable[[int], int] = lambda at: FLIGHT.file_id,
    session: Callable[[int], int] = lambda at: 1,
    schema: Callable[[int], int] = lambda at: FLIGHT.schema_hash,
    kind: int = 0,
) -> bytes:
    """Return sealed blocks behind a flight of 8 s."""
    made = []
    for at in range(count):
        inside = payload(at)
        number = (FLIGHT.sequence + sequence(at)) % 2**32
        ids = (file_id(at), session(at), number, schema(at), 0, len(inside), kind, 0)
        made.append(sealed(HEADER.pack(MAGIC, *ids) + inside.ljust(ROOM, b"\0") + bytes(4)))
    return BASE + b"".join(made)


def frames(name: str, count: int, /, **columns: object) -> Callable[[int], bytes]:
    """Return payloads full of one kind of frame."""
    size = ROWS[name].dtype.itemsize
    each = ROOM // size
    rows = np.resize(ROWS[name], each * count)
    for column, values in columns.items():
        rows[column] = values
    body = rows.tobytes()
    return lambda at: body[at * each * size : (at + 1) * each * size]


def hostile(count: int) -> dict[str, Callable[[], bytes]]:
    """Return makers of files of about `count` blocks, by what is wrong with them."""
    size = count * BLOCK
    rng = np.random.default_rng(1)
    plain = frames("ident", count)
    many = np.arange(ROOM // ROWS["ident"].dtype.itemsize * count)
    gps = {"t_us": rng.integers(0, 2**32, ROOM // ROWS["gps"].dtype.itemsize * count)}
    words = rng.integers(0, 2**32, ROOM // ROWS["event"].dtype.itemsize * count)
    hours = np.arange(ROOM // ROWS["system"].dtype.itemsize * count) * 5000
    order = rng.permutation(count)
    resets = 40 + count // 30  # hardly fewer than are refused
    return {
        "magics": lambda: (MAGIC * (size // 4 + 1))[:size],
        "headers every 7 bytes": lambda: ((MAGIC + bytes(3)) * (size // 7 + 1))[:size],
        "every other block bad": lambda: b"".join(
            MAGIC + bytes([1 + at % 255]) * 508 if at % 2 else BASE[at % 40 * BLOCK :][:BLOCK]
            for at in range(count)
        ),
        "a session per block": lambda: blocks(count, plain, session=lambda at: at + 2),
        "as many sessions as can be": lambda: blocks(
            count, plain, session=lambda at: 2 + at * resets // count
        ),
        "a file id per block": lambda: blocks(count, plain, file_id=lambda at: at),
        "a schema per block": lambda: blocks(
            count, lambda at: struct.pack("<HH", 0, 2) + b"{}", schema=lambda at: at, kind=1
        ),
        "pieces of one byte": lambda: blocks(
            count, lambda at: struct.pack("<HH", at % 65535, 65535) + b"x", kind=1
        ),
        "every other block gone": lambda: blocks(count, plain, sequence=lambda at: 2 * at),
        "sequences far apart": lambda: blocks(count, plain, sequence=lambda at: at * 30_000),
        "blocks in any order": lambda: blocks(count, plain, sequence=lambda at: 3 * int(order[at])),
        "counts at random": lambda: blocks(
            count, frames("ident", count, count=rng.integers(0, 65536, len(many)))
        ),
        "clocks at random": lambda: blocks(
            count, frames("ident", count, t_us=rng.integers(0, 2**32, len(many)))
        ),
        "clocks of the GPS at random": lambda: blocks(count, frames("gps", count, **gps)),
        "uptimes of years": lambda: blocks(
            count, frames("system", count, uptime_s=hours % 2**32), sequence=lambda at: 2 * at
        ),
        "blocks refused": lambda: blocks(
            count, frames("event", count, code=4, arg=words), sequence=lambda at: 2 * at
        ),
        "payloads at random": lambda: blocks(count, lambda at: rng.bytes(ROOM)),
        "unknown frames": lambda: blocks(count, lambda at: b"\xc8" * ROOM),
    }


def hostile_rows(size: int) -> dict[str, bytes]:
    """Return files of original rows by what is wrong with them."""
    rows = {"rows of two fields": b"PCH:1,AN0:1,f\n", "rows of six fields": SHORT_ROW}
    return {what: PRINTED_ROW + row * (size // len(row)) for what, row in rows.items()}


def measured(path: Path) -> tuple[float, int, str]:
    """Return processor time in s, most memory in bytes, and how it ended."""
    ran = subprocess.run(
        [sys.executable, "-c", READ, str(path)], capture_output=True, text=True, check=False
    )
    if ran.returncode:
        last = ran.stderr.strip().rpartition("\n")[2]
        raise SystemExit(f"costs: {path.name} was not measured: {last}")
    said = json.loads(ran.stdout)
    return said["s"], said["bytes"], said["end"]


def compare(count: int, clean: Path, files: Iterable[tuple[str, bytes]]) -> tuple[list[str], float]:
    """Print what files cost against a clean one; return those that cost too much, most times."""
    clean_s, clean_bytes, end = measured(clean)
    print(
        f"{count:6d} blocks  {'clean':28s} {clean_s:7.3f} s {clean_bytes >> 20:5d} MiB"
        f"             {end}"
    )
    limit = MOST_BYTES + MOST_PER_BYTE * count * BLOCK
    bad_ones, most = [], 0.0
    for what, data in files:
        clean.write_bytes(data)
        took_s, peak, end = measured(clean)
        bad = took_s > MOST_TIMES * clean_s or peak > limit
        bad_ones += [what] if bad else []
        most = max(most, took_s / clean_s)
        print(
            f"{count:6d} blocks  {what:28s} {took_s:7.3f} s {peak >> 20:5d} MiB"
            f" {took_s / clean_s:6.1f} times{'  TOO MUCH' if bad else ''}  {end}",
            flush=True,
        )
    return bad_ones, most


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="costs", description=__doc__)
    parser.add_argument("--blocks", type=int, nargs="+", default=[2000])
    bad_ones: list[str] = []
    most = 0.0
    with tempfile.TemporaryDirectory() as name:
        for count in parser.parse_args(arguments).blocks:
            size = count * BLOCK
            path, rows = Path(name) / "flight.bin", Path(name) / "rows.txt"
            large_log(path, size)
            rows.write_bytes((PRINTED_ROW * (size // len(PRINTED_ROW) + 1))[:size])
            for clean, files in (
                (path, ((what, make()) for what, make in hostile(count).items())),
                (rows, hostile_rows(size).items()),
            ):
                bad, times = compare(count, clean, files)
                bad_ones += bad
                most = max(most, times)
    print(f"at most {most:.1f} times a clean log's time; too much: {', '.join(bad_ones) or 'none'}")
    return 1 if bad_ones else 0


if __name__ == "__main__":
    sys.exit(main())
