"""Tables of self-made loggers: a line that is no row costs itself alone, and is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from host.sysid.flight import FlightColumns, read_flight_columns

from tests.host.readers import changed_logs as logs

pytestmark = pytest.mark.costs(30, "the first of them flies the virtual flight, which is kept")


@pytest.fixture(scope="module")
def every() -> list[str]:
    return logs.lines(logs.table())


@pytest.fixture(scope="module")
def control(every: list[str], tmp_path_factory: pytest.TempPathFactory) -> FlightColumns:
    return read_flight_columns(logs.text(tmp_path_factory.mktemp("table") / "same.csv", every))


def same(found: FlightColumns, control: FlightColumns, atol: float = 0.0) -> None:
    assert found.columns.keys() == control.columns.keys()
    for name, values in control.columns.items():
        np.testing.assert_allclose(found.columns[name], values, atol=atol, err_msg=name)


def test_a_comma_behind_the_last_name(
    every: list[str], control: FlightColumns, tmp_path: Path
) -> None:
    """Columns were called 1 to 15."""
    same(read_flight_columns(logs.text(tmp_path / "x.csv", [every[0] + ",", *every[1:]])), control)


def test_two_rows_on_a_line_and_a_row_that_is_cut(
    every: list[str], control: FlightColumns, tmp_path: Path
) -> None:
    """The whole table was refused: 'Expected 15 fields in line 502, saw 22'."""
    glued = list(every)
    for k in (600, 1400, 2200):
        glued[k] = every[k][: len(every[k]) // 2] + every[k + 1]
        glued[k + 1] = ""
    glued[3000] = every[3000][:40]
    found = read_flight_columns(logs.text(tmp_path / "x.csv", [line for line in glued if line]))
    same(found, control, atol=0.2)  # a line is drawn over a missing row
    (note,) = [n for n in found.notes if "another width" in n]
    assert note.startswith("4 of ")
    assert note.endswith("the first in line 601")


def test_names_that_stand_there_again(
    every: list[str], control: FlightColumns, tmp_path: Path
) -> None:
    again = [*every[:2000], every[0], *every[2000:]]
    found = read_flight_columns(logs.text(tmp_path / "x.csv", again))
    same(found, control)
    assert "the names stand there again in 1 lines, the first 2001: left out" in found.notes


def test_rows_that_are_short_as_a_rule_are_kept(
    every: list[str], control: FlightColumns, tmp_path: Path
) -> None:
    """A logger that writes its slow sensor at the end of every tenth row only."""
    rows = [f"{line},{k % 7},{k}" if k % 10 == 0 else line for k, line in enumerate(every[1:])]
    found = read_flight_columns(logs.text(tmp_path / "x.csv", [every[0] + ",gps,fix", *rows]))
    same(found, control)
