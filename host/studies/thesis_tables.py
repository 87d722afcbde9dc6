"""Table 3.1 row by row, figures 3.5 to 3.8 and the period column of table 3.2 of the thesis.

The network as printed, at the largest stable step and by the original program's line search, all
from zero, noise-free and at SNR 10, and its own fixed point (least squares). Simulated data of
`thesis.thesis_data`: 3-2-1-1 of 0.1 rad, 20 s at 100 Hz.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from host.arrays import Array
from host.sysid.models import LinearModel, Maneuver, free_model
from host.thesis.error_figures import thesis_program_error_percent
from host.thesis.hopfield import (
    LAMBDA,
    RECORDED,
    RHO,
    STEP_S,
    iterate,
    largest_stable_gain,
    network,
)
from host.thesis.original_program import SWEEPS, free_run, line_search

from studies.inputs import SHAPES
from studies.navion import INPUTS, STATES, TABLE_31_A
from studies.study_table import Table, write
from studies.thesis import thesis_data, truth_31

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SNRS = {"noise-free": (np.inf, 200_000), "SNR 10": (10.0, 900_000)}  # and the thesis's iterations
METHODS = ("printed step", "stable step", "line search", "least squares")
# What the thesis prints for the two, in the order of the table.
PRINTED = {
    "noise-free": (
        -0.045003671, -0.036021552, 0.00038355, -30.00003794, -0.369084965, -2.020498759,
        1.008898544, -0.000878168, 0.000911806, -0.045400063, -20.84433291, -0.010214947,
        0.000588044, 0.003451917, 0.938412706, 0.006077832, 0.560001413, -0.79996698,
        -0.499613434, -0.700228534,
    ),
    "SNR 10": (
        -0.027277008, 0.173624619, -12.22945959, -26.46613445, -0.075466871, -0.184922364,
        0.567241605, 2.034148622, -0.010721288, 0.010295163, -16.91628511, 0.375789166,
        0.002145217, 0.018468908, 0.963367259, 0.040599949, -0.969877568, -0.536048355,
        -0.478945969, -0.653822901,
    ),
}  # fmt: skip
PERIODS = {  # of table 3.2: what its comments say was obtained
    "3-2-1-1": "both", "pulse": "short", "doublet": "short",
}  # fmt: skip
NEAR = 0.1  # relative: a pole this near to the truth's was obtained
THIN, ROUGHLY = 5, 40  # every so-manieth sample is drawn of a model, of a measurement
_NAMES = (*(f"a{i}{j}" for i in range(1, 5) for j in range(1, 5)), "b1", "b2", "b3", "b4")


@dataclass(frozen=True)
class Settled:
    """One run: where it ended, how it came there, and whether it diverged.

    Attributes
    ----------
    beta : Array, shape (20,)
        NaN where it diverged.
    steps : Array, shape (k,)
        Iterations or sweeps done.
    history : Array, shape (k, 20)
    """

    method: str
    beta: Array
    steps: Array
    history: Array
    iterations: int
    diverged: bool

    @property
    def frobenius(self) -> float:
        """Parameter error over the size of the truth."""
        truth = truth_31()
        return float(np.linalg.norm(self.beta - truth) / np.linalg.norm(truth))


@dataclass(frozen=True)
class Noise:
    """One half of table 3.1: the data, its runs, and the condition of W."""

    name: str
    data: Maneuver
    runs: dict[str, Settled]
    condition: float
    stable_gain: float


def model_31() -> LinearModel:
    """Return the model of the table: twenty entries free."""
    return free_model("table 3.1", STATES, INPUTS)


def run_noise(name: str, shape: str = "3-2-1-1", rate_hz: float = 100.0) -> Noise:
    """Run every method on one half of the table.

    Parameters
    ----------
    name : str
        Key of `SNRS`.
    shape, rate_hz
        Shape and rate of the input.
    """
    snr, iterations = SNRS[name]
    data = thesis_data(shape, rate_hz, snr=snr)
    model = model_31()
    names, W, b = network(model, [data])
    stable = largest_stable_gain(W)
    runs = {
        "printed step": _iterated("printed step", W, b, LAMBDA * STEP_S, iterations),
        "stable step": _iterated("stable step", W, b, 0.95 * stable, iterations),
    }
    found = line_search(model, [data], names, W, b, np.zeros(20), sweeps=SWEEPS)
    runs["line search"] = Settled(
        "line search", found.estimate, found.step, found.history, int(found.step[-1]), False
    )
    exact = np.linalg.lstsq(-W, b, rcond=None)[0]
    runs["least squares"] = Settled(
        "least squares", exact, np.zeros(1), exact[None, :], 0, diverged=False
    )
    return Noise(name, data, runs, float(np.linalg.cond(W)), stable)


def _iterated(method: str, W: Array, b: Array, gain: float, iterations: int) -> Settled:
    """Run the printed iteration from zero, noting it a hundred times."""
    beta: Array = np.zeros(20)
    done, at, history = 0, [0], [beta]
    part = iterations // RECORDED
    while done < iterations:
        beta, ran = iterate(W, b, beta, gain, RHO, part, 1e6)
        done += ran
        if ran < part or not np.isfinite(beta).all():
            nothing = np.full(20, np.nan)
            return Settled(method, nothing, np.array(at, float), np.array(history), done, True)
        at.append(done)
        history.append(beta)
    return Settled(method, beta, np.array(at, float), np.array(history), done, diverged=False)


def rows_31(halves: Sequence[Noise]) -> Table:
    """Return table 3.1: truth, what the thesis printed, what each method gives, error by row."""
    truth = truth_31()
    columns = ["entry", "true"]
    for half in halves:
        columns += [f"{half.name}: thesis", *(f"{half.name}: {m}" for m in METHODS)]
    rows: list[tuple[str | float, ...]] = []
    for k, entry in enumerate(_NAMES):
        row: list[str | float] = [entry, float(truth[k])]
        for half in halves:
            row += [PRINTED[half.name][k], *(float(half.runs[m].beta[k]) for m in METHODS)]
        rows.append(tuple(row))
    measures: dict[str, Callable[[Array], float]] = {
        "error, Frobenius %": lambda beta: 100.0 * _frobenius(beta),
        "sum of errors, signed": lambda beta: float(np.sum(truth - beta)),
        "sum of errors, absolute": lambda beta: float(np.sum(np.abs(truth - beta))),
    }
    for label, measure in measures.items():
        row = [label, ""]
        for half in halves:
            row.append(measure(np.array(PRINTED[half.name])))
            row += [measure(half.runs[m].beta) for m in METHODS]
        rows.append(tuple(row))
    remarks = [
        f"{half.name}: condition of W {half.condition:.2g}; the printed step is"
        f" {LAMBDA * STEP_S / half.stable_gain:.2g} of the largest stable one"
        + (
            f" and diverges after {half.runs['printed step'].iterations} iterations"
            if half.runs["printed step"].diverged
            else ""
        )
        + f"; line search {half.runs['line search'].iterations} sweeps of at most {SWEEPS}."
        for half in halves
    ]
    return Table("Table 3.1 row by row", tuple(columns), tuple(rows), "\n".join(remarks))


def _frobenius(beta: Array) -> float:
    truth = truth_31()
    return float(np.linalg.norm(beta - truth) / np.linalg.norm(truth))


@dataclass(frozen=True)
class Periods:
    """What of the truth's poles a model of one input and rate has."""

    shape: str
    rate_hz: float
    obtained: dict[str, str]


