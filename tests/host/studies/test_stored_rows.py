"""Rows in a file: what is there is not flown again, what is missing is, whatever the order."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from studies.stored_rows import flown_rows, seeded_run

COLUMNS = ("air_mps", "seed", "name", "estimate")


def test_a_run_goes_on_where_it_stopped(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flown: list[tuple[float, int]] = []

    def fly(air_mps: float, seed: int) -> Iterator[dict[str, object]]:
        for name in ("M_q", "M_de") if seed else ("refused",):
            yield {"air_mps": air_mps, "seed": seed, "name": name}
            if seed == 3:  # Ctrl-C in the middle of a flight
                raise KeyboardInterrupt
        flown.append((air_mps, seed))

    path = tmp_path / "new" / "rows.csv"
    with pytest.raises(SystemExit) as stopped:
        flown_rows(path, COLUMNS, [(0.5, 1), (0.5, 3)], fly)
    assert stopped.value.code == 130
    assert str(path) in capsys.readouterr().err
    rows = flown_rows(path, COLUMNS, [(0.0, 0), (0.5, 0), (0.5, 1)], fly)
    assert flown == [(0.5, 1), (0.0, 0), (0.5, 0)]
    assert [r["name"] for r in rows] == ["M_q", "M_de", "refused", "refused"]
    assert flown_rows(path, COLUMNS, [], fly) == rows


def test_a_run_that_was_stopped_before_its_first_flight_has_one_head(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    assert flown_rows(path, COLUMNS, [], lambda *_: []) == []
    [row] = flown_rows(path, COLUMNS, [(0.5, 1)], lambda a, s: [{"air_mps": a, "seed": s}])
    assert row["seed"] == "1"


def test_a_table_is_of_the_seeds_that_were_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--first", "7", "--flights", "2", "--rows", "here.csv"]
    run = seeded_run("mine", "About it.", words, flights=50, first_seed=1)
    assert (run.seeds, run.rows) == (range(7, 9), Path("here.csv"))
    rows = [{"seed": str(seed)} for seed in (6, 7, 8, 9)]
    assert run.report(rows, lambda own: [r["seed"] for r in own]) == 0
    assert capsys.readouterr().out == "7\n8\n"
    usual = seeded_run("mine", None, [], flights=50, first_seed=1)
    assert (usual.seeds, usual.rows) == (range(1, 51), Path("../build/study/mine.csv"))


def test_a_folder_in_place_of_the_file_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--rows", str(tmp_path)]
    with pytest.raises(SystemExit) as stopped:
        seeded_run("mine", "About it.", words, flights=50, first_seed=1)
    assert stopped.value.code == 2
    assert "is a folder; name a file in it" in capsys.readouterr().err
