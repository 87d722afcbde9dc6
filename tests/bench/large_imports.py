"""A gigabyte of ULog, DataFlash and tlog: memory and processor time of reading one.

    .venv/bin/python tests/bench/large_imports.py             # five minutes and 3 GB of disk
    .venv/bin/python tests/bench/large_imports.py --size-mb 100 --only tlog

One virtual flight of 52 s is written again and again, its times moved on, until the log is so
large. Each is read by `host.readers` in a process of its own: messages, channels, judgement, as
`host info` does. Exit code 6 if one takes more than 1.5 GB of memory.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

LIMIT_MB = 1500.0
MEASURE = """
import json, resource, sys, time
from pathlib import Path
from host.readers.autopilot_flight import read_autopilot
begin = time.perf_counter()
flight = read_autopilot(Path(sys.argv[1]))
use = resource.getrusage(resource.RUSAGE_SELF)
peak_kib = next(int(line.split()[1]) for line in open("/proc/self/status") if "VmHWM" in line)
rows = sum(len(m) for every in flight.log.messages.values() for m in every.values())
print(json.dumps({
    "peak_mb": peak_kib * 1024 / 1e6, "cpu_s": use.ru_utime + use.ru_stime, "rows": rows,
    "wall_s": time.perf_counter() - begin, "damage": flight.log.damage,
    "air_s": flight.flown.time_s, "refusal": flight.judgement.refusal,
}))
"""
Bytes = NDArray[np.uint8]
Part = Callable[[int], bytes]


def parts(kind: str, path: Path, period_us: int) -> tuple[bytes, Part]:
    """Return the head of a log, and its body moved on by so many periods."""
    data = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    return {"ulog": _ulog, "dataflash": _dataflash, "tlog": _tlog}[kind](data, path, period_us)


def _moved(body: Bytes, at: NDArray[np.int64], layout: str, step: int) -> None:
    """Add a step to whole numbers at places of a body."""
    size = np.dtype(layout).itemsize
    places = at[:, None] + np.arange(size)
    values = np.ascontiguousarray(body[places]).view(layout)[:, 0]
    step %= 256**size  # a number of 32 bits turns over, as an autopilot's does
    moved = (values + np.array(step, dtype=values.dtype)).astype(layout)
    body[places] = moved[:, None].view(np.uint8)


def _ulog(data: Bytes, _path: Path, period_us: int) -> tuple[bytes, Part]:
    raw, at, first, stamps = data.tobytes(), 16, 0, []
    names: dict[int, str] = {}
    sampled: set[str] = set()
    while at + 3 <= len(raw):
        length, kind = raw[at] | raw[at + 1] << 8, chr(raw[at + 2])
        if kind == "F":
            name, fields = raw[at + 3 : at + 3 + length].decode().split(":")
            if "timestamp_sample" in fields:
                sampled.add(name)
        elif kind == "A":
            number = raw[at + 4] | raw[at + 5] << 8
            names[number] = raw[at + 6 : at + 3 + length].decode()
        elif kind == "D":
            first = first or at
            stamps.append(at + 5)
            if names[raw[at + 3] | raw[at + 4] << 8] in sampled:
                stamps.append(at + 13)
        at += 3 + length
    places = np.array(stamps, dtype=np.int64) - first

    def part(k: int) -> bytes:
        body = data[first:].copy()
        _moved(body, places, "<u8", k * period_us)
        return body.tobytes()

    return raw[:first], part


def _dataflash(_data: Bytes, path: Path, period_us: int) -> tuple[bytes, Part]:
    from host.readers.dataflash_binary import read_records

    found = read_records(path)
    timed = [k for k, kind in found.kinds.items() if kind.columns.startswith("TimeUS")]
    often = [k for k in timed if len(found.places[k]) > 20]
    first = min(int(found.places[k][0]) for k in often)
    at = np.concatenate([found.places[k] for k in timed]).astype(np.int64)
    places = at[at >= first] + 3 - first
    raw = path.read_bytes()
    data = np.frombuffer(raw, dtype=np.uint8)

    def part(k: int) -> bytes:
        body = data[first:].copy()
        _moved(body, places, "<u8", k * period_us)
        return body.tobytes()

    return raw[:first], part


def _tlog(data: Bytes, _path: Path, period_us: int) -> tuple[bytes, Part]:
    from host.readers import mavlink_frames as frames
    from host.readers.mavlink_layout import layouts

    known = layouts()
    extras = {number: layout.extra for number, layout in known.items()}
    found = frames.frames_of(data.tobytes(), extras)
    rows = {n: np.flatnonzero(found.kinds == n) for n in known}

    def part(k: int) -> bytes:
        body = data.copy()
        _moved(body, found.starts, ">u8", k * period_us)
        for number, layout in known.items():
            offsets: Mapping[str, Any] = layout.payload.fields or {}
            for name, step in (("time_boot_ms", period_us // 1000), ("time_usec", period_us)):
                if name in offsets and len(rows[number]):
                    kind, offset = offsets[name][:2]
                    _moved(body, found.body_at[rows[number]] + offset, kind.str, k * step)
        frames.sign(body, found, extras)
        return body.tobytes()

    return b"", part


def write_large(kind: str, folder: Path, size_bytes: int) -> Path:
    """Write a log of about so many bytes."""
    from host.twin.outcome.autopilot_logs import write_autopilot_log

    from tests.host.readers.autopilot_flights import flown

    record, air = flown()
    small = write_autopilot_log(kind, record, air, folder / "small", airframe="conventional")
    period_us = 1000 * (int(record.t_s[-1] * 1000.0) + 100)
    head, part = parts(kind, small, period_us)
    path = folder / f"large{small.suffix}"
    with path.open("wb") as file:
        file.write(head)
        for body in _until(part, size_bytes - len(head)):
            file.write(body)
    return path


def _until(part: Part, size_bytes: int) -> Iterator[bytes]:
    written, k = 0, 0
    while written < size_bytes:
        body = part(k)
        yield body
        written, k = written + len(body), k + 1


def main() -> int:
    """Write and read each; return 6 if one takes too much memory."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--size-mb", type=float, default=1000.0)
    parser.add_argument("--only", choices=("ulog", "dataflash", "tlog"), action="append")
    options = parser.parse_args()
    short = []
    for kind in options.only or ("ulog", "dataflash", "tlog"):
        with tempfile.TemporaryDirectory() as folder:
            begin = time.perf_counter()
            path = write_large(kind, Path(folder), int(options.size_mb * 1e6))
            wrote_s, size = time.perf_counter() - begin, path.stat().st_size
            done = subprocess.run(
                [sys.executable, "-c", MEASURE, str(path)], capture_output=True, text=True
            )
        if done.returncode:
            raise SystemExit(f"{kind}: {done.stderr[-2000:]}")
        got = json.loads(done.stdout)
        print(
            f"{kind:10s} {size / 1e9:5.2f} GB, {got['rows'] / 1e6:5.1f} million messages,"
            f" {got['air_s'] / 3600.0:5.1f} h in the air: {got['peak_mb']:6.0f} MB,"
            f" {got['cpu_s']:5.1f} s of processor time, {got['wall_s']:5.1f} s (written in"
            f" {wrote_s:.0f} s){'; ' + '; '.join(got['damage']) if got['damage'] else ''}",
            flush=True,
        )
        if got["peak_mb"] > LIMIT_MB:
            short.append(f"{kind}: {got['peak_mb']:.0f} MB, {LIMIT_MB:.0f} asked")
    for line in short:
        print(f"missed: {line}")
    return 6 if short else 0


if __name__ == "__main__":
    raise SystemExit(main())
