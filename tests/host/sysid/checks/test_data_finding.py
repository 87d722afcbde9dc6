"""Findings: what is wrong with a record ends no work, is said, and keeps its channel open."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.errors import IdentificationError
from host.sysid.checks import CHECKS, accepted_checks, check, checked, open_channels

import host

G = 9.80665
Columns = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def record(simulated: Callable[[str, int], Path]) -> pd.DataFrame:
    """A flight in calm air as another logger's table: speed and forward force without noise."""
    table = pd.read_csv(simulated("calm", 5) / "flight.csv")
    table = table[table["t_s"] > 8.0].reset_index(drop=True)
    for _ in range(3):
        speed = table["airspeed_mps"].rolling(51, center=True, min_periods=1).mean()
        table = table.assign(airspeed_mps=speed)
    alpha, theta, phi = (table[k] for k in ("alpha_rad", "theta_rad", "phi_rad"))
    weight = np.sin(alpha) * np.cos(theta) * np.cos(phi) - np.cos(alpha) * np.sin(theta)
    rate = np.gradient(table["airspeed_mps"], table["t_s"])
    force = rate - G * weight - np.sin(alpha) * table["az_mps2"]
    return table.assign(ax_mps2=force / np.cos(alpha))


def drifted(table: pd.DataFrame, share: float) -> pd.DataFrame:
    """Airspeed that changes by a share more than the forward force makes it."""
    force = table["ax_mps2"] - table["ax_mps2"].mean()
    more = share * np.cumsum(force) * (table["t_s"][1] - table["t_s"][0])
    return table.assign(airspeed_mps=table["airspeed_mps"] + more - more.mean())


def without_thrust(table: pd.DataFrame) -> pd.DataFrame:
    """Forward force without the part of it that a governed propeller makes."""
    force = table["ax_mps2"]
    return table.assign(ax_mps2=force.mean() + (force - force.mean()) / 1.8)


def sheared(table: pd.DataFrame) -> pd.DataFrame:
    """Headwind that grows with height: it slows the aircraft where that climbs."""
    return drifted(table, 0.8)


def slow_pitot(table: pd.DataFrame) -> pd.DataFrame:
    """A pitot behind a long hose: it loses half of what a force does to the speed."""
    return drifted(table, -0.6)


CLEAN = {"thrust": without_thrust, "shear": sheared, "pitot": slow_pitot}


@pytest.mark.parametrize("case", CLEAN)
def test_speed_against_force_is_a_finding_and_no_refusal(
    case: str, record: pd.DataFrame, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    CLEAN[case](record).to_csv(tmp_path / "x.csv", index=False)
    options = ["identify", str(tmp_path / "x.csv"), "--model", "short-period", "--json"]
    options += ["--method", "equation-error"]
    assert main(options) == 0
    answer = json.loads(capsys.readouterr().out)
    [found] = [f for f in answer["findings"] if f["check"] == "airspeed-against-ax"]
    assert found["channels"] == ["airspeed_mps", "ax_mps2"]
    assert not found["wrong_unit"]
    assert found["open"]
    assert found["causes"][:3] == [
        "thrust that is not in ax_mps2", "wind that changes with height", "a slow pitot",
    ]  # fmt: skip
    assert found["done"] == "ax_mps2 left out"
    assert main([*options, "--accept", "airspeed-against-ax"]) == 0
    # What is then no longer left out may be seen by the check of compatibility.
    every = json.loads(capsys.readouterr().out)["findings"]
    assert {f["check"] for f in every} <= {"airspeed-against-ax", "calibration"}, every
    [found] = [f for f in every if f["accepted"]]
    assert found["check"] == "airspeed-against-ax"
    assert found["done"] == "accepted, used as it is"


def test_the_verdict_begins_with_it_behind_the_notes(record: pd.DataFrame) -> None:
    found = host.identify(sheared(record), models="short-period")
    said = [line for line in found.verdict if not line.startswith("note: ")]
    assert said[0].startswith("finding airspeed-against-ax: airspeed_mps moves 1.")
    assert found.findings == found.flights[0].findings


def test_acceleration_without_gravity_is_given_its_weight(record: pd.DataFrame) -> None:
    theta, phi = record["theta_rad"], record["phi_rad"]
    weight = {
        "ax_mps2": -G * np.sin(theta),
        "ay_mps2": G * np.cos(theta) * np.sin(phi),
        "az_mps2": G * np.cos(theta) * np.cos(phi),
    }
    bare = record.assign(**{k: record[k] + w for k, w in weight.items()})
    columns: Columns = {str(k): bare[k].to_numpy() for k in bare}
    given, findings = checked(columns)
    assert [f.check for f in findings] == ["gravity"]
    assert findings[0].done == "read as accelerations without gravity"
    assert not findings[0].wrong_unit
    for name in weight:
        np.testing.assert_allclose(given[name], record[name], atol=1e-9)


def test_lift_as_deviation_from_trim_is_fitted(record: pd.DataFrame, tmp_path: Path) -> None:
    """Only the aerodynamic force, about its trim: 1.14 m/s2 in the median was "in g?"."""
    az = record["az_mps2"] - record["az_mps2"].mean()
    bare = record.drop(columns=["ax_mps2", "ay_mps2"]).assign(az_mps2=1.14 / az.abs().median() * az)
    found = host.identify(bare, models="short-period", methods="equation-error")
    assert [f.check for f in found.findings if "az_mps2" in f.channels]
    assert not any("in g" in f.done for f in found.findings)


def test_an_unknown_check_is_one_line_that_lists_them(
    record: pd.DataFrame, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record.to_csv(tmp_path / "x.csv", index=False)
    assert main(["identify", str(tmp_path / "x.csv"), "--accept", "speed-against-ax"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "--accept: no check 'speed-against-ax' (did you mean airspeed-against-ax?)" in said
    assert all(name in said for name in CHECKS)
    with pytest.raises(IdentificationError, match="argument accept: no check 'x'"):
        accepted_checks(["x"])


def test_a_clean_record_has_no_finding(record: pd.DataFrame) -> None:
    columns: Columns = {str(k): record[k].to_numpy() for k in record}
    assert check(columns) == []
    assert open_channels([]) == {}


def test_small_inputs_are_fitted_as_one_stretch(record: pd.DataFrame) -> None:
    moving = [k for k in record if k != "t_s" and str(k).endswith(("_rad", "_radps", "_mps2"))]
    mean = record[moving].mean()
    small = record.assign(**(mean + 0.15 * (record[moving] - mean)))
    how: dict[str, Any] = {"models": "short-period", "methods": "output-error-white"}
    found = host.identify(small, **how)
    [finding] = [f for f in found.findings if f.check == "small-inputs"]
    assert "is fitted as one stretch" in finding.done
    assert finding.channels == ()
    again = host.identify(
        small, models="short-period", methods="equation-error", accept="small-inputs"
    )
    [accepted] = [f for f in again.findings if f.check == "small-inputs"]
    assert accepted.accepted
    assert accepted.done == f"accepted, which overrides nothing: {finding.done}"
    given = host.identify(small, **how, from_s=float(record["t_s"][0]))
    large = host.identify(record, **how, from_s=float(record["t_s"][0]))
    for name in ("M_alpha", "M_q", "M_de"):
        value, same, other = (x.linear[0].result.value(name) for x in (found, given, large))
        assert value == pytest.approx(same, rel=0.01), name
        # What airspeed and attitude do is of second order: seven times smaller in this record.
        assert value == pytest.approx(other, rel=0.25), name
