"""Run the fuzz campaigns of kinds.toml, one after the other: ``make fuzz``.

    make fuzz                    2000 runs of each kind
    make fuzz FULL=1             all of them; stopped, it goes on with the next kind
    make fuzz FUZZ="ubx settings"

A kind that has passed is noted in build/fuzz/passed.json and not run again until what it is about
has changed, or until all kinds have passed. Exit codes: 0, 2 for an unknown kind, 6 if a kind
failed or took longer than 40 minutes.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLE = Path(__file__).resolve().parent / "kinds.toml"
OUT = ROOT / "build" / "fuzz"
USUAL_RUNS = 2000
LIMIT_S = 40 * 60
FAILED = 6


@dataclass(frozen=True, slots=True)
class Kind:
    """One row of the table."""

    name: str
    command: tuple[str, ...]
    full: int
    of: tuple[str, ...]

    def filled(self, runs: int) -> list[str]:
        """Return the command for so many runs."""
        words = {"{python}": sys.executable, "{runs}": str(runs), "{kind}": self.name}
        return [words.get(word, word) for word in self.command]


def load(table: Path = TABLE) -> list[Kind]:
    """Read the table.

    Raises
    ------
    ValueError
        If a row is incomplete or a name stands twice.
    """
    rows = tomllib.loads(table.read_text(encoding="utf-8"))["kind"]
    kinds = []
    for row in rows:
        if set(row) != {"name", "command", "full", "of"}:
            raise ValueError(f"{table.name}: {row}: expected name, command, full and of")
        kinds.append(Kind(row["name"], tuple(row["command"]), row["full"], tuple(row["of"])))
    names = [kind.name for kind in kinds]
    if len(set(names)) != len(names):
        raise ValueError(f"{table.name}: a name stands twice in {', '.join(names)}")
    return kinds


def state_of(kind: Kind, runs: int, root: Path = ROOT) -> str:
    """Return a hash over the command and over all that the kind is about."""
    state = sha256(json.dumps([kind.command, runs]).encode())
    for path in _files(root / name for name in kind.of):
        state.update(str(path.relative_to(root)).encode())
        state.update(path.read_bytes())
    return state.hexdigest()


def _files(places: Iterable[Path]) -> Iterable[Path]:
    for place in places:
        if not place.exists():
            raise FileNotFoundError(f"{place}: named in {TABLE.name}, and not there")
        found = [place] if place.is_file() else sorted(place.rglob("*"))
        yield from (p for p in found if p.is_file() and "__pycache__" not in p.parts)


def run(kind: Kind, runs: int, *, limit_s: float = LIMIT_S, out: Path = OUT) -> tuple[bool, str]:
    """Run a kind; give whether it passed and its last line.

    Its output goes to <out>/<kind>.log. Behind the limit it is stopped, and has not passed.
    """
    out.mkdir(parents=True, exist_ok=True)
    log = out / f"{kind.name}.log"
    # A session of its own, so that what it started is stopped with it.
    with (
        log.open("w", encoding="utf-8") as file,
        subprocess.Popen(
            kind.filled(runs), cwd=ROOT, stdin=subprocess.DEVNULL, stdout=file, stderr=file,
            start_new_session=True,
        ) as running,
    ):  # fmt: skip
        try:
            code = running.wait(limit_s)
        except subprocess.TimeoutExpired:
            os.killpg(running.pid, signal.SIGKILL)
            return False, f"stopped behind {limit_s / 60:g} min; see {log}"
        except KeyboardInterrupt:
            os.killpg(running.pid, signal.SIGKILL)
            raise
    lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines() or [""]
    if code != 0:
        return False, "\n".join([*lines[-20:], f"exit code {code}; all of it: {log}"])
    return True, lines[-1]


def campaign(
    kinds: Sequence[Kind], *, full: bool, out: Path = OUT, limit_s: float = LIMIT_S
) -> list[str]:
    """Run the kinds that have not passed yet, print a line for each; give those that failed."""
    passed_file = out / "passed.json"
    passed: dict[str, str] = {}
    if passed_file.is_file():
        passed = json.loads(passed_file.read_text(encoding="utf-8"))
    failed = []
    for kind in kinds:
        runs = kind.full if full else USUAL_RUNS
        state = state_of(kind, runs)
        if passed.get(kind.name) == state:
            print(f"{kind.name:14} passed before", flush=True)
            continue
        start_s = time.monotonic()
        well, said = run(kind, runs, limit_s=limit_s, out=out)
        minutes = (time.monotonic() - start_s) / 60
        print(
            f"{kind.name:14} {'ok' if well else 'FAILED'} in {minutes:.1f} min: {said}", flush=True
        )
        if well:
            passed[kind.name] = state
            passed_file.write_text(json.dumps(passed), encoding="utf-8")
        else:
            failed.append(kind.name)
    if not failed:
        passed_file.unlink(missing_ok=True)  # the next campaign begins anew
    return failed


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    parser.add_argument("names", nargs="*", help="kinds to run; none means all")
    parser.add_argument("--full", action="store_true", help="all runs instead of 2000")
    parser.add_argument("--list", action="store_true", help="print the kinds and stop")
    asked = parser.parse_args(arguments)
    kinds = load()
    if asked.list:
        print("\n".join(f"{kind.name:14} {kind.full:>9} runs in full" for kind in kinds))
        return 0
    strange = set(asked.names) - {kind.name for kind in kinds}
    if strange:
        names = ", ".join(kind.name for kind in kinds)
        print(f"no kind {', '.join(sorted(strange))}; there are {names}", file=sys.stderr)
        return 2
    chosen = [kind for kind in kinds if not asked.names or kind.name in asked.names]
    failed = campaign(chosen, full=asked.full)
    if failed:
        print(f"failed: {', '.join(failed)}")
        return FAILED
    print("every kind passed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
