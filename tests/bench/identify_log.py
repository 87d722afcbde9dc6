"""Time and memory of `host identify` on a recorded log, in a process of its own.

The logs come from the recorder run on this computer over simulated flights; without `host
simulate` and its library (`make sitl`) there is nothing to measure. Limits are processor time over
that of a fixed computation of the same run, so that a slow or busy machine does not count.
"""

import os
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from host import read_log
from tests.bench.fixed_work import unit_s

HEAD = 'format = 1\ntitle = "timing"\naircraft = "ultrastick25e"\n[air]\nturbulence_mps = 0.3\n'
MANEUVERS = (
    ("3211", "elevator", 3.0, 0.25),
    ("doublet", "elevator", 3.0, 0.3),
    ("doublet", "aileron", 4.0, 0.4),
    ("doublet", "rudder", 6.0, 0.5),
)
# minutes, maneuvers, rest between them in s, limit in units of the fixed computation
CASES = ((5, 12, 18.5, 20.0), (30, 40, 38.6, 80.0))
# What is asked of the same log: the verb's default, and with it coefficients from the flight.
DEFAULT: tuple[str, ...] = ()
WHOLE = tuple(f"--model={m}" for m in ("longitudinal", "lateral", "coefficients"))
RUNS = 3
IMPORT_LIMIT = 6.0
FIRST_LIMIT = 30.0  # twice what it takes
STARTER = """
import os, sys, time
begin = time.perf_counter()
nothing = os.open(os.devnull, os.O_WRONLY)
quiet = [(os.POSIX_SPAWN_DUP2, nothing, stream) for stream in (1, 2)]
child = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ, file_actions=quiet)
_, status, usage = os.wait4(child, 0)
wall_s = time.perf_counter() - begin
processor_s = usage.ru_utime + usage.ru_stime
print(os.waitstatus_to_exitcode(status), wall_s, processor_s, usage.ru_maxrss / 1024.0)
"""
MEMORY_MB = 300.0  # plus ten times the log


@dataclass(frozen=True)
class Run:
    """Identifications of one log, from file to printed answer; seconds of each, peak of all."""

    minutes: float
    log_mb: float
    wall_s: list[float]
    processor_s: list[float]
    peak_mb: float
    answered: bool

    @property
    def median_s(self) -> float:
        """Median of the processor seconds."""
        return statistics.median(self.processor_s)


def card(maneuvers: int, rest_s: float) -> str:
    """Return a flight card that repeats four maneuvers."""
    text = HEAD
    for k in range(maneuvers):
        kind, axis, amplitude, width_s = MANEUVERS[k % 4]
        text += f'[[segment]]\nkind = "{kind}"\naxis = "{axis}"\n'
        text += f"amplitude = {amplitude}\nwidth_s = {width_s}\n"
        text += f'[[segment]]\nkind = "trim"\nduration_s = {rest_s}\n'
    return text


def spawn(arguments: list[str], **settings: str) -> tuple[int, float, float, float]:
    """Run `host` with one BLAS thread; return status, wall s, processor s and peak MB.

    A small process starts it: Linux counts what the starter held as the peak of the started.
    """
    command = [sys.executable, "-c", STARTER, sys.executable, "-m", "host", *arguments]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", **settings}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    status, wall_s, processor_s, peak_mb = map(float, done.stdout.split())
    return int(status), wall_s, processor_s, peak_mb


def fly(folder: Path, maneuvers: int, rest_s: float) -> float:
    """Fly into a folder; return the minutes of the log."""
    (folder / "card.toml").write_text(card(maneuvers, rest_s))
    status = spawn(["simulate", str(folder / "card.toml"), "--no-picture", "-o", str(folder)])[0]
    if status:
        raise SystemExit(f"host simulate ended with {status}")
    return float(np.ptp(read_log(folder / "flight.bin").columns()["t_s"])) / 60.0


