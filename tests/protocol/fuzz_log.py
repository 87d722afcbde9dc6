"""Campaign: mutated logs through `read_log`, its table and `decode --frames`.

    python -m tests.protocol.fuzz_log blind --count 100000
    python -m tests.protocol.fuzz_log forged --count 100000

`blind` damages bytes; `forged` repairs every CRC, or alters the schema. Each log must give exactly
the rows that its sealed blocks hold, or end in one of our errors, of one line without control
codes; nothing is written outside the folder; the process has a limit of memory. Progress is kept
in build/fuzz: a campaign goes on where it was stopped. `--seed N --count 1` repeats a case.
"""

import argparse
import contextlib
import io
import json
import sys
import tempfile
import traceback
import warnings
import zlib
from collections import Counter
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from host.decode.decoding import decode
from host.decode.writing import Request, write_frames
from host.errors import HostError
from host.export import FORMATS
from host.log import FlightLog, read_log
from host.log.head import describe, head_lines
from host.physical.calibration import load_calibration
from host.text import shown

from tests.protocol.damage import DAMAGES
from tests.protocol.flights import simple_log
from tests.protocol.forging import FORGERIES
from tests.protocol.log_writer import ROOT, released_texts
from tests.protocol.plain_rows import log_rows
from tests.protocol.random_logs import random_log

KINDS = ("blind", "forged")
MEMORY_BYTES = 300 << 20  # beyond what the process holds before the first log
FIRST_SEED = {"blind": 0, "forged": 1_000_000}
_WHOLE = 16  # of so many logs one goes through all of `host decode` and `host info` too
_PLACE = ROOT / "build/fuzz"


class WrongError(Exception):
    """The host said, did or wrote what it must not."""


@dataclass(slots=True)
class Campaign:
    """What came of a run: how many logs were read, and how the others ended."""

    done: int = 0
    rows: int = 0
    ends: Counter[str] = field(default_factory=Counter)
    failures: list[int] = field(default_factory=list)


def mutated(kind: str, seed: int) -> bytes:
    """Return the mutated log of a seed."""
    rng = np.random.default_rng(seed)
    data = _originals()[int(rng.integers(len(_originals())))]
    if kind == "forged":
        for name in rng.choice(sorted(FORGERIES), int(rng.integers(1, 3))):
            data = FORGERIES[str(name)](data, rng)
        return data
    for _ in range(int(rng.integers(1, 5))):
        if not data:
            break
        choice = rng.random()
        if choice < 0.7:
            data = DAMAGES[str(rng.choice(sorted(DAMAGES)))](data, rng)
        elif choice < 0.85:
            at, size = int(rng.integers(len(data))), int(rng.integers(1, 3000))
            data = data[:at] + rng.bytes(size) + data[at + size :]
        else:
            other = _originals()[int(rng.integers(len(_originals())))]
            at, cut = int(rng.integers(len(data) + 1)), int(rng.integers(len(other)))
            data = data[:at] + other[cut:]
    return data


def judge(data: bytes, folder: Path, *, whole: bool = False) -> tuple[str, int]:
    """Put a log through the host; return how it ended and its rows.

    Raises
    ------
    WrongError
        If a row is wrong, an error is none of ours, or a file stands where none may.
    """
    path = folder / "flight.bin"
    path.unlink(missing_ok=True)  # ext4 waits for the disk where a file is cut and written again
    path.write_bytes(data)
    out = folder / "out"
    out.mkdir(exist_ok=True)
    try:
        log = read_log(path, calibration=_calibration())
        rows = check_log(log, data)
        write_frames(log, "csv", out / "flight.csv")
        end = log.complete
        if whole:
            log.table()
            kind = FORMATS[len(data) % len(FORMATS)]
            said = decode(Request(path, output=str(out / f"flight.{kind}"), frames=True)).summary
            json.dumps(said, allow_nan=False)
            head_lines(describe(path))
    except HostError as error:
        text = str(error)
        if not text or "\n" in text or shown(text) != text:
            raise WrongError(f"an error of more than one plain line: {text!r}") from error
        return type(error).__name__, 0
    finally:
        check_folder(folder)
    return end, rows


def check_log(log: FlightLog, data: bytes) -> int:
    """Compare frames, table and ledger with what the sealed blocks hold; return the rows."""
    held = log_rows(data, _known())
    if held is None or log.schema.hash not in held:
        raise WrongError("a log was read where no block or no schema is to be had")
    for name, frame in log.schema.by_name.items():
        if log.frames[name].tobytes() != held[log.schema.hash][frame.id]:
            raise WrongError(f"frames {name} are not those of the sealed blocks")
    table = log.columns()
    rows = len(log.frames["ident"])
    if {len(column) for column in table.values()} != {rows}:
        raise WrongError(f"a table of other than {rows} rows")
    if any(np.isinf(column).any() for column in table.values()):
        raise WrongError("an infinite value in the table")
    for loss in log.loss.losses:
        if loss.length < 0 or loss.blocks < 0 or not 0 <= loss.offset <= len(data):
            raise WrongError(f"a loss that cannot be: {loss}")
    return rows


