"""An airspeed further off than its file claims is found by what surfaces drive, in any analysis."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from host.instrument.deviations import SensorErrorModel, unknown_sensors
from host.physical.calibration import load_calibration
from host.physical.recording import FOREIGN, Recording
from host.readers.even_grid import even_columns
from host.sysid.answer import TRUSTED
from host.sysid.checks.airspeed_scale import CERTAIN, CHECK, airspeed_scale, airspeed_scale_findings
from host.sysid.pipeline import at_hand, identify_columns
from host.twin.virtual import virtual_flight
from studies.foreign.flight import Air
from studies.foreign.instrument import SENSORS_FILE, Columns, with_sensor_errors
from studies.independent import cells, flown, identified

CALM, GUSTY = Air(), cells()["karman, fixed, point, 1 m/s"]
SEED = 24300


@pytest.fixture(scope="module")
def claimed() -> SensorErrorModel:
    """What the file of the drawn sensors says of them: 1 % of airspeed."""
    return unknown_sensors(Recording(maker=FOREIGN), load_calibration(SENSORS_FILE))


def measured(air: Air, seed: int, times: float) -> Columns:
    """A flight of the independent simulator by drawn sensors, its airspeed so many times."""
    return faster(times, with_sensor_errors(flown(air, seed), np.random.default_rng(seed)))


def faster(times: float, columns: Columns) -> Columns:
    """The columns with an airspeed that reads so many times what it is."""
    return {**columns, "airspeed_mps": times * columns["airspeed_mps"]}


@pytest.mark.parametrize("times", [0.9, 1.1])
def test_calm_air_tells_the_scale(claimed: SensorErrorModel, times: float) -> None:
    columns = measured(CALM, SEED, times)
    found = airspeed_scale(columns, claimed)
    assert found is not None
    assert found.factor == pytest.approx(times, abs=0.03)
    assert found.excess > 2.0 * CERTAIN
    [finding] = airspeed_scale_findings(columns, claimed)
    assert "airspeed_mps" in finding.channels
    assert ("high" if times > 1.0 else "low") in finding.text


@pytest.mark.parametrize("air", [CALM, GUSTY], ids=["calm", "gusts of 1 m/s"])
def test_a_right_airspeed_is_not_accused(claimed: SensorErrorModel, air: Air) -> None:
    columns = measured(air, SEED, 1.0)
    found = airspeed_scale(columns, claimed)
    assert found is not None
    assert found.excess < 9.0  # three deviations
    assert airspeed_scale_findings(columns, claimed) == []


def test_what_a_file_leaves_open_is_no_finding(claimed: SensorErrorModel) -> None:
    columns = measured(CALM, SEED, 1.1)
    wide = claimed.scaled(10.0, "pitot_scale")
    assert airspeed_scale_findings(columns, wide) == []


def test_a_scale_of_the_accelerometers_that_a_file_leaves_open_is_none(
    claimed: SensorErrorModel,
) -> None:
    """Forces that read 12 % low look like an airspeed that reads high."""
    right = measured(CALM, SEED, 1.0)
    low = {k: 0.88 * v if k in ("ay_mps2", "az_mps2") else v for k, v in right.items()}
    assert len(airspeed_scale_findings(low, claimed)) == 1
    wide = claimed.scaled(25.0, "accel_scale")
    assert airspeed_scale_findings(low, wide) == []


def test_without_surfaces_nothing_tells_it(claimed: SensorErrorModel) -> None:
    columns = measured(CALM, SEED, 1.1)
    still = {k: 0.0 * v if k.endswith(("or_rad", "on_rad", "er_rad")) else v
             for k, v in columns.items()}  # fmt: skip
    assert airspeed_scale(still, claimed) is None
    bare = {k: v for k, v in columns.items() if k != "airspeed_mps"}
    assert airspeed_scale_findings(bare, claimed) == []


def test_nothing_is_under_trust_by_an_airspeed_that_is_not_its_files() -> None:
    """Coefficients of both analyses were 8 to 20 % off, known to 2 to 4."""
    answer = identified(flown(CALM, SEED), CALM, SEED, ("lateral", "coefficients"),
                        partial(faster, 1.1))  # fmt: skip
    assert CHECK in {f.check for f in answer.findings}
    marks = [mark for verdict in answer.verdicts for mark in verdict.marks.values()]
    assert len(marks) > 20
    assert TRUSTED not in marks


def test_with_gps_the_flight_path_tells_the_scale() -> None:
    """Seed 9 of the twin: right within 2 %, and read as 10 % low by forces alone in its gusts."""
    columns, _ = even_columns(virtual_flight("demo", 9).table)
    found = identify_columns(at_hand(columns, aircraft="ultrastick25e"), models="longitudinal")
    assert CHECK not in [finding.check for finding in found.findings]
    assert found.table["verdict"]["longitudinal", "M_alpha"] == TRUSTED
