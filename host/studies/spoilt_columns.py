"""Estimates from columns that are quantised, held or free of noise, against the unspoilt ones.

Flights of the independent simulator, without and with an aircraft file. Wanted: spoilt columns
give estimates within their intervals of the unspoilt ones, and intervals that hold. One row an
estimate goes to a file that a later run continues.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pandas as pd
from host.compiled import prefer_machine_code
from host.constants import RAD_PER_DEG

import host
from studies.foreign.flight import NOISE, derivatives, fly
from studies.foreign.instrument import Columns
from studies.independent import (
    DIMENSIONAL,
    DIRECT,
    NAMES,
    WITH_FILE,
    cells,
    identified,
    of_coefficients,
)
from studies.stored_rows import flown_rows, seeded_run

FIRST_SEED = 16730  # 16720-16722 were looked at while curves came in place of lines
CELLS = ("calm", "dryden, turning, point, 0.5 m/s")
COLUMNS = ("cell", "seed", "case", "analysis", "name", "true", "estimate", "half_width")
HOLD = 5  # rows
STEPS = {
    **dict.fromkeys(("alpha_rad", "beta_rad", "phi_rad", "theta_rad"), 0.1 * RAD_PER_DEG),
    "airspeed_mps": 0.5,
}
SLOW = (*STEPS, "psi_rad")
UNSPOILT, CLEAN = "unspoilt", "free of noise"
CLEANED = ("alpha_rad", "beta_rad", "phi_rad", "theta_rad")  # as flown


def quantised(columns: Columns) -> Columns:
    """Return columns whose angles and airspeed are whole numbers of a step."""
    return columns | {k: np.round(columns[k] / step) * step for k, step in STEPS.items()}


def held(columns: Columns, names: Sequence[str]) -> Columns:
    """Return columns of which some keep each value for `HOLD` rows."""
    last = np.arange(len(columns["t_s"])) // HOLD * HOLD
    return columns | {name: columns[name][last] for name in names}


CASES: dict[str, Callable[[Columns], Columns]] = {
    UNSPOILT: dict,
    "quantised": quantised,
    "held": lambda columns: held(columns, SLOW),
    "all held": lambda columns: held(columns, tuple(NOISE)),
    CLEAN: dict,
}


def rows_of(cell: str, seed: int) -> Iterator[dict[str, object]]:
    """Fly once, spoil and identify by every analysis."""
    air = cells()[cell]
    measured, true = fly(air, seed)
    for case, spoil in CASES.items():
        seen = measured | {k: true[k] for k in CLEANED} if case == CLEAN else measured
        answer = identified(seen, air, seed, (*NAMES, DIRECT), spoil)
        plain = host.identify(pd.DataFrame(spoil(seen)), models=tuple(NAMES))
        for axis in NAMES:
            by_analysis = {
                DIMENSIONAL: without_file(plain, axis),
                WITH_FILE: of_coefficients(answer, axis, WITH_FILE),
                DIRECT: of_coefficients(answer, axis, DIRECT),
            }
            for analysis, found in by_analysis.items():
                for one in found:
                    yield dict(zip(COLUMNS, (cell, seed, case, analysis, *one[:4]), strict=True))


def without_file(
    answer: host.Identification, axis: str
) -> Iterator[tuple[str, float, float, float]]:
    """Return name, truth, value and half-width of derivatives; airspeed may be wrong in scale."""
    for one in answer.linear:
        true, half = derivatives(one.trim.airspeed_mps), one.result.half_width()
        for name in NAMES[axis] if one.template == axis else ():
            yield name, true[name], one.result.value(name), float(half[one.result.index(name)])


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line for each cell, analysis and case: shares of estimates, %."""
    lines = [
        "cell                             analysis      case           estimates"
        "  near the unspoilt  hold  unspoilt hold  wider"
    ]
    by_key = {tuple(r[k] for k in COLUMNS[:5]): r for r in rows}
    groups = {(r["cell"], r["analysis"], r["case"]) for r in rows if r["case"] != UNSPOILT}
    for cell, analysis, case in sorted(groups):
        pairs = [
            (r, by_key[whole])
            for r in rows
            if (r["cell"], r["analysis"], r["case"]) == (cell, analysis, case)
            and (whole := (cell, r["seed"], UNSPOILT, analysis, r["name"])) in by_key
        ]
        if pairs:
            lines.append(f"{cell:33s}{analysis:14s}{case:15s}" + _compared(pairs))
    return lines


def _compared(pairs: Sequence[tuple[dict[str, str], dict[str, str]]]) -> str:
    """Return what spoilt estimates and the unspoilt ones come to."""
    (true, estimate, half), (whole_true, whole, whole_half) = (
        np.array([[float(pair[side][k]) for pair in pairs] for k in COLUMNS[5:]]) for side in (0, 1)
    )
    near, hold, whole_hold = (
        100.0 * np.mean(np.abs(difference) <= width)
        for difference, width in (
            (estimate - whole, half),
            (estimate - true, half),
            (whole - whole_true, whole_half),
        )
    )
    return (
        f"{len(pairs):9d}  {near:17.1f}  {hold:4.1f}  {whole_hold:13.1f}"
        f"  {np.median(half / whole_half):5.2f}"
    )


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    run = seeded_run("spoilt_columns", __doc__, arguments, flights=12, first_seed=FIRST_SEED)
    keys = ((cell, seed) for seed in run.seeds for cell in CELLS)
    return run.report(flown_rows(run.rows, COLUMNS, keys, rows_of), table)


if __name__ == "__main__":
    prefer_machine_code()
    sys.exit(main())