def measure(folder: Path, minutes: float, asked: tuple[str, ...]) -> Run:
    """Identify once to load the caches of the disk, then to measure."""
    log = folder / "flight.bin"
    arguments = ["identify", str(log), "--aircraft", "ultrastick25e"]
    arguments += ["--calibration", str(folder / "calibration.toml"), *asked]
    spawn(arguments)
    runs = [spawn(arguments) for _ in range(RUNS)]
    status, wall_s, processor_s, peak_mb = (list(column) for column in zip(*runs, strict=True))
    size_mb = log.stat().st_size / 1e6
    return Run(minutes, size_mb, wall_s, processor_s, max(peak_mb), answered=not any(status))


def first_answers(folder: Path, unit: float) -> bool:
    """Print what an answer takes on a fresh install and without numba; return whether too long."""
    missed = False
    arguments = ["identify", str(folder / "flight.bin"), "--aircraft", "ultrastick25e"]
    arguments += ["--calibration", str(folder / "calibration.toml"), *WHOLE]
    # Found before the real one, it cannot be imported.
    hidden = folder / "hidden" / "numba"
    hidden.mkdir(parents=True)
    (hidden / "__init__.py").write_text("raise ImportError\n")
    for what, settings in (
        ("on a fresh install", {"NUMBA_CACHE_DIR": str(folder / "cache")}),
        ("without numba", {"PYTHONPATH": str(hidden.parent)}),
    ):
        status, _, processor_s, _ = spawn(arguments, **settings)
        took = processor_s / unit
        print(f"  {what}: {processor_s:.2f} s processor, {took:.1f} units (limit {FIRST_LIMIT})")
        missed |= bool(status) or took > FIRST_LIMIT
    return missed


def imports_s() -> float:
    """Return the processor seconds that Python and the imports of the verb take alone."""
    code = "import host.sysid.linear.linear_estimator, host.sysid.answer.verdict, host.log"
    code += ", host.sysid.flight.flight_tables, host.sysid.reconstruction.reconstruction"
    code += ", host.aircraft.mass_properties"
    before = os.times()
    subprocess.run([sys.executable, "-c", code], check=True)
    after = os.times()
    return sum(after[2:4]) - sum(before[2:4])


def report() -> bool:
    """Print the figures and their limits; return whether one is missed."""
    imports_s()
    loading = statistics.median(imports_s() for _ in range(RUNS))
    unit = unit_s()
    print(f"the fixed computation, a unit: {unit:.3f} s processor")
    took = loading / unit
    print(f"imports of host identify: {loading:.2f} s, {took:.1f} units (limit {IMPORT_LIMIT})")
    missed = took > IMPORT_LIMIT
    for minutes, maneuvers, rest_s, limit in CASES:
        with tempfile.TemporaryDirectory() as name:
            flown = fly(Path(name), maneuvers, rest_s)
            if flown < minutes:
                print(f"  the flight is shorter than {minutes} min: correct its card")
                missed = True
            for what, asked in (("default", DEFAULT), ("and coefficients", WHOLE)):
                run = measure(Path(name), flown, asked)
                most, took = MEMORY_MB + 10.0 * run.log_mb, run.median_s / unit
                print(
                    f"host identify, {what}, {run.minutes:.1f} min with {maneuvers} maneuvers,"
                    f" {run.log_mb:.1f} MB: {run.median_s:.2f} s processor"
                    f" ({min(run.processor_s):.2f}-{max(run.processor_s):.2f};"
                    f" {loading:.2f} imports, {run.median_s - loading:.2f} file to answer),"
                    f" {statistics.median(run.wall_s):.2f} s wall,"
                    f" {took:.1f} units (limit {limit}),"
                    f" {run.peak_mb:.0f} MB (limit {most:.0f} MB, {run.peak_mb / most:.2f} of it)"
                )
                if minutes == CASES[0][0] and asked:
                    missed |= first_answers(Path(name), unit)
                missed |= not run.answered or took > limit or run.peak_mb > most
    return missed
