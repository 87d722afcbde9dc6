"""Campaign: forged and blind input through the readers of other people's files, costs enforced.

    python -m tests.fuzz.readers ulog --count 100000 [--seed 0]

Each input is read in this process under a limit of its address space and of its processor time:
300 MB and eight times its size more than before; twenty times a clean file's time, at least 2 s.
It is read, or refused in one of our errors of one line without control codes. The worst twenty by
time and by memory a byte are kept in build/fuzz; `tests/data/fuzz/readers.txt` has them as tests.
Exit code 6 if one broke a rule.
"""

from __future__ import annotations

import argparse
import contextlib
import heapq
import io
import json
import resource
import signal
import struct
import sys
import tempfile
import time
import traceback
import tracemalloc
import warnings
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from host.errors import HostError
from host.export.dataflash_writer import Records, write_dataflash
from host.readers.autopilot_flight import read_autopilot
from host.readers.foreign_tables import read_foreign
from host.readers.mavlink_frames import frames_of, sign
from scipy import io as mat

from tests.host.readers.hostile_ulog import clean, head, hostile

ROOT = Path(__file__).resolve().parents[2]
MOST_TIMES, LEAST_S = 20.0, 2.0
MOST_BYTES, MOST_PER_BYTE = 300_000_000, 8
WORST = 20
# Two of so many inputs have their memory traced, one blind and one forged: it takes eight times as
# long. The limit of the address space holds for every input.
MEASURED = 40
SUFFIX = {
    "ulog": ".ulg", "dataflash": ".bin", "text": ".log", "tlog": ".tlog", "csv": ".csv",
    "parquet": ".parquet", "mat": ".mat",
}  # fmt: skip
TABLES = ("csv", "parquet", "mat")
_NUMBERS = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 1 << 63)
_WORDS = (
    b"nan", b"inf", b"1e999", b"-1", b"", b"9" * 400, b"\x1b[2J", b"FMT", b",", b";", b"\n", b"\0",
    b"[65535]", b"uint64_t", b":", b'"', b"\xff\xfe",
)  # fmt: skip


_CODECS: tuple[Literal["snappy", "zstd"] | None, ...] = ("snappy", "zstd", None)


class WrongError(Exception):
    """A reader did what it must not."""


