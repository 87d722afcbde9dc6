"""The default answer on flights of a simulator with equations of its own.

Eight cells of gusts and calm air, ideally placed sensors. Each flight is analysed without an
aircraft file (dimensional derivatives), with one (coefficients; every tolerance of the file and
of the sensors is drawn), or straight by ``coefficients``. One row a flight goes to a file that a
later run continues; the last column of the table counts what is marked "trust" or "use with
care", and how many of those hold.
"""

from __future__ import annotations

import argparse
import functools
import itertools
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from host.compiled import prefer_machine_code
from host.errors import IdentificationError
from host.instrument.instrument_errors import usual_errors
from host.physical.recording import FOREIGN, Recording
from host.sysid.answer import CAREFUL, TRUSTED
from host.sysid.pipeline import at_hand, identify_columns

import host
from studies.foreign.aeroplane import TRAINER
from studies.foreign.flight import Air, derivatives, fly
from studies.foreign.instrument import (
    SENSORS_FILE,
    Columns,
    drawn_file,
    with_sensor_errors,
)
from studies.stored_rows import flown_rows, rows_file

# 0-5 were looked at while delays and turning air were written.
FIRST_SEED = 100
NAMES = {
    "longitudinal": ("Z_alpha", "M_alpha", "M_q", "M_de"),
    "lateral": ("L_p", "L_da", "N_beta", "N_r", "N_dr"),
}
COEFFICIENTS = {
    "longitudinal": ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_de"),
    "lateral": ("Cl_p", "Cl_da", "Cn_beta", "Cn_r", "Cn_dr"),
}
DIMENSIONAL, WITH_FILE, DIRECT = "dimensional", "aircraft", "coefficients"
DRAW = 14  # of the stream that errors of an instrument are drawn from
EVERY = {name for by in (NAMES, COEFFICIENTS) for names in by.values() for name in names}
COLUMNS = ("cell", "seed", "name", "true", "estimate", "half_width", "mark")
Found = tuple[str, float, float, float, str]
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


def rows_of(
    cell: str, air: Air, seed: int, axis: str, analysis: str = DIMENSIONAL
) -> list[dict[str, object]]:
    """Fly and identify one axis; no estimate where the answer is refused."""
    key: dict[str, object] = {"cell": cell, "seed": seed}
    try:
        if analysis == DIMENSIONAL:
            found = list(dimensional(flown(air, seed), axis))
        else:
            found = list(with_instrument(air, seed, axis, analysis))
    except IdentificationError:
        return [dict.fromkeys(COLUMNS, "") | key | {"name": "refused"}]
    return [key | dict(zip(COLUMNS[2:], one, strict=True)) for one in found]


@functools.lru_cache(maxsize=len(cells()))
def flown(air: Air, seed: int) -> Columns:
    """Return one flight as measured; kept for the analyses that follow."""
    return fly(air, seed)[0]


def dimensional(measured: Columns, axis: str) -> Iterator[Found]:
    """Return name, truth, estimate, half-width and mark of derivatives, without an aircraft file.

    Marks are those of the answer alone: no other method is compared here.
    """
    # The airspeed of these flights has noise, no error of scale.
    exact = usual_errors(FOREIGN).scaled(0.0, "pitot_scale", "pitot_zero_pa", "density_share")
    flown = at_hand(measured, recording=Recording(maker=FOREIGN), errors=exact)
    found = identify_columns(flown, models=axis)
    [answer] = found.linear
    expected = derivatives(answer.trim.airspeed_mps)  # where the answer says that it holds
    half, result = answer.result.half_width(), answer.result
    marks = found.verdicts[0].marks
    for name in NAMES[axis]:
        width = float(half[result.index(name)])
        yield name, expected[name], result.value(name), width, marks[name]


def with_instrument(air: Air, seed: int, axis: str, analysis: str) -> Iterator[Found]:
    """Return the same of coefficients, all errors of the instrument drawn."""
    model = DIRECT if analysis == DIRECT else axis
    return of_coefficients(answer_with_file(air, seed, model), axis, analysis)


def of_coefficients(answer: host.Identification, axis: str, analysis: str) -> Iterator[Found]:
    """Return name, truth, value, half-width and mark of the coefficients of an answer."""
    direct = answer.coefficients
    known: dict[str, tuple[float, float]] = {}
    if analysis != DIRECT:
        mine = [c for one in answer.linear if one.template == axis for c in one.coefficients]
        known = {c.name: (c.value, c.half_width) for c in mine}
    elif direct is not None:
        known = {c.name: (c.value, c.half_width) for c in direct.fit.derivatives}
    if not known:
        raise IdentificationError(f"no answer of {analysis} for {axis}")
    marks = answer.table.reset_index().set_index("name")["verdict"].to_dict()
    for name in COEFFICIENTS[axis]:
        if name in known:
            yield name, float(getattr(TRAINER, name)), *known[name], str(marks[name])


