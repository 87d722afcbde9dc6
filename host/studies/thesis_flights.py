"""The two thesis flights again: its logger, its program, and what its error figures mean.

Kadet LT-40 at 10 rows a second (a 2 s elevator pulse, four seconds used) and Low Super Trainer at
20 (3-2-1-1, 77 rows used), all faults of the original logger in the rows. The model is the original
one (every entry of A and B free, total values, no bias), the fit its line search, started from
least squares, which is kinder than its own start. Both of its figures are set against honest
ones, a model that knows nothing, and this product on the same flights. Simulated throughout.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from host.arrays import Array
from host.errors import IdentificationError
from host.readers.even_grid import even_columns
from host.sysid.estimators import fit_equation_error
from host.sysid.models import LinearModel, Maneuver, free_model
from host.sysid.pipeline import at_hand, identify_columns
from host.thesis.error_figures import thesis_program_error_percent, thesis_sum_of_mean_errors
from host.thesis.hopfield import network
from host.thesis.original_program import SWEEPS, free_run, line_search
from host.twin.virtual import VirtualFlight, virtual_flight

FIRST_SEED = 500


@dataclass(frozen=True, slots=True)
class Case:
    """One window of one flight, and what the thesis printed for it."""

    name: str
    card: str
    axis: str
    kind: str
    rows: int
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    printed_percent: float
    mode: str


ALONG = ("airspeed_mps", "alpha_rad", "q_radps", "theta_rad")
ACROSS = ("beta_rad", "p_radps", "r_radps", "phi_rad")
CASES = (
    Case("flight 1, longitudinal", "thesis_flight1", "elevator", "pulse", 40, ALONG,
         ("elevator_rad", "elevator_rate_radps"), 6.3, "short_period"),
    Case("flight 1, lateral", "thesis_flight1", "aileron", "doublet", 40, ACROSS,
         ("aileron_rad",), 4.7, "dutch_roll"),
    Case("flight 2, longitudinal", "thesis_flight2", "elevator", "3211", 77, ALONG,
         ("elevator_rad", "throttle"), 1.47, "short_period"),
    Case("flight 2, lateral", "thesis_flight2", "aileron", "doublet", 77, ACROSS,
         ("aileron_rad",), 4.0, "dutch_roll"),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Figures:
    """One window: the program's two figures and what they hide.

    `per_state_percent` is the mean over states of sum |error| over sum |measured|; `nrmse` the mean
    of rms(error) over the standard deviation; both of free simulation on the fitted window.
    `nothing_percent` is the program's figure of states that stay at their means, `held_out` the
    NRMSE on another maneuver of the axis, `frequency_error` relative, nan without an oscillation.
    """

    program_percent: float
    sum_of_means: float
    per_state_percent: float
    nrmse: float
    nothing_percent: float
    held_out: float
    unstable: bool
    frequency_error: float


def re_enact(case: Case, seed: int) -> Figures:
    """Fly, log and fit as the thesis did.

    Parameters
    ----------
    case : Case
    seed : int

    Raises
    ------
    IdentificationError
        If the flight has no such maneuver.
    """
    flight = virtual_flight(case.card, seed, chain="thesis")
    columns, _ = even_columns(flight.table)
    dt_s = float(np.median(np.diff(columns["t_s"])))
    columns["elevator_rate_radps"] = np.gradient(columns["elevator_rad"], dt_s)
    model = free_model(case.name, case.states, case.inputs)
    starts = [m for m in maneuvers(flight) if case.axis in m["axes"]]
    chosen = [m for m in starts if m["kind"] == case.kind]
    if not chosen:
        raise IdentificationError(f"{case.card}: no {case.kind} on {case.axis}")
    window = cut(columns, model, float(chosen[0]["start_s"]), case.rows)
    names, W, b = network(model, [window])
    start = fit_equation_error(model, [window]).estimate
    beta = line_search(model, [window], names, W, b, start, sweeps=SWEEPS).estimate
    measured = window.outputs
    simulated = free_run(model, window, beta)
    if simulated is None:
        simulated = np.full_like(measured, np.inf)
    still = np.broadcast_to(measured.mean(axis=0), measured.shape)
    rest = [m for m in starts if m is not chosen[0]]
    held_out = float("nan")
    if rest:
        other = cut(columns, model, float(rest[-1]["start_s"]), case.rows)
        run = free_run(model, other, beta)
        held_out = float("inf") if run is None else nrmse(other.outputs, run)
    poles = np.linalg.eigvals(model.matrices(beta)[0])
    pairs = sorted((abs(s) for s in poles if s.imag > 0.0), reverse=True)
    true = np.mean([m["modes"][case.mode] for m in starts if case.mode in m["modes"]], axis=0)
    program = thesis_program_error_percent(measured, simulated)
    return Figures(
        program_percent=program,
        sum_of_means=thesis_sum_of_mean_errors(measured, simulated),
        per_state_percent=program * case.rows / len(case.states),
        nrmse=nrmse(measured, simulated),
        nothing_percent=thesis_program_error_percent(measured, still),
        held_out=held_out,
        unstable=bool(np.any(poles.real > 0.05)),
        frequency_error=pairs[0] / float(true[0]) - 1.0 if pairs else float("nan"),
    )


def product(case: Case, seed: int) -> tuple[float, float]:
    """Return NRMSE of the fitted maneuvers and relative error of the mode's frequency, our way."""
    flight = virtual_flight(case.card, seed)
    columns, _ = even_columns(flight.table)
    name = "longitudinal" if case.axis == "elevator" else "lateral"
    [answer] = identify_columns(at_hand(columns), models=name).linear
    axes = ("elevator",) if name == "longitudinal" else ("aileron", "rudder")
    true = [
        m["modes"][case.mode][0]
        for m in maneuvers(flight)
        if set(axes) & set(m["axes"]) and case.mode in m["modes"]
    ]
    found = [m for m in answer.modes if m.name.replace(" ", "_") == case.mode]
    fits = [f.nrmse for f in (answer.validation or answer.fits) if f.name in case.states]
    share = found[0].frequency_radps / float(np.mean(true)) - 1.0 if found else float("nan")
    return float(np.mean(fits)), share


