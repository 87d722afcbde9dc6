"""The study of found windows in small: nothing is lost, and a run goes on where it broke off."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from studies import windows


@pytest.mark.parametrize("case", windows.CASES, ids=lambda case: case.label)
def test_windows_of_linear_records_are_as_good_as_the_whole(case: windows.Case) -> None:
    rows = [windows.linear_row(case, seed) for seed in (1, 2)]
    found = windows.compared(case.label, rows)
    assert (found.flights, found.failed, found.missed) == (2, 0, 0)
    assert np.max(found.ratio) <= windows.LIMIT_WHOLE


def test_a_fit_does_not_end_at_an_aircraft_that_diverges() -> None:
    """Its equation error had M_q at +2.1, and the search converged there: 89 bounds off."""
    row = windows.linear_row(windows.CASES[1], 6015)
    assert np.max(np.abs(np.array(row["whole"])[:, 0])) < 5.0


def test_a_run_goes_on_behind_what_is_done(tmp_path: Path) -> None:
    path, done = tmp_path / "rows.jsonl", []

    def make(seed: int, stop: int) -> windows.Row:
        if seed == stop:
            raise KeyboardInterrupt
        done.append(seed)
        return {
            "names": ["a"],
            "windows": 1,
            "whole": [[1.0, 1.0, 2.0]],
            "found": [[1.0, 1.0, 2.0]],
        }

    with pytest.raises(KeyboardInterrupt):
        windows.stored_rows(path, "case", range(4), partial(make, stop=2))
    rows = windows.stored_rows(path, "case", range(4), partial(make, stop=9))
    assert done == [0, 1, 2, 3]
    assert [row["seed"] for row in rows] == [0, 1, 2, 3]
    assert len([json.loads(line) for line in path.read_text().splitlines()]) == 4


def test_flights_without_a_window_are_counted() -> None:
    rows = [{"names": ["a"], "windows": 0, "whole": [[1.0, 1.0, 2.0]], "found": None}]
    found = windows.compared("case", rows)
    assert (found.flights, found.failed, found.missed) == (0, 1, 1)
