"""Run the studies, write tables and pictures: in host/, `python -m studies ../build/study`."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

from host.compiled import prefer_machine_code
from host.errors import ExitCode
from host.extras import install_hint
from host.sysid.estimators import methods as known_methods
from host.thesis.hopfield import ITERATIONS

from studies import (
    accuracy,
    coverage,
    imported_logs,
    methods,
    refusal,
    systems,
    tables,
    thesis,
    thesis_tables,
    turbulence,
    windows,
)
from studies.inputs import SHAPES
from studies.row_studies import ROW_STUDIES
from studies.study_table import write

# runs of each study: (small, full)
ITERATION_COUNT = (20_000, ITERATIONS)
NOISE_SEEDS = (5, 100)
SYSTEMS = (25, 200)
ACCURACY_RUNS = (20, 1000)
COVERAGE_RUNS = (20, 2000)
FLIGHTS = (4, 100)
NONLINEAR_FLIGHTS = (2, 24)
METHOD_RUNS = (12, 60)  # of cheap methods; dear ones a sixth
COEFFICIENT_FLIGHTS = (2, 24)
THESIS_FLIGHTS = (1, 10)
WINDOW_SEEDS = (3, 50)
CARD_SEEDS = (1, 50)
IMPORTED_FLIGHTS = (1, 6)
FLEETS = (1, 500)
CHANGED_AIRCRAFT = (12, 300)


def study_a(stem: Path, size: int) -> list[Path]:
    """Tables 3.1 and 3.2 of the thesis, refusal."""
    from studies.figures import thesis_figure

    runs = thesis.table_32(ITERATION_COUNT[size])
    seeds = refusal.repeated(NOISE_SEEDS[size])
    found = [refusal.refusal_agreement(SYSTEMS[size], draw=draw) for draw in systems.DRAWS]
    table = tables.thesis_table(runs, seeds, found)
    return write(table, thesis_figure(runs, found[0]), stem)


def study_b(stem: Path, size: int) -> list[Path]:
    """Accuracy against the bound."""
    from studies.figures import accuracy_figure

    cases = [
        accuracy.run_case(shape, rate_hz, ACCURACY_RUNS[size])
        for shape in SHAPES
        for rate_hz in accuracy.RATES_HZ
    ]
    return write(tables.accuracy_table(cases), accuracy_figure(cases), stem)


def study_c(stem: Path, size: int) -> list[Path]:
    """Coverage of the intervals."""
    from studies.figures import coverage_figure

    cases = [
        coverage.run_case(noise, rate_hz, COVERAGE_RUNS[size])
        for noise in coverage.NOISES
        for rate_hz in coverage.RATES_HZ
    ]
    return write(tables.coverage_table(cases), coverage_figure(cases), stem)


def study_d(stem: Path, size: int) -> list[Path]:
    """Turbulence, on the linear aircraft and on the non-linear one."""
    from studies.figures import turbulence_figure

    paths = []
    for nonlinear, flights in ((False, FLIGHTS[size]), (True, NONLINEAR_FLIGHTS[size])):
        cases = [
            turbulence.run_case(intensity, flights, pilot=pilot, nonlinear=nonlinear)
            for intensity in turbulence.INTENSITIES_MPS
            for pilot in (False, True)
        ]
        name = stem.with_name(f"{stem.name}_nonlinear") if nonlinear else stem
        paths += write(tables.turbulence_table(cases), turbulence_figure(cases), name)
    return paths


def study_e(stem: Path, size: int) -> list[Path]:
    """Coefficients of virtual flights."""
    from studies import coefficients
    from studies.flight_report import coefficient_figure, coefficient_table

    seeds = range(coefficients.FIRST_SEED, coefficients.FIRST_SEED + COEFFICIENT_FLIGHTS[size])
    tally = coefficients.study("survey", seeds, thesis=True)
    return write(coefficient_table(tally), coefficient_figure(tally), stem)


def study_f(stem: Path, size: int) -> list[Path]:
    """The two thesis flights."""
    from studies import thesis_flights
    from studies.flight_report import thesis_flights_figure, thesis_flights_table

    found = thesis_flights.study(THESIS_FLIGHTS[size])
    return write(thesis_flights_table(found), thesis_flights_figure(found), stem)


def study_g(stem: Path, size: int) -> list[Path]:
    """Every method on five data sets."""
    from studies.figures import methods_figure

    scores = [
        methods.score(m, data, methods.runs_of(m, METHOD_RUNS[size]))
        for m in known_methods()
        for data in methods.DATA
    ]
    return write(tables.methods_table(scores), methods_figure(scores), stem)


def study_h(stem: Path, size: int) -> list[Path]:
    """Found windows against whole records; goes on behind the flights that are done."""
    from studies.figures import windows_figure

    seeds = range(windows.FIRST_SEED, windows.FIRST_SEED + WINDOW_SEEDS[size])
    flights = range(windows.FIRST_FLIGHT, windows.FIRST_FLIGHT + CARD_SEEDS[size])
    cards = windows.CARDS[:1]  # all eight take a minute a seed
    cases = list(windows.study(stem.with_suffix(".jsonl"), seeds, cards, flights))
    return write(tables.windows_table(cases), windows_figure(cases), stem)


def study_i(stem: Path, size: int) -> list[Path]:
    """The same flights as our logger, PX4 and ArduPilot had logged them."""
    from studies.figures import imported_figure

    first = imported_logs.FIRST_SEED
    found = list(imported_logs.study(range(first, first + IMPORTED_FLIGHTS[size])))
    return write(tables.imported_table(found), imported_figure(found), stem)


def study_j(stem: Path, size: int) -> list[Path]:
    """Table 3.1 row by row, figures 3.5 to 3.8, the periods of table 3.2."""
    return thesis_tables.study(stem, (("3-2-1-1",), tuple(SHAPES))[size])


def study_k(stem: Path, size: int) -> list[Path]:
    """Fleets at the level of estimates: intervals, and changes."""
    from studies import fleet_report as fleets

    truth, changes = fleets.truth_rows(FLEETS[size]), fleets.change_rows(CHANGED_AIRCRAFT[size])
    other = stem.with_name(f"{stem.name}_changes")
    return [
        *write(fleets.truth_table(truth), fleets.truth_figure(truth), stem),
        *write(fleets.change_table(changes), fleets.change_figure(changes), other),
    ]


STUDIES: dict[str, Callable[[Path, int], list[Path]]] = {
    "a_thesis": study_a,
    "b_accuracy": study_b,
    "c_coverage": study_c,
    "d_turbulence": study_d,
    "e_flights": study_e,
    "f_thesis_flights": study_f,
    "g_methods": study_g,
    "h_windows": study_h,
    "i_imported_logs": study_i,
    "j_thesis_tables": study_j,
    "k_fleets": study_k,
    **{name: study.run for name, study in ROW_STUDIES.items()},
}


def main(arguments: list[str] | None = None) -> int:
    """Run the chosen studies one after another on one core."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where tables and pictures go")
    parser.add_argument("--size", choices=("small", "full"), default="small")
    parser.add_argument("--only", choices=list(STUDIES), action="append")
    options = parser.parse_args(arguments)
    if find_spec("matplotlib") is None:
        sys.stderr.write(f"pictures need matplotlib: {install_hint('matplotlib')}\n")
        return int(ExitCode.USAGE)
    options.folder.mkdir(parents=True, exist_ok=True)
    prefer_machine_code()
    for name in options.only or STUDIES:
        begin = time.perf_counter()
        try:
            paths = STUDIES[name](options.folder / name, ("small", "full").index(options.size))
        except KeyboardInterrupt:
            sys.stderr.write(f"\nstopped in {name}; what is done stands in {options.folder}\n")
            return int(ExitCode.INTERRUPTED)
        sys.stdout.write(
            f"{options.folder / name}: {', '.join(p.suffix[1:] for p in paths)}"
            f"  {time.perf_counter() - begin:.0f} s\n"
        )
        sys.stdout.flush()
    return 0


def run_alone() -> int:
    """Run the program in a process whose linear algebra has one thread: ten times quicker.

    The package has loaded numpy before this module could say so.
    """
    if "OPENBLAS_NUM_THREADS" in os.environ:
        return main()
    command = [sys.executable, "-m", "studies", *sys.argv[1:]]
    try:
        return subprocess.run(command, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}).returncode
    except KeyboardInterrupt:  # the child has said what is kept
        return int(ExitCode.INTERRUPTED)


if __name__ == "__main__":
    sys.exit(run_alone())