def obtained(beta: Array) -> str:
    """Return which motions of table 3.1 a model has: short (two real poles), long (a pair)."""
    if not np.isfinite(beta).all():
        return "diverged"
    poles = np.linalg.eigvals(model_31().matrices(beta)[0])
    true = np.linalg.eigvals(TABLE_31_A)

    def near(wanted: Array) -> bool:
        return all(np.min(np.abs(poles - p)) < NEAR * abs(p) for p in wanted)

    short, long = near(true[np.abs(true) > 1.0]), near(true[np.abs(true) < 1.0])
    return {(True, True): "both", (True, False): "short", (False, True): "long"}.get(
        (short, long), "none"
    )


def periods(shapes: Sequence[str]) -> list[Periods]:
    """Return the period column of table 3.2, noise-free."""
    methods = ("stable step", "line search", "least squares")
    found = []
    for shape in shapes:
        for rate_hz in (100.0, 20.0):
            half = run_noise("noise-free", shape, rate_hz)
            got = {m: obtained(half.runs[m].beta) for m in methods}
            found.append(Periods(shape, rate_hz, got))
    return found


def period_lines(found: Sequence[Periods]) -> str:
    """Return the period column as Markdown."""
    methods = list(found[0].obtained)
    lines = [
        f"| input | rate Hz | thesis | {' | '.join(methods)} |",
        f"| --- | --- | --- |{' --- |' * len(methods)}",
    ]
    for one in found:
        cells = " | ".join(one.obtained[m] for m in methods)
        lines.append(f"| {one.shape} | {one.rate_hz:.0f} | {PERIODS[one.shape]} | {cells} |")
    return "\n".join(lines)