@functools.lru_cache(maxsize=len(cells()))
def answer_with_file(air: Air, seed: int, model: str) -> host.Identification:
    """Return the answer of one model to one flight; kept for both axes of ``coefficients``."""
    return identified(flown(air, seed), air, seed, (model,))


def identified(
    measured: Columns,
    air: Air,
    seed: int,
    models: Sequence[str],
    spoil: Callable[[Columns], Columns] = dict,
) -> host.Identification:
    """Return the answers to columns with drawn errors of the instrument, then spoilt."""
    number = list(cells().values()).index(air)  # each cell has an instrument of its own
    rng = np.random.default_rng([DRAW, seed, number])
    table = spoil(with_sensor_errors(measured, rng))
    with tempfile.TemporaryDirectory() as folder:
        return host.identify(
            pd.DataFrame(table),
            aircraft=drawn_file(Path(folder), rng),
            calibration=SENSORS_FILE,
            models=models,
        )


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line for each cell and derivative: mean error, rms, half-width, held of flights."""
    lines = [
        "cell                                derivative  mean error %   rms  half-width  over rms"
        "  holds     relied on, hold"
    ]
    kept = [r for r in rows if r["name"] in EVERY]
    held_all = total = relied_all = relied_held_all = 0
    for cell in dict.fromkeys(r["cell"] for r in kept):
        for name in dict.fromkeys(r["name"] for r in kept):
            own = [r for r in kept if r["cell"] == cell and r["name"] == name]
            truth, value, half = (
                np.array([float(r[k]) for r in own]) for k in ("true", "estimate", "half_width")
            )
            error, width = 100.0 * (value - truth) / np.abs(truth), 100.0 * half / np.abs(truth)
            spread = float(np.std(error, ddof=1)) / np.sqrt(len(own)) if len(own) > 1 else np.nan
            holds = np.abs(error) <= width
            relied = np.array([r.get("mark") in (TRUSTED, CAREFUL) for r in own])
            held, right = int(np.sum(holds)), int(np.sum(holds & relied))
            held_all, total = held_all + held, total + len(own)
            relied_all, relied_held_all = relied_all + int(relied.sum()), relied_held_all + right
            rms = float(np.sqrt(np.mean(error**2)))
            beyond = abs(float(np.mean(error))) > LIMIT_MEAN + 2.0 * spread
            lines.append(
                f"{cell:36s}{name:10s} {np.mean(error):+6.1f} +- {spread:3.1f}"
                f"  {rms:5.1f}  {np.median(width):9.1f}  {np.median(width) / rms:7.1f}"
                f"  {held:3d} of {len(own)}  {relied.sum():3d}, {right:3d}"
                f"{'  mean beyond its limit' if beyond else ''}"
            )
    refused = sum(r["name"] == "refused" for r in rows)
    if total:
        lines.append(
            f"{held_all} of {total} hold ({100.0 * held_all / total:.1f} %);"
            f" {relied_all} relied on, of which {relied_held_all} hold"
        )
    lines.append(f"{refused} flights refused")
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=2, help="of each cell (the page: 20)")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed")
    parser.add_argument("--only", default="", help="cells whose name holds this")
    parser.add_argument("--axis", choices=tuple(NAMES), default="longitudinal")
    parser.add_argument("--analysis", choices=(DIMENSIONAL, WITH_FILE, DIRECT), default=DIMENSIONAL)
    parser.add_argument(
        "--rows", type=rows_file, help="of a run that goes on; a file for each axis and analysis"
    )
    options = parser.parse_args(arguments)
    named = "" if options.analysis == DIMENSIONAL else f"_{options.analysis}"
    path = options.rows or Path(f"../build/study/independent_{options.axis}{named}.csv")
    seeds = range(options.first, options.first + options.flights)
    airs = {cell: air for cell, air in cells().items() if options.only in cell}

    def fly(cell: str, seed: int) -> list[dict[str, object]]:
        return rows_of(cell, airs[cell], seed, options.axis, options.analysis)

    keys = ((cell, seed) for seed in seeds for cell in airs)
    rows = flown_rows(path, COLUMNS, keys, fly)
    print("\n".join(table([r for r in rows if int(r["seed"]) in seeds and r["cell"] in airs])))
    return 0


if __name__ == "__main__":
    prefer_machine_code()
    sys.exit(main())