def check_folder(folder: Path) -> None:
    """Raise if a file stands anywhere but below ``out``; empty it."""
    for path in sorted(folder.rglob("*"), reverse=True):
        inside = path.relative_to(folder).parts
        plain = len(inside) == 1 or (inside[0] == "out" and len(inside) <= 3)
        if inside[0] not in ("flight.bin", "out") or not plain:
            raise WrongError(f"{path} was written")
        if path.is_file() and inside[0] == "out":
            path.unlink()


def run(kind: str, seed: int, count: int, campaign: Campaign, keep: Path | None = None) -> None:
    """Judge the logs of `count` seeds from `seed` on; note each in `campaign`."""
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("error")
        folder = Path(name) / "in" / "here"
        folder.mkdir(parents=True)
        for number in range(seed, seed + count):
            try:
                whole = number % _WHOLE == 0
                with contextlib.redirect_stderr(io.StringIO()):
                    end, rows = judge(mutated(kind, number), folder, whole=whole)
                campaign.ends[end] += 1
                campaign.rows += rows
                if {path.name for path in Path(name).iterdir()} != {"in"}:
                    raise WrongError(f"a file outside of {folder}")
            except Exception:
                campaign.failures.append(number)
                print(f"{kind} seed {number}:")
                traceback.print_exc(file=sys.stdout)
            campaign.done += 1
            if keep is not None and campaign.done % 500 == 0:
                _save(campaign, keep)


def limit_memory() -> None:
    """Let this process hold `MEMORY_BYTES` more than now; beyond it Python raises MemoryError."""
    try:
        import resource
    except ModuleNotFoundError:  # Windows has no such limit
        return
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (held + MEMORY_BYTES, resource.RLIM_INFINITY))


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="fuzz_log", description=__doc__)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--seed", type=int, help="first seed; goes on where it stopped without it")
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--no-limit", action="store_true", help="of memory: for a shared process")
    options = parser.parse_args(arguments)
    if not options.no_limit:
        _warm()
        limit_memory()
    campaign, keep = Campaign(), None
    first = FIRST_SEED[options.kind]
    if options.seed is None:
        _PLACE.mkdir(parents=True, exist_ok=True)
        keep = _PLACE / f"log-{options.kind}-{options.count}.json"
        campaign = _load(keep)
        first += campaign.done
    else:
        first = options.seed
    run(options.kind, first, options.count - campaign.done, campaign, keep)
    if keep is not None:
        _save(campaign, keep)
    ends = ", ".join(f"{name} {count}" for name, count in sorted(campaign.ends.items()))
    print(
        f"{options.kind}: {campaign.done} logs, {campaign.rows} rows, {len(campaign.failures)}"
        f" failures; {ends}"
    )
    if campaign.failures and keep is not None:
        keep.unlink()  # judged anew when they are mended
    return 1 if campaign.failures else 0


def _save(campaign: Campaign, keep: Path) -> None:
    state = {
        "of": _code(),
        "done": campaign.done,
        "rows": campaign.rows,
        "ends": dict(campaign.ends),
    }
    keep.write_text(json.dumps(state | {"failures": campaign.failures}))


def _load(keep: Path) -> Campaign:
    if not keep.is_file():
        return Campaign()
    state = json.loads(keep.read_text())
    if state.get("of") != _code():  # what it was about has changed
        return Campaign()
    return Campaign(state["done"], state["rows"], Counter(state["ends"]), state["failures"])


@lru_cache(maxsize=1)
def _code() -> int:
    """Return a CRC-32 over the host's rooms that read a log, and over the mutations."""
    rooms = [f"host/src/host/{name}" for name in ("wire", "log", "decode", "export", "physical")]
    files = [path for room in [*rooms, "tests/protocol"] for path in (ROOT / room).glob("*.py")]
    return zlib.crc32(b"".join(path.read_bytes() for path in sorted(files)))


@lru_cache(maxsize=1)
def _calibration() -> Any:
    return load_calibration()


@lru_cache(maxsize=1)
def _known() -> dict[int, bytes]:
    return {zlib.crc32(text): text for text in released_texts()}


@lru_cache(maxsize=1)
def _originals() -> tuple[bytes, ...]:
    """Return small logs: complete ones, and of random history."""
    made = [simple_log(0.1 + 0.1 * seed, seed=seed + 1).data() for seed in range(6)]
    made += [random_log(np.random.default_rng(seed)).data() for seed in range(18)]
    return tuple(data for data in made if len(data) < 60 * 512)


def _warm() -> None:
    """Load every library that a log needs, before memory is limited."""
    with tempfile.TemporaryDirectory() as name, contextlib.redirect_stderr(io.StringIO()):
        folder = Path(name)
        for data in _originals():
            judge(data, folder, whole=True)


if __name__ == "__main__":
    sys.exit(main())
