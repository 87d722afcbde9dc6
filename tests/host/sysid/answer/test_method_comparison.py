"""Every quick method on one flight: none stumbles, and the table fits the terminal."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from host.sysid.answer.method_comparison import method_table
from host.sysid.estimators import methods
from host.sysid.flight import read_columns
from host.sysid.linear import STAGED, Answer
from host.sysid.maneuvers import select_maneuvers

from tests.host.sysid.at_hand import identify
from tests.host.sysid.verdicts import verdict_lines

SLOW = {"hopfield-line-search", "genetic", "unscented-kalman", "filter-error", "neural-delta"}


@pytest.fixture(scope="module")
def answers(simulated: Callable[[str, int], Path]) -> dict[str, Answer]:
    """Every quick method on one 3-2-1-1 in light turbulence."""
    flown = read_columns(simulated("demo", 3) / "flight.csv")[0]
    windows = select_maneuvers(flown, numbers=[1])
    first_s, last_s = windows[0].fit_window()
    there = (flown["t_s"] > first_s - 1.0) & (flown["t_s"] < last_s + 1.0)
    columns = {k: v[there][::2] for k, v in flown.items()}
    found = {}
    for method in dict.fromkeys((*STAGED, *methods())):
        if method in SLOW:
            continue
        [found[method]] = identify(columns, names=("short-period",), method=method, windows=windows)
    return found


@pytest.mark.costs(25, "every quick method of the list, once for all below")
def test_every_method_of_the_list_answers(answers: dict[str, Answer]) -> None:
    for method, answer in answers.items():
        assert "M_alpha" in answer.result.names, method
        assert [f.name for f in answer.fits] == list(answer.model.outputs), method


@pytest.mark.parametrize(("width", "room"), [(80, 3), (120, 4), (30, 1)])
def test_the_table_fits(width: int, room: int, answers: dict[str, Answer]) -> None:
    lines = method_table(list(answers.values()), width)
    assert max(len(line) for line in lines[:-1]) <= max(width, 36)
    heads = [line for line in lines if line.startswith("short-period")]
    assert len(heads) == -(-len(answers) // room)
    for method in ("equation-error-total", "hopfield-whitened"):
        assert any(method in line for line in lines)
    assert sum(line.startswith("  M_alpha ") for line in lines) == len(heads)


def test_what_did_not_converge_is_not_trusted(answers: dict[str, Answer]) -> None:
    stopped = answers["hopfield"]
    assert not stopped.result.converged
    lines = verdict_lines([stopped], [])
    assert "  good (within 10 %):  nothing" in lines
    assert "  no convergence: estimates and intervals mean nothing, use another method" in lines
    table = method_table([stopped], 80)
    assert all(line.endswith("*") for line in table[1:-1])
    settled = replace(stopped, result=replace(stopped.result, converged=True))
    assert not any("no convergence" in line for line in verdict_lines([settled], []))