def maneuvers(flight: VirtualFlight) -> list[dict[str, Any]]:
    """Return the maneuvers in the order of time."""
    return list(flight.maneuvers)


def cut(columns: dict[str, Array], model: LinearModel, first_s: float, rows: int) -> Maneuver:
    """Return `rows` rows from shortly before a maneuver on."""
    t = columns["t_s"]
    begin = int(np.searchsorted(t, first_s - 0.2))
    span = slice(begin, min(begin + rows, len(t)))
    return Maneuver(
        dt_s=float(np.median(np.diff(t))),
        inputs=np.column_stack([columns[c][span] for c in model.inputs]),
        outputs=np.column_stack([columns[c][span] for c in model.outputs]),
    )


def nrmse(measured: Array, simulated: Array) -> float:
    """Return the mean over states of rms(error) over standard deviation."""
    error = np.sqrt(np.mean((measured - simulated) ** 2, axis=0))
    return float(np.mean(error / np.maximum(measured.std(axis=0), 1e-9)))


def lines(case: Case, figures: Sequence[Figures], ours: Sequence[tuple[float, float]]) -> list[str]:
    """Return medians over the seeds as text."""

    def median(values: Sequence[float]) -> float:
        known = [v for v in values if not np.isnan(v)]
        return float(np.median(known)) if known else float("nan")

    f = figures
    swings = [abs(x.frequency_error) for x in f if not np.isnan(x.frequency_error)]
    mode = case.mode.replace("_", " ")
    own = [abs(b) for _, b in ours if not np.isnan(b)]
    held_out = [100.0 * x.held_out for x in f if not np.isnan(x.held_out)]
    printed = case.printed_percent
    return [
        f"{case.name} ({case.rows} rows, {len(f)} seeds; medians)",
        f"  program's figure {median([x.program_percent for x in f]):.2f} % (thesis {printed} %),"
        f" of a model in which nothing moves {median([x.nothing_percent for x in f]):.2f} %",
        f"  eq. 5.3, units mixed: {median([x.sum_of_means for x in f]):.2f}",
        f"  per state, not divided by the rows: {median([x.per_state_percent for x in f]):.0f} %"
        f" (thesis {printed * case.rows / len(case.states):.0f} %)",
        f"  NRMSE {100.0 * median([x.nrmse for x in f]):.0f} %"
        + (f", on another maneuver {median(held_out):.0f} %" if held_out else ""),
        f"  {mode} found in {len(swings)} of {len(f)}"
        + (f", its frequency off by {100.0 * median(swings):.0f} %" if swings else "")
        + f"; the model is unstable in {sum(x.unstable for x in f)}",
        f"  this product on the same flights: NRMSE {100.0 * median([a for a, _ in ours]):.0f} %"
        f" (free simulation, unseen where three were flown), {mode} found in {len(own)} of"
        f" {len(ours)}" + (f", frequency off by {100.0 * median(own):.1f} %" if own else ""),
    ]


def study(flights: int) -> list[tuple[Case, list[Figures], list[tuple[float, float]]]]:
    """Re-enact every window with `flights` seeds, and this product's answer."""
    seeds = range(FIRST_SEED, FIRST_SEED + flights)
    return [
        (case, [re_enact(case, seed) for seed in seeds], [product(case, seed) for seed in seeds])
        for case in CASES
    ]


def main(arguments: list[str] | None = None) -> int:
    """Fly, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=10)
    options = parser.parse_args(arguments)
    for item in study(options.flights):
        sys.stdout.write("\n".join(lines(*item)) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
