"""What one identification enters: run in a process of its own, so that no answer is remembered.

    .venv/bin/python -m tests.ideas.entered FOLDER default|coefficients

FOLDER holds the flight and the calibration of `host simulate`. Prints JSON: calls of every named
function of the package, and who made each `FitResult`. Machine code that numba compiled is not
seen, nor is what Python wrote itself: comprehensions, lambdas, the methods of a dataclass.
"""

from __future__ import annotations

import inspect
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from tests.ideas.sources import ROOT, SOURCES

AIRCRAFT = "ultrastick25e"
MODELS = {"default": None, "coefficients": "coefficients"}
Place = tuple[str, str]
PACKAGE = f"{SOURCES / 'host'}/"


@dataclass(frozen=True)
class Entered:
    """Calls of one run.

    Attributes
    ----------
    calls : mapping of (file, function) to int
        From table to verdict and text. Files from the package's folder, functions dotted.
    written : mapping of (file, function) to int
        The same, and then the table of estimates and JSON.
    bodies : set of (file, function)
        Which of `calls` are bodies of classes, run as their file was imported.
    made : int
        `FitResult` constructed, `replaced` of them by `dataclasses.replace`.
    replaced : int
    """

    calls: dict[Place, int]
    written: dict[Place, int]
    bodies: set[Place]
    made: int
    replaced: int

    def places(self, room: str, *, bodies: bool) -> tuple[int, int]:
        """Return how many files and functions of a room were entered.

        Parameters
        ----------
        room : str
            Begin of the files' names: ``sysid/``; empty for the whole package.
        bodies : bool
            Count bodies of classes, and the files of which nothing else ran.
        """
        counted = self.calls.keys() - (set() if bodies else self.bodies)
        inside = [place for place in counted if place[0].startswith(room)]
        return len({file for file, _ in inside}), len(inside)


def total_calls(calls: Mapping[Place, int], labels: Collection[str]) -> int:
    """Return how often functions declared as FILE:NAME were called."""
    return sum(n for (file, name), n in calls.items() if f"{Path(file).stem}:{name}" in labels)


def entered(folder: Path, models: str) -> Entered:
    """Run an identification in a new process and return what it entered."""
    command = [sys.executable, "-m", "tests.ideas.entered", str(folder), models]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    found = json.loads(done.stdout)
    calls, written = (
        {(file, name): count for file, name, count in found[key]} for key in ("calls", "written")
    )
    bodies = {(file, name) for file, name in found["bodies"]}
    return Entered(calls, written, bodies, found["made"], found["replaced"])


def simulated(folder: Path) -> Path:
    """Fly the card `demo` into a folder, if it has not been flown; return the folder."""
    if not (folder / "flight.bin").exists():
        command = [sys.executable, "-m", "host", "simulate", "demo", "--no-picture"]
        subprocess.run([*command, "-o", str(folder)], check=True, stdout=subprocess.DEVNULL)
    return folder


def _run(folder: Path, models: str) -> None:
    import host

    calls: Counter[tuple[str, str]] = Counter()
    bodies: set[tuple[str, str]] = set()
    made: Counter[bool] = Counter()

    def look(frame: FrameType, event: str, argument: object) -> None:
        code = frame.f_code
        if code.co_filename.startswith(PACKAGE):
            name = code.co_qualname.replace(".<locals>", "")
            if "<" not in name:
                place = code.co_filename.removeprefix(PACKAGE), name
                calls[place] += 1
                if not code.co_flags & inspect.CO_OPTIMIZED:
                    bodies.add(place)
        elif (
            (code.co_filename, code.co_name) == ("<string>", "__init__")  # written by `dataclass`
            and type(frame.f_locals.get("self")).__name__ == "FitResult"
            and frame.f_back
        ):
            made[frame.f_back.f_code.co_name == "replace"] += 1

    sys.settrace(look)
    found = host.identify(
        folder / "flight.bin",
        aircraft=AIRCRAFT,
        calibration=folder / "calibration.toml",
        models=MODELS[models],
    )
    found.to_text(full=False)
    answer = dict(calls)
    assert len(found.verdict) and len(found.table) and found.to_json()
    sys.settrace(None)
    document = {
        "calls": [[*place, count] for place, count in sorted(answer.items())],
        "written": [[*place, count] for place, count in sorted(calls.items())],
        "bodies": sorted(bodies & set(answer)),
        "made": made.total(),
        "replaced": made[True],
    }
    print(json.dumps(document))


if __name__ == "__main__":
    _run(Path(sys.argv[1]), sys.argv[2])