@cache
def originals(kind: str) -> tuple[bytes, ...]:
    """Return whole small files of a kind."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / f"file{SUFFIX[kind]}"
        return tuple(_made(kind, path))


def _made(kind: str, path: Path) -> Iterator[bytes]:
    t_s = np.arange(60) * 0.02
    frame = pd.DataFrame({"t_s": t_s, "q_radps": np.sin(t_s), "say": ["x y"] * 60})
    if kind == "ulog":
        yield clean(6000)
        yield head()
        yield from (make() for make in hostile(3000).values())
    elif kind == "dataflash":
        t_us = np.arange(60) * 20_000
        imu = {
            "TimeUS": t_us,
            **dict.fromkeys(("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"), t_s),
        }
        write_dataflash(path, [
            Records("IMU", "Qffffff", imu),
            Records("PARM", "QNf", {"TimeUS": t_us, "Name": np.array([b"A"] * 60), "Value": t_s}),
        ])  # fmt: skip
        yield path.read_bytes()
    elif kind == "text":
        lines = ["FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
                 "FMT, 1, 30, IMU, Qfff, TimeUS,GyrX,GyrY,GyrZ"]  # fmt: skip
        yield "\n".join([*lines, *(f"IMU, {k * 20000}, 0.1, 0.2, {k}" for k in range(60))]).encode()
    elif kind == "tlog":
        yield b"".join(_tlog())
    elif kind == "csv":
        yield frame.to_csv(index=False).encode()
        yield frame.to_csv(index=False, sep=";", decimal=",").encode("utf-16")
    elif kind == "parquet":
        for how in _CODECS:
            frame.to_parquet(path, compression=how)
            yield path.read_bytes()
    else:
        for packed in (False, True):
            inside = {"t": t_s, "s": {"q": t_s, "cell": np.array([[1, "a"]], dtype=object)}}
            mat.savemat(path, inside, do_compression=packed)
            yield path.read_bytes()


def _tlog() -> Iterator[bytes]:
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    link = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    for k in range(40):
        for message in (
            link.heartbeat_encode(1, 3, 0, 0, 4, 3),
            link.attitude_encode(20 * k, 0.1, 0.2, 0.3, 0.01, 0.02, 0.03),
            link.servo_output_raw_encode(20_000 * k, 0, 1500, 1500, 1100, 1500, 0, 0, 0, 0),
        ):
            yield struct.pack(">Q", 1_700_000_000_000_000 + 20_000 * k) + message.pack(link)
            link.seq = (link.seq + 1) % 256


def mutated(kind: str, seed: int) -> bytes:
    """Return the input of a seed: even ones blind, odd ones forged."""
    rng = np.random.default_rng(seed)
    some = originals(kind)
    data = some[int(rng.integers(len(some)))]
    for _ in range(int(rng.integers(1, 6))):
        change = _FORGED if seed % 2 else _BLIND
        data = change[int(rng.integers(len(change)))](data or b"x", rng)
    if kind == "tlog" and seed % 2:
        from host.readers.mavlink_layout import layouts

        extras = {number: layout.extra for number, layout in layouts().items()}
        view = np.frombuffer(data, np.uint8).copy()
        with contextlib.suppress(IndexError):
            found = frames_of(data, {})
            sign(view, found, extras)
            data = view.tobytes()
    return data[: 1 << 20]


def _flipped(data: bytes, rng: np.random.Generator) -> bytes:
    view = np.frombuffer(data, np.uint8).copy()
    at = rng.integers(0, len(view), int(rng.integers(1, 20)))
    view[at] ^= (1 << rng.integers(0, 8, len(at))).astype(np.uint8)
    return view.tobytes()


def _random(data: bytes, rng: np.random.Generator) -> bytes:
    at, size = int(rng.integers(len(data))), int(rng.integers(1, 500))
    return data[:at] + rng.bytes(size) + data[at + size :]


def _cut(data: bytes, rng: np.random.Generator) -> bytes:
    at, size = int(rng.integers(len(data))), int(rng.integers(1, 1 + len(data) // 2))
    return data[:at] + data[at + size :]


def _repeated(data: bytes, rng: np.random.Generator) -> bytes:
    at, size = int(rng.integers(len(data))), int(rng.integers(1, 200))
    return data[:at] + data[at : at + size] * int(rng.integers(1, 60)) + data[at:]


def _number(data: bytes, rng: np.random.Generator) -> bytes:
    value, size = _NUMBERS[int(rng.integers(len(_NUMBERS)))], int(rng.choice([1, 2, 4, 8]))
    raw = (value % (1 << 8 * size)).to_bytes(size, "little" if rng.random() < 0.8 else "big")
    at = int(rng.integers(len(data)))
    return data[:at] + raw + data[at + size :]


def _early(data: bytes, rng: np.random.Generator) -> bytes:
    """Change a number of the head, or of the end: there stand sizes."""
    part = min(400, len(data))
    if rng.random() < 0.5:
        return _number(data[:part], rng) + data[part:]
    return data[:-part] + _number(data[-part:], rng)


def _word(data: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(data)))
    return data[:at] + _WORDS[int(rng.integers(len(_WORDS)))] + data[at:]


Change = Callable[[bytes, np.random.Generator], bytes]
_BLIND: tuple[Change, ...] = (_flipped, _random, _cut)
_FORGED: tuple[Change, ...] = (_number, _early, _word, _repeated, _number, _cut)


def read(kind: str, path: Path) -> None:
    """Read a file as the host does.

    Raises
    ------
    WrongError
        If an error is none of ours, or of more than a plain line.
    """
    try:
        if kind in TABLES:
            read_foreign(path)
        else:
            read_autopilot(path)
    except HostError as error:
        text = str(error)
        if not text or "\n" in text or len(text) > 1000:
            raise WrongError(f"an error of more than one line: {text[:200]!r}") from error


def judge(kind: str, data: bytes, path: Path, *, traced: bool = False) -> tuple[float, int]:
    """Put a file through its reader; return processor time (s) and most memory (bytes, traced).

    Raises
    ------
    WrongError
        If it cost too much, or ended in an error that is none of ours.
    """
    path.unlink(missing_ok=True)  # ext4 waits for the disk where a file is cut and written again
    path.write_bytes(data)
    most_s = max(LEAST_S, MOST_TIMES * clean_s(kind, path.with_name("clean" + path.suffix)))
    peak = 0
    with _limited(len(data), 4.0 * most_s):
        if traced:
            tracemalloc.start()
        began_s = time.process_time()
        try:
            read(kind, path)
        except (WrongError, TimeoutError):
            raise
        except BaseException as error:
            said = traceback.format_exc().strip().splitlines()
            raise WrongError(f"{type(error).__name__}: {' | '.join(said[-4:])}") from error
        finally:
            took_s = time.process_time() - began_s
            if traced:
                peak = tracemalloc.get_traced_memory()[1]
                tracemalloc.stop()
    if not traced and took_s > most_s:
        raise WrongError(f"{took_s:.1f} s of processor time, at most {most_s:.1f}")
    if peak > MOST_BYTES + MOST_PER_BYTE * len(data):
        raise WrongError(f"{peak / 1e6:.0f} MB of a file of {len(data)} bytes")
    return took_s, peak


@cache
def clean_s(kind: str, path: Path) -> float:
    """Return the processor time that a whole file of a kind takes."""
    path.write_bytes(originals(kind)[0])
    began_s = time.process_time()
    read(kind, path)
    return time.process_time() - began_s


@contextlib.contextmanager
def _limited(size: int, most_s: float) -> Iterator[None]:
    """Limit address space and processor time of what runs inside."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    room = pages * resource.getpagesize() + MOST_BYTES + MOST_PER_BYTE * size

    def late(number: int, frame: object) -> None:
        raise WrongError(f"more than {most_s:.0f} s of processor time")

    handler = signal.signal(signal.SIGPROF, late)
    resource.setrlimit(resource.RLIMIT_AS, (room, before[1]))
    signal.setitimer(signal.ITIMER_PROF, most_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        resource.setrlimit(resource.RLIMIT_AS, before)
        signal.signal(signal.SIGPROF, handler)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="readers", description=__doc__)
    parser.add_argument("kind", choices=SUFFIX)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    kind, failed = options.kind, 0
    slow: list[tuple[float, int]] = []
    large: list[tuple[float, int]] = []
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as name, contextlib.redirect_stderr(io.StringIO()):
        path = Path(name) / f"file{SUFFIX[kind]}"
        for original in originals(kind):  # what is loaded once
            judge(kind, original, path)
        for seed in range(options.seed, options.seed + options.count):
            data, traced = mutated(kind, seed), seed % MEASURED < 2
            try:
                took_s, peak = judge(kind, data, path, traced=traced)
            except WrongError as error:
                failed += 1
                if failed <= 20:
                    print(f"{kind} {seed}: {error}", flush=True)
                continue
            if traced:
                _keep(large, peak / (len(data) + 1), seed)
            else:
                _keep(slow, took_s, seed)
    out = ROOT / "build" / "fuzz"
    out.mkdir(parents=True, exist_ok=True)
    worst = {"slow": sorted(slow, reverse=True), "large": sorted(large, reverse=True)}
    (out / f"readers-{kind}.json").write_text(json.dumps(worst))
    print(
        f"{options.count} inputs of {kind}: {failed} broke a rule; slowest"
        f" {max(slow, default=(0.0, 0))[0]:.2f} s, most memory"
        f" {max(large, default=(0.0, 0))[0]:.0f} bytes a byte"
    )
    return 6 if failed else 0


def _keep(worst: list[tuple[float, int]], value: float, seed: int) -> None:
    heapq.heappush(worst, (value, seed))
    if len(worst) > WORST:
        heapq.heappop(worst)


if __name__ == "__main__":
    sys.exit(main())
