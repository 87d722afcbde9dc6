"""A PX4 log, which no vane tells: the fleet has the coefficients of its linear models."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from host.constants import NORMAL_95
from host.errors import IdentificationError
from host.fleet.flight_task import DEFAULT_MODELS
from host.fleet.tasks.flight_identification import flight_row
from host.sysid import models

import host
from tests.host.readers.autopilot_flights import write

AIRCRAFT = "ultrastick25e"


def task(source: Path, models: tuple[str, ...] = DEFAULT_MODELS) -> dict[str, Any]:
    texts = ("key", "log_id", "type", "calibration", "calibration_id", "mapping", "date", "version")
    return {
        **dict.fromkeys(texts, ""),
        "source": str(source),
        "aircraft": "P1",
        "aircraft_file": AIRCRAFT,
        "aircraft_id": "f1",
        "models": models,
        "accept": (),
    }


def test_a_flight_without_vanes_has_the_coefficients_and_intervals_of_identify(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write("ulog", tmp_path)
    answers: list[host.Identification] = []

    def kept(source: Path, **how: Any) -> host.Identification:
        answers.append(host.identify(source, **how))
        return answers[-1]

    monkeypatch.setattr("host.fleet.tasks.flight_identification.identify", kept)
    row = flight_row(task(path))
    found = answers[-1]  # what `host.identify` says of it
    coefficients = {c.name: c for answer in found.linear for c in answer.coefficients}
    assert row["models"] == [answer.template for answer in found.linear]
    assert row["parameters"] == list(coefficients)
    count = len(coefficients)
    own = np.reshape(row["own_covariance"], (count, count))
    loadings = np.reshape(row["loadings"], (-1, count))
    half = NORMAL_95 * np.sqrt(np.diag(own + loadings.T @ loadings))
    for k, (name, one) in enumerate(coefficients.items()):
        assert row["estimates"][k] == pytest.approx(one.value), name
        assert half[k] == pytest.approx(one.half_width, rel=1e-3), name
        assert own[k, k] > 0.0
    # Whose an error is has its name from the direct fit: flights of both kinds share it.
    whose = dict(zip(row["errors"], row["error_sources"], strict=True))
    assert whose["iyy_share"] == whose["cg_x_m"] == "aircraft file f1"
    assert whose["gyro_y_scale"] == "instrument uncalibrated, P1"
    assert "gyro_y_bias_radps" not in whose  # new at every power-on
    assert row["airspeed_mps"] == pytest.approx(found.linear[0].condition.airspeed_mps)
    assert 0.2 < row["lift"] < 0.5


def test_a_model_that_was_asked_for_by_name_is_not_replaced(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_bytes(Path(str(models.__file__)).with_name("standard_coefficients.toml").read_bytes())
    with pytest.raises(IdentificationError, match="coefficients need the columns alpha_rad"):
        flight_row(task(write("ulog", tmp_path), (str(own),)))
