"""The study of the shipped equations goes on where it stopped, and counts what holds."""

from pathlib import Path

import pytest
from studies import shipped_models


def test_a_run_goes_on_and_counts_each_cell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    flown: list[tuple[str, float, int]] = []

    def rows(model: str, air_mps: float, seed: int, method: str | None) -> list[dict[str, object]]:
        assert method is None
        flown.append((model, air_mps, seed))
        values = (model, air_mps, seed, "filter-error", "Cl_p", -2.0, -2.0 + 0.1 * seed, 0.25, "")
        return [dict(zip(shipped_models.COLUMNS, values, strict=True))]

    monkeypatch.setattr(shipped_models, "rows_of", rows)
    arguments = ["--rows", str(tmp_path / "rows.csv"), "--first", "1", "--models", "lateral"]
    for flights in ("2", "3"):
        assert shipped_models.main([*arguments, "--flights", flights]) == 0
    assert flown == [("lateral", air, seed) for seed in (1, 2, 3) for air in (0.0, 0.5)]
    assert "lateral, 0.5 m/s: 2 of 3 hold, by ['filter-error']" in capsys.readouterr().out


@pytest.mark.parametrize("name", shipped_models.MODELS)
def test_constants_are_those_of_the_aircraft_and_the_flight(name: str) -> None:
    constants = dict(shipped_models.shipped(name, 1.1).source.constants)
    assert constants.get("density_kgpm3", 1.1) == 1.1
    assert constants.get("mass_kg", 1.793) == pytest.approx(1.793)
