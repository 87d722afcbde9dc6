"""`host info` and `host identify` on 99 MiB of ULog: processor time and memory, and next to them
those of another worktree in the same run.

    .venv/bin/python tests/bench/identify_large.py --against ../other   # ten minutes

The virtual flight `demo` is written again and again, its times moved on: 44 minutes, 81 test points
at the size of 99 MiB.
"""

from __future__ import annotations

import argparse
import struct
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

ASKED = {"info": ("info",), "identify": ("identify", "--model", "short-period")}
GAP_US = 100_000  # between the end of one flight and the start of the next


def period_us(raw: bytes) -> int:
    """Return how long a ULog lasts, by the times of its data."""
    at, times = 16, []
    while at + 3 <= len(raw):
        if raw[at + 2 : at + 3] == b"D":
            times.append(struct.unpack_from("<Q", raw, at + 5)[0])
        at += 3 + (raw[at] | raw[at + 1] << 8)
    return int(max(times) - min(times)) + GAP_US


def write_repeated(small: Path, target: Path, size_bytes: int) -> None:
    """Write a ULog again and again until it is about so large."""
    from tests.bench.large_imports import parts

    raw = small.read_bytes()
    head, part = parts("ulog", small, period_us(raw))
    with target.open("wb") as file:
        file.write(head)
        for k in range(round((size_bytes - len(head)) / (len(raw) - len(head)))):
            file.write(part(k))


def main() -> int:
    """Print processor seconds and peak memory of each verb, and ratios to the other worktree."""
    from tests.bench.identify_log import spawn

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--size-mib", type=float, default=99.0)
    parser.add_argument("--against", type=Path, help="worktree of the code to compare with")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        quiet = ["--to", "ulog", "--no-picture", "-o", name]
        if spawn(["simulate", "demo", *quiet])[0]:
            raise SystemExit("host simulate ended with an error")
        log = folder / "large.ulg"
        write_repeated(folder / "flight.ulg", log, int(options.size_mib * 2**20))
        print(f"{log.stat().st_size / 2**20:.1f} MiB")
        for verb, (first, *rest) in ASKED.items():
            arguments = [first, str(log), *rest]
            status, _, now_s, now_mb = spawn(arguments)
            line = f"{verb:9s} {now_s:6.1f} s of processor time, {now_mb:4.0f} MB"
            if options.against is not None:
                source = str((options.against / "host/src").resolve())
                _, _, then_s, then_mb = spawn(arguments, PYTHONPATH=source)
                line += f"; the other {then_s:6.1f} s, {then_mb:4.0f} MB"
                line += f"; ratio {now_s / then_s:.2f} and {now_mb / then_mb:.2f}"
            print(line + (f"; exit code {status}" if status else ""), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
