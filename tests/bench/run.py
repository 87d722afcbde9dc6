"""`make bench`: what damage costs and how fast a log becomes numbers, against two peers.

    python tests/bench/run.py            # both tables, about five minutes
    python tests/bench/run.py --large    # and the memory of converting a 2 GB log to Parquet

All figures of a run come from one machine, one content: the same synthetic flight as our log, as
a PX4 ULog and as an ArduPilot DataFlash log. Nothing here was flown.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "host/src"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.bench import decode_damage, decode_logs

ROOT = Path(__file__).resolve().parents[2]
LIMIT_RATIO, PYULOG_RATIO, PYMAVLINK_RATIO = 0.5, 3.0, 40.0
LARGE_BYTES = 2_000_000_000
LARGE_LIMIT_MB = 1500.0


class Bench:
    """Runs measurements, each in a process of its own, and remembers the medians."""

    def __init__(self, folder: Path, runs: int) -> None:
        self.folder = folder
        self.runs = runs
        self.files = {
            "ours": folder / "flight.bin",
            "numpy": folder / "idents.bin",
            "pyulog": folder / "flight.ulg",
            "pymavlink": folder / "flight_df.bin",
        }

    def write_logs(self, minutes: int) -> None:
        """Write the flight in all forms."""
        decode_logs.write_ours(self.files["ours"], minutes)
        decode_logs.write_ulog(self.files["pyulog"], minutes)
        decode_logs.write_dataflash(self.files["pymavlink"], minutes)
        decode_logs.packed_idents(minutes).tofile(self.files["numpy"])

    def measure(self, what: str) -> dict[str, float]:
        """Return the median run of one measurement by CPU time."""
        who = what.split("_")[1]
        runs = 1 if who == "pymavlink" else self.runs
        done = [measured(what, self.files[who]) for _ in range(runs)]
        middle = statistics.median_low([run["cpu_s"] for run in done])
        return next(run for run in done if run["cpu_s"] == middle)


def measured(what: str, file: Path) -> dict[str, float]:
    """Run one measurement in a fresh process."""
    path = os.pathsep.join((str(ROOT), str(ROOT / "host/src")))
    done = subprocess.run(
        [sys.executable, "-m", "tests.bench.decode_measure", what, str(file)],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": path},
    )
    if done.returncode:
        raise SystemExit(f"bench: {what} failed:\n{done.stderr}")
    return {key: float(value) for key, value in json.loads(done.stdout).items()}


def print_damage(seconds: int, seeds: int) -> None:
    """Print the damage table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log"
        minutes = max(1, seconds // 60)
        decode_logs.write_ours(path, minutes)
        ours = path.read_bytes()
        decode_logs.write_ulog(path, minutes)
        ulog = path.read_bytes()
        decode_logs.write_dataflash(path, minutes)
        dataflash = path.read_bytes()
    print(f"\nDamage: {minutes} min of flight, {seeds} seeds each; % of rows kept (median, worst),")
    print("rows returned that were never recorded, and how often the decoder said so\n")
    readers = (
        ("host", decode_damage.read_ours, ours),
        ("pyulog (sync)", decode_damage.read_ulog, ulog),
        ("pymavlink", decode_damage.read_dataflash, dataflash),
    )
    print(f"{'':18}" + "".join(f" | {name:36}" for name, _, _ in readers))
    print(f"{'':18}" + f" | {'  median    worst  wrong':36}" * len(readers))
    for damage in decode_damage.DAMAGES:
        cells = [
            decode_damage.outcome(read, clean, damage, seeds).text() for _, read, clean in readers
        ]
        print(f"{damage:18}" + "".join(f" | {cell:36}" for cell in cells), flush=True)


def print_speed(bench: Bench) -> list[str]:
    """Print the speed tables; return what falls short of the goals."""
    short = []
    goals = {"columns_numpy": LIMIT_RATIO, "columns_pyulog": PYULOG_RATIO}
    goals["columns_pymavlink"] = PYMAVLINK_RATIO
    for title, ours, others in (
        (
            "File to calibrated float64 columns (ours: every CRC-32 checked)",
            "columns_ours",
            ("columns_numpy", "columns_pyulog", "columns_pymavlink", "table_ours"),
        ),
        (
            "File to CSV in SI (ours: the whole table; *tool*: the peer's own program, raw counts)",
            "csv_ours",
            ("csv_pyulog", "csv_pymavlink", "csvtool_pyulog", "csvtool_pymavlink"),
        ),
        (
            "File to Parquet in SI (ours: the whole table)",
            "parquet_ours",
            ("parquet_pyulog", "parquet_pymavlink"),
        ),
    ):
        print(f"\n{title}\n")
        print(
            f"{'':20} {'samples/s':>11} {'columns':>8} {'CPU s':>8} {'wall s':>8} {'peak MB':>8}"
            "   ours is"
        )
        base = bench.measure(ours)
        speed = base["rows"] / base["cpu_s"]
        _print_line(ours, base, "")
        for what in others:
            run = bench.measure(what)
            ratio = speed / (run["rows"] / run["cpu_s"])
            goal = goals.get(what)
            note = f" (goal {goal:g})" if goal else ""
            _print_line(what, run, f"{ratio:.2f} x{note}")
            if goal and ratio < goal:
                short.append(f"{what}: {ratio:.2f} x, goal {goal:g} x")
    return short


def print_large(folder: Path) -> list[str]:
    """Print the memory of converting a 2 GB log to Parquet; return what falls short."""
    from tests.protocol.flights import large_log

    path = folder / "large.bin"
    large_log(path, LARGE_BYTES)
    run = measured("parquet_ours", path)
    size = path.stat().st_size
    print(f"\n{size / 1e9:.2f} GB log to Parquet: {run['rows']:.0f} rows, {run['wall_s']:.0f} s,")
    print(f"peak memory {run['peak_mb']:.0f} MB (goal below {LARGE_LIMIT_MB:.0f} MB)")
    return [] if run["peak_mb"] < LARGE_LIMIT_MB else [f"2 GB log: {run['peak_mb']:.0f} MB"]


def main() -> int:
    """Run the command line; return 0, or 6 if a goal is missed."""
    parser = argparse.ArgumentParser(prog="tests/bench/run.py", description=__doc__)
    parser.add_argument("--minutes", type=int, default=60, help="flight for the speed table")
    parser.add_argument("--runs", type=int, default=5, help="runs of each fast measurement")
    parser.add_argument("--seeds", type=int, default=12, help="seeds of each damage")
    parser.add_argument("--large", action="store_true", help="also convert a 2 GB log")
    parser.add_argument("--only", choices=("damage", "speed", "large"), help="one part only")
    options = parser.parse_args()
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    short: list[str] = []
    if options.only in (None, "damage"):
        print_damage(60, options.seeds)
    with tempfile.TemporaryDirectory() as folder:
        if options.only in (None, "speed"):
            bench = Bench(Path(folder), options.runs)
            bench.write_logs(options.minutes)
            print(f"\nSpeed: {options.minutes} min of flight at {decode_logs.RATE_HZ} Hz as "
                  + ", ".join(f"{f.stat().st_size / 1e6:.1f} MB ({n})"
                              for n, f in bench.files.items()))  # fmt: skip
            short += print_speed(bench)
        if options.large or options.only == "large":
            short += print_large(Path(folder))
    print()
    for line in short:
        print(f"missed: {line}")
    return 6 if short else 0


def _print_line(what: str, run: dict[str, float], ratio: str) -> None:
    speed = run["rows"] / run["cpu_s"]
    print(
        f"{what:20} {speed:11,.0f} {run['columns']:8.0f} {run['cpu_s']:8.3f} {run['wall_s']:8.3f}"
        f" {run['peak_mb']:8.0f}   {ratio}",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main())
