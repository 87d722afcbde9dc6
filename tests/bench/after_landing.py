"""What `host plot` costs of an hour of flight, `host export` of half an hour in six formats.

    python tests/bench/after_landing.py    # about a minute; part of `make bench`

Processor time of the whole command, imports included; of exports over that of a fixed computation
of the same run. Exit code 6 if a limit is missed.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "host/src")]

from tests.bench.fixed_work import unit_s  # noqa: E402
from tests.host.logs import flight, written  # noqa: E402

PLOT_RATIO, PLOT_MB, PAGE_MB = 2.0, 1500.0, 10.0
EXPORT_UNITS = 45.0
FORMATS = ("tlog", "ulog", "kml", "kmz", "gpx", "mcap")
EVERY_S, HELD_S = 45.0, 0.4  # elevator doublets: 80 test points an hour
RUNS = 3


@dataclass(frozen=True)
class Cost:
    """Processor time of a command and the most memory it held."""

    cpu_s: float
    peak_mb: float


def log(path: Path, seconds: float, rate_hz: int) -> Path:
    """Write a flight of elevator doublets, everything else at rest."""
    ident, *slow = flight(seconds, rate_hz=rate_hz)
    rows = ident.rows
    phase_s = (ident.finished_us * 1e-6) % EVERY_S - 10.0
    first, second = ((phase_s >= a * HELD_S) & (phase_s < (a + 1) * HELD_S) for a in (0, 1))
    move = first.astype(float) - second
    for name in ("pot_aileron_left", "pot_aileron_right", "pot_rudder"):
        rows[name] = 2048
    rows["pot_elevator"] = np.rint(2048 + 140 * move)
    rows["dp_a"] = rows["dp_b"] = 2300
    for channel in ("aileron", "rudder", "throttle", "elevator"):
        pulse = np.rint(3000 + 100 * move * (channel == "elevator"))
        rows[f"rc_{channel}"] = rows[f"servo_{channel}"] = pulse
    path.write_bytes(written(ident, *slow, rate_hz=rate_hz))
    return path


def cost(*words: str | Path) -> Cost:
    """Run `host` with these words; return the cheapest of some runs."""
    program = (
        "import resource, runpy, sys\n"
        "try:\n"
        "    runpy.run_module('host', run_name='__main__')\n"
        "finally:\n"
        "    used = resource.getrusage(resource.RUSAGE_SELF)\n"
        "    print(used.ru_utime + used.ru_stime, used.ru_maxrss / 1024, file=sys.stderr)\n"
    )
    runs = []
    for _ in range(RUNS):
        done = subprocess.run(
            [sys.executable, "-c", program, *map(str, words)],
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, "PYTHONPATH": str(ROOT / "host/src"), "OPENBLAS_NUM_THREADS": "1"},
        )
        if done.returncode:
            raise SystemExit(f"host {' '.join(map(str, words))} failed:\n{done.stderr}")
        runs.append(Cost(*map(float, done.stderr.split()[-2:])))
    return min(runs, key=lambda run: run.cpu_s)


def main() -> int:
    """Measure and print; 6 if a limit is missed."""
    lines: list[tuple[str, float, float, str]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        hour = log(folder / "hour.bin", 3600.0, 200)
        decode = cost("decode", hour, "--to", "parquet", "-o", folder / "hour")
        page = folder / "hour.html"
        plot = cost("plot", hour, "-o", page)
        ratio = plot.cpu_s / decode.cpu_s
        words = f"plot of an hour at 200 Hz ({plot.cpu_s:.1f} s) over decode --to parquet"
        lines.append((words, ratio, PLOT_RATIO, "x"))
        lines.append(("its memory", plot.peak_mb, PLOT_MB, "MB"))
        lines.append(("its page", page.stat().st_size / 1e6, PAGE_MB, "MB"))
        half = log(folder / "half.bin", 1800.0, 100)
        one_s = unit_s()
        for kind in FORMATS:
            made = cost("export", half, "--to", kind, "-o", folder)
            words = f"export of 30 min at 100 Hz to {kind} ({made.cpu_s:.1f} s)"
            lines.append((words, made.cpu_s / one_s, EXPORT_UNITS, "u"))
    for text, value, limit, unit in lines:
        kept = "" if value <= limit else "  MISSED"
        print(f"{text:66} {value:8.2f} {unit:3} limit {limit:g}{kept}")
    return 6 if any(value > limit for _, value, limit, _ in lines) else 0


if __name__ == "__main__":
    sys.exit(main())
