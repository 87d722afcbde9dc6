"""Paired flights of the worlds of `judgement`, with steps on and off.

    python -m studies.switch_off --off "echoes,headings;free response" --flights 2

Steps of one group, by commas, are off together; groups stand between semicolons. Rows go to a file
that a later run continues. Printed is what a group changes against the same flights with all steps:
interval score of all answered parameters (over their rms error), rms error, what intervals hold,
what is right and relied on, what is wrong and relied on, processor time.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from host.arrays import Array, BoolArray
from host.compiled import prefer_machine_code

from studies.judgement.interval_score import Judged, interval_score, judged
from studies.judgement.judged_rows import COLUMNS, judged_rows
from studies.judgement.scaled_figures import MOST, read_scales
from studies.judgement.worlds import WORLDS
from studies.stored_rows import Row, flown_rows, rows_file
from studies.switch_off.apart import apart
from studies.switch_off.patched import switch_off
from studies.switch_off.switches import SWITCHES

ON = "all on"


def fly(world: str, seed: int, groups: Sequence[str]) -> list[Row]:
    """Return the rows of one flight, with each group of steps off."""
    flown = WORLDS[world].fly(seed)
    found: list[Row] = []
    for group in groups:

        def identified(group: str = group) -> list[Row]:
            for switch in SWITCHES:
                if switch.name in group.split(","):
                    switch_off(switch.off)
            return list(judged_rows(world, seed, flown, WORLDS[world].names))

        rows = apart(identified)
        found += ({"off": group, **row} for row in rows or ())
    return found


def lines(rows: Sequence[Mapping[str, str]], groups: Sequence[str]) -> Iterable[str]:
    """Yield what each group changes in each world."""
    scales = read_scales()
    yield "off | world | parameters | flights | with all steps -> without"
    for group in groups:
        for world in dict.fromkeys(r["world"] for r in rows):
            of = {
                g: [r for r in rows if r["world"] == world and r["off"] == g] for g in (ON, group)
            }
            if not of[group]:
                continue
            on, off = (judged(of[g]) for g in (ON, group))
            for principal in (True, False):
                yield _line(group, world, on, off, scales.get(world, {}), principal=principal)


def _line(
    group: str, world: str, on: Judged, off: Judged, scale: Mapping[str, float], *, principal: bool
) -> str:
    both = [_figures(one, scale, one.principal == principal) for one in (on, off)]
    flights = len(np.unique(on.flight))
    said = ", ".join(f"{k} {a:.3g} -> {both[1][k]:.3g}" for k, a in both[0].items())
    return f"{group} | {world} | {'nine' if principal else 'others'} | {flights} | {said}"


def _figures(one: Judged, scale: Mapping[str, float], mine: BoolArray) -> dict[str, float]:
    error, width = (np.minimum(x[mine], MOST) for x in (one.error, one.width))
    by: Array = np.array([scale.get(str(n), np.nan) for n in one.name[mine]])
    known = one.answered[mine]
    count = max(int(np.sum(mine)), 1)
    answered = interval_score(error, width)
    return {
        "score": float(np.mean(np.where(known, answered, 2.0) / by)),
        "rms": 100.0 * float(np.sqrt(np.mean(np.where(known, error, MOST) ** 2))),
        "holds": 100.0 * float(np.mean(one.holds[mine])),
        "right relied": 100.0 * float(np.sum((one.right & one.relied)[mine])) / count,
        "wrong relied": 100.0 * float(np.sum((one.wrong & one.relied)[mine])) / count,
        "width": float(np.mean(np.where(known, width, MOST) / by)),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the pairs."""
    parser = argparse.ArgumentParser(prog="python -m studies.switch_off", description=__doc__)
    parser.add_argument("--off", required=True, help="groups of switches")
    parser.add_argument("--flights", type=int, default=2, help="of each world")
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--only", default="", help="worlds that begin so, by semicolons")
    parser.add_argument("--rows", type=rows_file, default=Path("../build/study/switch_off.csv"))
    asked = parser.parse_args(arguments)
    groups = asked.off.split(";")
    known = {switch.name for switch in SWITCHES}
    if strange := {name for group in groups for name in group.split(",")} - known:
        parser.error(f"no switch {', '.join(sorted(strange))}; there are {', '.join(known)}")
    seeds = range(asked.first, asked.first + asked.flights)
    worlds = [w for w in WORLDS if any(w.startswith(o) for o in asked.only.split(";"))]
    missing: dict[tuple[str, int], list[str]] = {}

    def asked_fly(group: str, world: str, seed: int) -> list[Row]:
        return missing_rows.pop((group, world, int(seed)), [])

    missing_rows: dict[tuple[str, str, int], list[Row]] = {}
    path = asked.rows
    there = {(r["off"], r["world"], int(r["seed"])) for r in _rows(path)}
    for seed in seeds:
        for world in worlds:
            wanted = [g for g in (ON, *groups) if (g, world, seed) not in there]
            missing[world, seed] = wanted
            if not wanted:
                continue
            for row in fly(world, seed, wanted):
                missing_rows.setdefault((str(row["off"]), world, seed), []).append(row)
            keys = [(g, world, seed) for g in wanted if (g, world, seed) in missing_rows]
            flown_rows(path, ("off", *COLUMNS), keys, asked_fly)
    rows = [r for r in _rows(path) if r["world"] in worlds and int(r["seed"]) in seeds]
    print("\n".join(lines(rows, groups)))
    return 0


def _rows(path: Path) -> list[dict[str, str]]:
    return flown_rows(path, ("off", *COLUMNS), [], lambda *_: [])


if __name__ == "__main__":
    prefer_machine_code()
    sys.exit(main())
