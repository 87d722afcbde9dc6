"""Studies that keep rows: their tables count what is asked for, and a run goes on."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.errors import IdentificationError
from host.sysid.answer import TRUSTED
from studies import row_studies, wrong_models
from studies.interval_rows import interval_figure, interval_table
from studies.row_studies import ROW_STUDIES, RowStudy
from studies.wrong_models import Judged, Row

COLUMNS = ("air", "seed", "name", "true", "estimate", "half_width", "mark")
FLOWN: list[tuple[str, int]] = []


def fly(air: str, seed: int) -> Iterator[dict[str, object]]:
    """Tell M_q of -2 by a quarter more than its size; of the third seed nothing."""
    FLOWN.append((air, seed))
    if seed == 3:
        yield {"air": air, "seed": seed, "name": "refused"}
        return
    half = 0.75 if air == "calm" else 0.25
    row = (air, seed, "M_q", -2.0, -2.5, half, TRUSTED if seed == 1 else "do not use")
    yield dict(zip(COLUMNS, row, strict=True))
    yield dict(zip(COLUMNS, (air, seed, "Z_de", -1.0, 5.0, 0.1, TRUSTED), strict=True))


def study(**changes: object) -> RowStudy:
    one = RowStudy(
        "test", COLUMNS, lambda seeds, _: ((air, s) for s in seeds for air in ("calm", "gusts")),
        fly, ("air",), first_seed=1, flights=(2, 3), names=("M_q",),
    )  # fmt: skip
    return replace(one, **changes)  # type: ignore[arg-type]


def test_a_full_run_goes_on_behind_a_small_one(tmp_path: Path) -> None:
    FLOWN.clear()
    paths = study().run(tmp_path / "x", 0)
    assert [p.suffix for p in paths] == [".md", ".csv", ".svg"]
    study().run(tmp_path / "x", 1)
    assert [(air, seed) for seed in (1, 2, 3) for air in ("calm", "gusts")] == FLOWN
    lines = (tmp_path / "x.csv").read_text(encoding="utf-8").splitlines()
    assert lines[1:] == [
        "calm,M_q,2,-25.0,25.0,37.5,2,1,1",
        "gusts,M_q,2,-25.0,25.0,12.5,0,1,0",
    ]
    text = (tmp_path / "x.md").read_text(encoding="utf-8")
    assert "2 of 4 intervals hold (50.0 %); refused: 2" in text


def test_a_table_is_of_the_seeds_of_its_size(tmp_path: Path) -> None:
    study().run(tmp_path / "x", 1)
    study(flights=(1, 3)).run(tmp_path / "x", 0)
    assert "1 of 2 intervals hold" in (tmp_path / "x.md").read_text(encoding="utf-8")


def test_without_verdicts_nothing_is_relied_on() -> None:
    rows = [{"name": "L_p", "true": "-4", "estimate": "-4.4", "half_width": "0.2"}]
    table = interval_table("t", {"": rows})
    assert table.rows[0][:3] == ("all", "L_p", 1)
    assert table.rows[0][6:] == (0, "-", "-")
    [axis] = interval_figure({"": rows}).axes
    assert np.allclose(axis.lines[0].get_ydata(), -2.0)


def test_a_wrong_model_is_told_relative_to_its_truth_or_counted_as_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def judge(row: Row, seed: int, limit: dict[str, float]) -> list[Judged]:
        if seed == 6:
            raise IdentificationError("nothing")
        return [Judged("L_p", -0.25, limit["L_p"], TRUSTED)]

    monkeypatch.setattr(row_studies, "wrong_limit", lambda _: {"L_p": 0.5})
    monkeypatch.setattr(wrong_models, "judge", judge)
    key = ("lateral", "none", "white", "flight")
    [row] = row_studies.wrong_rows(*key, 5)
    assert tuple(row.values()) == (*key, 5, "L_p", 1.0, 0.75, 0.5, TRUSTED)
    [row] = row_studies.wrong_rows(*key, 6)
    assert tuple(row.values()) == (*key, 6, "refused")


@pytest.mark.parametrize("name", list(ROW_STUDIES))
def test_every_study_keys_its_rows_by_its_first_columns(name: str) -> None:
    one = ROW_STUDIES[name]
    small, full = (
        list(one.keys(range(one.first_seed, one.first_seed + n), n == one.flights[0]))
        for n in one.flights
    )
    assert set(small) < set(full)
    assert len({len(key) for key in full}) == 1
    assert "seed" in one.columns[: len(full[0])]
    assert set(one.group) < set(one.columns)
