"""The default answer on flights of a simulator with equations of its own.

Eight cells of gusts and calm air, ideally placed sensors, no aircraft file. One row a flight goes
to a file that a later run continues.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from host.sysid.flight.linear_estimator import identify
from host.sysid.identification_error import IdentificationError

from studies.foreign.flight import Air, derivatives, fly
from studies.stored_rows import flown_rows

# 0-5 were looked at while delays and turning air were written.
FIRST_SEED = 100
NAMES = {
    "longitudinal": ("Z_alpha", "M_alpha", "M_q", "M_de"),
    "lateral": ("L_p", "L_da", "N_beta", "N_r", "N_dr"),
}
EVERY = {name for names in NAMES.values() for name in names}
COLUMNS = ("cell", "seed", "name", "true", "estimate", "half_width")
LIMIT_MEAN = 2.0  # %, plus two standard errors of the mean


def cells() -> dict[str, Air]:
    """Return the air of each cell by name."""
    found = {"calm": Air()}
    pairs = ((True, False), (False, True), (True, True), (False, False))
    for intensity, (form, (turns, spread)) in itertools.product(
        (0.5, 1.0), (("dryden", pairs[0]), ("dryden", pairs[1]), ("karman", pairs[2]),
                     ("karman", pairs[3])),
    ):  # fmt: skip
        name = f"{form}, {'turning' if turns else 'fixed'}, {'spread' if spread else 'point'}"
        found[f"{name}, {intensity:g} m/s"] = Air(form, intensity, turns, spread)
    return found


def rows_of(cell: str, air: Air, seed: int, axis: str) -> list[dict[str, object]]:
    """Fly and identify one axis; no estimate where the answer is refused."""
    measured, _ = fly(air, seed)
    try:
        [answer] = identify(dict(measured), names=(axis,))
    except IdentificationError:
        return [dict.fromkeys(COLUMNS, "") | {"cell": cell, "seed": seed, "name": "refused"}]
    expected = derivatives(answer.trim.airspeed_mps)  # where the answer says that it holds
    half, result = answer.result.half_width(), answer.result
    return [
        {
            "cell": cell, "seed": seed, "name": name, "true": expected[name],
            "estimate": result.value(name), "half_width": float(half[result.index(name)]),
        }
        for name in NAMES[axis]
    ]  # fmt: skip


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line for each cell and derivative: mean error, rms, half-width, held of flights."""
    lines = [
        "cell                                derivative  mean error %   rms  half-width  holds"
    ]
    kept = [r for r in rows if r["name"] in EVERY]
    held_all = total = 0
    for cell in dict.fromkeys(r["cell"] for r in kept):
        for name in dict.fromkeys(r["name"] for r in kept):
            own = [r for r in kept if r["cell"] == cell and r["name"] == name]
            truth, value, half = (
                np.array([float(r[k]) for r in own]) for k in ("true", "estimate", "half_width")
            )
            error, width = 100.0 * (value - truth) / np.abs(truth), 100.0 * half / np.abs(truth)
            spread = float(np.std(error, ddof=1)) / np.sqrt(len(own)) if len(own) > 1 else np.nan
            held = int(np.sum(np.abs(error) <= width))
            held_all, total = held_all + held, total + len(own)
            lines.append(
                f"{cell:36s}{name:10s} {np.mean(error):+6.1f} +- {spread:3.1f}"
                f"  {np.sqrt(np.mean(error**2)):5.1f}  {np.median(width):9.1f}"
                f"  {held:3d} of {len(own)}"
            )
    refused = sum(r["name"] == "refused" for r in rows)
    if total:
        lines.append(f"{held_all} of {total} hold ({100.0 * held_all / total:.1f} %)")
    lines.append(f"{refused} flights refused")
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=2, help="of each cell (the page: 20)")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed")
    parser.add_argument("--only", default="", help="cells whose name holds this")
    parser.add_argument("--axis", choices=tuple(NAMES), default="longitudinal")
    parser.add_argument("--rows", type=Path, help="of a run that goes on; a file for each axis")
    options = parser.parse_args(arguments)
    path = options.rows or Path(f"../build/study/independent_{options.axis}.csv")
    seeds = range(options.first, options.first + options.flights)
    airs = {cell: air for cell, air in cells().items() if options.only in cell}

    def fly(cell: str, seed: int) -> list[dict[str, object]]:
        return rows_of(cell, airs[cell], seed, options.axis)

    keys = ((cell, seed) for seed in seeds for cell in airs)
    rows = flown_rows(path, COLUMNS, keys, fly)
    print("\n".join(table([r for r in rows if int(r["seed"]) in seeds and r["cell"] in airs])))
    return 0


if __name__ == "__main__":
    sys.exit(main())
