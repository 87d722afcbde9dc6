"""The default linear answer on the demonstration's card, through the recorder, every tolerance.

One row a coefficient and flight goes to a file that a later run continues. Seeds 1-8 were looked at
while the gust filter was taken for lateral motion; the study starts behind them.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from host.readers.even_grid import even_columns
from host.sysid.answer import true_coefficients
from host.sysid.pipeline import at_hand, identify_columns
from host.twin.virtual import virtual_flight

from studies.stored_rows import flown_rows, seeded_run

FIRST_SEED = 5000
CARD, AIRCRAFT = "demo", "ultrastick25e"
PRINCIPAL = (
    "CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_r", "Cn_dr",
)  # fmt: skip
COLUMNS = ("seed", "name", "true", "estimate", "half_width")


def rows_of(seed: int) -> list[dict[str, object]]:
    """Fly and identify as the verb does; every coefficient of both axes."""
    flight = virtual_flight(CARD, seed)
    columns, _ = even_columns(flight.table)
    answers = identify_columns(at_hand(columns, aircraft=AIRCRAFT)).linear
    rows: list[dict[str, object]] = []
    for answer in answers:
        truth = true_coefficients({"maneuver": list(flight.maneuvers)}, answer.template)
        rows += [
            dict(zip(COLUMNS, (seed, c.name, truth[c.name], c.value, c.half_width), strict=True))
            for c in answer.coefficients
        ]
    return rows


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line for each principal derivative, then what all intervals come to."""
    lines = ["coefficient  mean error %    rms  half-width  over rms  holds"]
    held_all, total = {True: 0, False: 0}, {True: 0, False: 0}
    for name in dict.fromkeys(r["name"] for r in rows):
        own = [r for r in rows if r["name"] == name]
        truth, value, half = (
            np.array([float(r[k]) for r in own]) for k in ("true", "estimate", "half_width")
        )
        held, principal = int(np.sum(np.abs(value - truth) <= half)), name in PRINCIPAL
        held_all[principal] += held
        total[principal] += len(own)
        if not principal:
            continue
        error, width = 100.0 * (value - truth) / np.abs(truth), 100.0 * half / np.abs(truth)
        rms, spread = float(np.sqrt(np.mean(error**2))), float(np.std(error) / np.sqrt(len(own)))
        lines.append(
            f"{name:10s}  {np.mean(error):+6.1f} +- {spread:3.1f}  {rms:6.1f}"
            f"  {np.median(width):9.1f}  {np.median(width) / rms:8.1f}  {held:3d} of {len(own)}"
        )
    for principal, kind in ((True, "principal derivatives"), (False, "all others")):
        if total[principal]:
            share = 100.0 * held_all[principal] / total[principal]
            lines.append(
                f"{kind}: {held_all[principal]} of {total[principal]} hold ({share:.1f} %)"
            )
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    run = seeded_run("demonstration", __doc__, arguments, flights=50, first_seed=FIRST_SEED)
    rows = flown_rows(run.rows, COLUMNS, ((seed,) for seed in run.seeds), rows_of)
    return run.report(rows, table)


if __name__ == "__main__":
    sys.exit(main())
