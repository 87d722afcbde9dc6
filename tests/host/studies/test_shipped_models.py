"""The study of the shipped equations goes on where it stopped, and counts what holds."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
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
    flight: Any = SimpleNamespace(
        table=pd.DataFrame({"t_s": [9.0], "density_kgpm3": [1.1], "rotor_radps": [800.0]}),
        maneuvers=[{"axes": ["aileron"], "condition": {"alpha_rad": 0.12}}],
        record=SimpleNamespace(
            card=SimpleNamespace(flight=SimpleNamespace(ground_s=1.0, height_m=90.0)),
            frame=SimpleNamespace(alpha_nodes_rad=[0.08, 0.11]),
        ),
    )
    constants = dict(shipped_models.shipped(name, flight).source.constants)
    known = {
        "density_kgpm3": 1.1, "mass_kg": 1.793, "spin_kgm2ps": 800.0 * 1.2991e-4,
        "alpha_ref_rad": 0.12, "thrust_pitch_rad": -0.0523599, "thrust_arm_m": -0.01554,
        "alpha_low_rad": 0.08, "alpha_high_rad": 0.11, "gust_length_m": 90.0,
    }  # fmt: skip
    for constant, value in known.items():
        assert constants.get(constant, value) == pytest.approx(value, rel=1e-3), constant
