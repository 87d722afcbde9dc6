"""Fly with cards drawn at random, altered from good ones, under sanitizers.

    make card-images                            10 000 cards
    make card-images IMAGES="--count 200"       a look
    make card-images IMAGES="--seed 17 --count 1"    one card again
    make card-images IMAGES="--kept build/cards"     what is done is kept; the next run goes on

Every card must end in recording or in a true message within ten seconds, and the pilot must never
notice. The flights are flown by processes of their own: one that dies (a sanitizer's verdict) or
that hangs on a card is started again behind it.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
if __name__ == "__main__":
    sys.path[:0] = [str(ROOT), str(ROOT / "firmware" / "toolchain")]

from host.twin.recorder.sitl_library import Sitl  # noqa: E402

from tests.cards.drawn import draw  # noqa: E402
from tests.cards.judge import Judgement, Stage  # noqa: E402
from tests.cards.tally import Result, Tally  # noqa: E402
from tests.sitl.card_flight import fly  # noqa: E402

LIBRARY = ROOT / "build" / "sitl-sanitized" / "libsitl.so"
# -O1: with -O2 compiling takes half as long again, and flights take as long.
SANITIZERS = ("-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
HUNG_CPU_S = 60  # of a flight that takes a fraction of a second


def build_sanitized() -> Path:
    """Build the firmware as a library under address and undefined-behaviour sanitizers."""
    import build_sitl

    return build_sitl.build(library=LIBRARY, extra_flags=SANITIZERS)


def fly_all(first: int, count: int, library: Path) -> Iterator[Result]:
    """Fly with the cards of some seeds, one after the other."""
    seed = first
    while seed < first + count:
        yield from (batch := _Batch(seed, first + count - seed, library))
        seed = batch.next_seed


class _Batch:
    """One process that flies with card after card until it is done or dies."""

    def __init__(self, seed: int, count: int, library: Path) -> None:
        self.next_seed = seed
        self._end = seed + count
        self._library = library

    def __iter__(self) -> Iterator[Result]:
        runtime = subprocess.run(
            [os.environ.get("CXX", "c++"), "-print-file-name=libasan.so"],
            capture_output=True, text=True, check=True,
        ).stdout.strip()  # fmt: skip
        wanted = [str(self.next_seed), str(self._end - self.next_seed), str(self._library)]
        with subprocess.Popen(
            [sys.executable, __file__, "--worker", *wanted],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env=os.environ | {"LD_PRELOAD": runtime, "ASAN_OPTIONS": "detect_leaks=0"},
        ) as worker:  # fmt: skip
            assert worker.stdout is not None and worker.stderr is not None
            for line in worker.stdout:
                result = _result(json.loads(line))
                self.next_seed = result.seed + 1
                yield result
            said = worker.stderr.read()
            code = worker.wait()
        if self.next_seed < self._end:
            why = "hangs" if code == -signal.SIGVTALRM else _verdict(said) or f"died, code {code}"
            seed = self.next_seed
            self.next_seed += 1
            yield Result(seed, Judgement(Stage.REFUSED, "", [why]), draw(seed).altered)


class Kept:
    """Results in a file, a line of JSON each: a campaign that was stopped goes on behind them.

    They are of one image: those of another are thrown away.

    Parameters
    ----------
    path : Path or None
        None: nothing is kept.
    library : Path
        Whose results they are.
    """

    def __init__(self, path: Path | None, library: Path) -> None:
        self._path = path
        self._image = hashlib.sha256(library.read_bytes()).hexdigest()[:12]
        self._results: dict[int, Result] = {}
        for line in path.read_text().splitlines() if path and path.exists() else ():
            row = json.loads(line)
            if row.pop("image") == self._image:
                result = _result(row)
                self._results[result.seed] = result

    def fly_all(self, first: int, count: int, library: Path) -> Iterator[Result]:
        """Give what is kept, fly with the cards from the first on that is not."""
        seed = first
        while seed < first + count and seed in self._results:
            yield self._results[seed]
            seed += 1
        if seed > first:
            print(f"{seed - first} cards of image {self._image} were kept", file=sys.stderr)
        for result in fly_all(seed, first + count - seed, library):
            if self._path is not None:
                with self._path.open("a") as file:
                    file.write(json.dumps({"image": self._image} | _row(result)) + "\n")
            yield result


def _row(result: Result) -> dict[str, object]:
    """Lay a result out for JSON."""
    judgement = result.judgement
    return {
        "seed": result.seed, "stage": judgement.stage, "message": judgement.message,
        "wrong": judgement.wrong, "altered": result.altered,
    }  # fmt: skip


def _result(row: dict[str, Any]) -> Result:
    """Make a result of what `_row` laid out."""
    judgement = Judgement(Stage(row["stage"]), row["message"], row["wrong"])
    return Result(row["seed"], judgement, row["altered"])


def _verdict(said: str) -> str:
    """Return the line of a sanitizer."""
    lines = [line for line in said.splitlines() if "runtime error" in line or "ERROR: " in line]
    return lines[0].strip() if lines else said.strip()[-300:]


def work(seed: int, count: int, library: Path) -> None:
    """Fly with the cards of some seeds in this process, a line of JSON for each."""
    for number in range(seed, seed + count):
        drawn = draw(number)
        # CPU time, not the clock's: a loaded machine kills nothing.
        signal.setitimer(signal.ITIMER_VIRTUAL, HUNG_CPU_S)
        judgement = fly(Sitl(library), drawn.card)
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        drawn.card.close()
        print(json.dumps(_row(Result(number, judgement, drawn.altered))), flush=True)


def main() -> int:
    """Print what is wrong with which card, and the shares; 0 if nothing is, else 6."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--count", type=int, default=10_000, help="cards (default 10000)")
    parser.add_argument("--seed", type=int, default=1, help="of the first card (default 1)")
    parser.add_argument("--kept", type=Path, help="file of results; a run that was cut goes on")
    parser.add_argument("--worker", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        seed, count, library = options.worker
        work(int(seed), int(count), Path(library))
        return 0
    tally, library = Tally(), build_sanitized()
    kept = Kept(options.kept, library)
    for result in kept.fly_all(options.seed, options.count, library):
        tally.show(result)
    print(tally.table())
    print(f"{options.count} cards, seeds from {options.seed}: {len(tally.wrong)} are wrong")
    return 0 if tally.passed() else 6


if __name__ == "__main__":
    sys.exit(main())