def figures_35_to_38(halves: Sequence[Noise]) -> Figure:
    """Draw what figures 3.5 to 3.8 show: states and slopes, a state, parameters, their errors."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 17))
    axes = figure.subplots(5, len(halves))
    truth = truth_31()
    for column, half in enumerate(halves):
        clean = thesis_data("3-2-1-1", 100.0)
        run, model = half.runs["stable step"], model_31()
        estimated = free_run(model, half.data, run.beta)
        top, slopes, sample, bars, error = axes[:, column]
        model_slopes = None
        if estimated is not None:
            A, B, _, _ = model.matrices(run.beta)
            model_slopes = estimated @ A.T + half.data.inputs @ B.T
        noisy = half.name != "noise-free"
        _over_size(top, clean.outputs, half.data.outputs if noisy else None, estimated, STATES)
        top.set_title(f"fig. 3.5, {half.name}: states over their size\n(grey measured, dashed"
                      " stable step)", fontsize=9)  # fmt: skip
        assert clean.rates is not None
        _over_size(slopes, clean.rates, half.data.rates if noisy else None, model_slopes,
                   [f"d/dt {name}" for name in STATES])  # fmt: skip
        slopes.set_title("fig. 3.5: slopes over their size", fontsize=9)
        t = _decimated_time(clean)
        if noisy:
            rough = half.data.outputs[::ROUGHLY, 1]
            sample.plot(t[:: ROUGHLY // THIN], rough, color="0.8", lw=1.2, label="measured")
        sample.plot(t, clean.outputs[::THIN, 1], color="C0", label="true")
        if estimated is not None:
            sample.plot(t, estimated[::THIN, 1], "--", color="black", lw=0.9, label="estimated")
        sample.set_xticks(range(0, 21, 5))
        sample.set_title("fig. 3.6: alpha, rad", fontsize=9)
        sample.legend(fontsize=7)
        place = np.arange(20)
        for name, mark in (
            ("stable step", "C3x"),
            ("line search", "C1+"),
            ("least squares", "C0."),
        ):
            bars.plot(place, half.runs[name].beta, mark, label=name)
        bars.plot(place, truth, "ko", mfc="none", label="true")
        bars.plot(place, PRINTED[half.name], "m1", label="thesis")
        bars.set_yscale("symlog", linthresh=0.1)
        bars.set_xticks(place, _NAMES, rotation=90, fontsize=6)
        bars.set_title("fig. 3.7: parameters", fontsize=9)
        if column == 0:
            bars.legend(fontsize=7)
        error.loglog(run.steps[1::8], np.abs(run.history[1::8] - truth) + 1e-12, lw=0.7)
        for scaled in (bars, error):
            scaled.minorticks_off()
        error.set_title("fig. 3.8: |error| of each parameter over iterations, stable step",
                        fontsize=9)  # fmt: skip
    return figure


def _decimated_time(data: Maneuver) -> Array:
    return np.asarray(np.arange(data.samples)[::THIN] * data.dt_s)


def _over_size(
    axes: Axes, true: Array, measured: Array | None, estimated: Array | None, names: Sequence[str]
) -> None:
    """Draw signals one below the other, each over its largest value."""
    t = np.arange(len(true))[::THIN] * 0.01
    for k, colour in zip(range(len(names)), ("C0", "C1", "C2", "C3"), strict=True):
        size = np.max(np.abs(true[:, k])) or 1.0
        if measured is not None:
            rough = measured[::ROUGHLY, k] / size - 3 * k
            axes.plot(t[:: ROUGHLY // THIN], rough, color="0.8", lw=1.2)
        axes.plot(t, true[::THIN, k] / size - 3 * k, color=colour)
        if estimated is not None:
            axes.plot(t, estimated[::THIN, k] / size - 3 * k, "--", color="black", lw=0.8)
    axes.set_xticks(range(0, 21, 5))
    axes.set_yticks(range(0, -3 * len(names), -3), names, fontsize=7)


def program_figure(half: Noise, method: str) -> float:
    """Return the figure that the thesis's program would print for a run, %."""
    simulated = free_run(model_31(), half.data, half.runs[method].beta)
    if simulated is None:
        return float("nan")
    return thesis_program_error_percent(half.data.outputs, simulated)


def study(stem: Path, shapes: Sequence[str] = tuple(SHAPES)) -> list[Path]:
    """Write table, periods of the inputs and picture under a stem; return the paths."""
    halves = [run_noise(name) for name in SNRS]
    table = rows_31(halves)
    lines = [
        f"{h.name}, {m}: program's figure {program_figure(h, m):.4g} %, parameters"
        f" {100.0 * h.runs[m].frobenius:.3g} %, periods: {obtained(h.runs[m].beta)}."
        for h in halves
        for m in METHODS
        if not h.runs[m].diverged
    ]
    words = "\n\n".join([table.remark, "\n".join(lines), period_lines(periods(shapes))])
    whole = Table(table.title, table.columns, table.rows, words)
    return write(whole, figures_35_to_38(halves), stem)


def main(arguments: list[str] | None = None) -> int:
    """Write everything and print the words."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    options = parser.parse_args(arguments)
    options.folder.mkdir(parents=True, exist_ok=True)
    for path in study(options.folder / "thesis_tables"):
        sys.stdout.write(f"{path}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
