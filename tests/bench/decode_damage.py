"""The damage table: six damages on our log, a ULog and a DataFlash log of the same flight.

`kept` is the share of the clean decode's rows that came back, `wrong` the rows returned as good
that the clean decode does not have, `admitted` whether the decoder said that something was lost.
Rows are rows of every topic, message or frame, compared with all their values.
"""

import contextlib
import io
import os
import statistics
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SECTOR = 512
Rows = Counter[tuple[str, bytes]]


@dataclass(frozen=True, slots=True)
class Reading:
    """All rows of a log and whether its decoder admits a loss; `error` names an exception."""

    rows: Rows
    admitted: bool
    error: str = ""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One damage, one decoder, several seeds."""

    kept_median: float
    kept_worst: float
    wrong: int
    admitted: int
    seeds: int
    error: str

    def text(self) -> str:
        """Return the cell of the table."""
        admitted = f"admitted {self.admitted}/{self.seeds}"
        error = f" {self.error}" if self.error else ""
        return f"{self.kept_median:8.3f} {self.kept_worst:8.3f} {self.wrong:6d}  {admitted}{error}"


def truncated(data: bytes, rng: np.random.Generator) -> bytes:
    """Cut at 60 %."""
    del rng
    return data[: len(data) * 6 // 10]


def flipped(data: bytes, rng: np.random.Generator) -> bytes:
    """Flip 100 bits anywhere."""
    damaged = bytearray(data)
    for at in rng.choice(8 * len(data), 100, replace=False).tolist():
        damaged[at // 8] ^= 1 << at % 8
    return bytes(damaged)


def zeroed(data: bytes, rng: np.random.Generator) -> bytes:
    """Zero 4 KiB."""
    at = _place(data, rng, 8)
    return data[:at] + bytes(8 * SECTOR) + data[at + 8 * SECTOR :]


def cut_out(data: bytes, rng: np.random.Generator) -> bytes:
    """Remove 4 KiB."""
    at = _place(data, rng, 8)
    return data[:at] + data[at + 8 * SECTOR :]


def randomised(data: bytes, rng: np.random.Generator) -> bytes:
    """Fill ten sectors with random bytes."""
    damaged = bytearray(data)
    for _ in range(10):
        at = _place(data, rng, 1)
        damaged[at : at + SECTOR] = rng.bytes(SECTOR)
    return bytes(damaged)


def swapped(data: bytes, rng: np.random.Generator) -> bytes:
    """Swap two runs of eight sectors."""
    first, second = sorted((_place(data, rng, 24), _place(data, rng, 24)))
    second = max(second, first + 8 * SECTOR)
    a, b = data[first : first + 8 * SECTOR], data[second : second + 8 * SECTOR]
    return data[:first] + b + data[first + len(a) : second] + a + data[second + len(b) :]


DAMAGES: dict[str, Callable[[bytes, np.random.Generator], bytes]] = {
    "cut at 60 %": truncated,
    "100 bits flipped": flipped,
    "4 KiB zeroed": zeroed,
    "4 KiB removed": cut_out,
    "10 sectors random": randomised,
    "8 sectors swapped": swapped,
}


def read_ours(path: Path) -> Reading:
    """Read our log with host."""
    from host.errors import NotALogError
    from host.log import read_log

    try:
        log = read_log(path)
    except NotALogError:
        return Reading(Counter(), admitted=True)
    rows: Rows = Counter()
    for name in log.frames:
        frames = log.frames[name]
        size = frames.dtype.itemsize
        data = frames.tobytes()
        rows.update((name, data[at : at + size]) for at in range(0, len(data), size))
    return Reading(rows, admitted=log.complete != "complete" or log.loss.any)


def read_ulog(path: Path) -> Reading:
    """Read a ULog with pyulog."""
    from pyulog import ULog

    try:
        log = ULog(str(path))
    except Exception as error:  # whatever it raises is its answer
        return Reading(Counter(), admitted=True, error=type(error).__name__)
    rows: Rows = Counter()
    for topic in log.data_list:
        columns = list(topic.data.values())
        table = np.rec.fromarrays(columns)
        data, size = table.tobytes(), table.dtype.itemsize
        rows.update((topic.name, data[at : at + size]) for at in range(0, len(data), size))
    return Reading(rows, admitted=bool(log.file_corruption))


def read_dataflash(path: Path) -> Reading:
    """Read a DataFlash log with pymavlink; what it prints to stderr counts as telling."""
    from pymavlink.DFReader import DFReader_binary

    rows: Rows = Counter()
    error = ""
    with tempfile.TemporaryFile() as said, _stderr_to(said.fileno()):
        try:
            reader = DFReader_binary(str(path))
            while (message := reader.recv_msg()) is not None:
                if message.fmt.name != "FMT":
                    rows[(message.fmt.name, repr(message._elements).encode())] += 1
        except Exception as raised:  # whatever it raises is its answer
            error = type(raised).__name__
        admitted = bool(error) or os.fstat(said.fileno()).st_size > 0
    return Reading(rows, admitted=admitted, error=error)


def outcome(read: Callable[[Path], Reading], clean: bytes, damage: str, seeds: int) -> Outcome:
    """Damage a log with several seeds and count what came back."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.bin"

        def reading(data: bytes) -> Reading:
            path.write_bytes(data)
            with contextlib.redirect_stdout(io.StringIO()):
                return read(path)

        truth = reading(clean).rows
        total = truth.total()
        kept, wrong, admitted, errors = [], 0, 0, set()
        for seed in range(seeds):
            found = reading(DAMAGES[damage](clean, np.random.default_rng(seed)))
            good = (found.rows & truth).total()
            kept.append(100.0 * good / total)
            wrong += found.rows.total() - good
            admitted += found.admitted
            errors |= {found.error} if found.error else set()
    return Outcome(
        statistics.median(kept), min(kept), wrong, admitted, seeds, " ".join(sorted(errors))
    )


@contextlib.contextmanager
def _stderr_to(descriptor: int) -> Iterator[None]:
    """Send stderr elsewhere, that of extensions in C too: one line per skipped byte."""
    sys.stderr.flush()
    kept = os.dup(2)
    os.dup2(descriptor, 2)
    try:
        yield
    finally:
        sys.stderr.flush()
        os.dup2(kept, 2)
        os.close(kept)


def _place(data: bytes, rng: np.random.Generator, sectors: int) -> int:
    """Return a random sector behind the first twenty: definitions of every format stand there."""
    return int(rng.integers(20, len(data) // SECTOR - sectors)) * SECTOR
