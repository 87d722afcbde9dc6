"""`--accept CHECK`, each name: the column is used as it is, and its finding stays open."""

from __future__ import annotations

import contextlib
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.readers.even_grid import USED
from host.sysid.checks import CHECKS, Finding, blamed
from host.sysid.flight import read_flight_columns
from studies.foreign.instrument import SENSORS_FILE

import host
from tests.host.readers.autopilot_flights import write

SURFACES = ("elevator_rad", "aileron_rad", "rudder_rad")
Change = Callable[[pd.DataFrame], pd.DataFrame]


def times(name: str, factor: float) -> Change:
    """A column in another unit or with the other sign."""
    return lambda x: x.assign(**{name: factor * x[name]})


def drifted(x: pd.DataFrame) -> pd.DataFrame:
    """Airspeed that changes by more than the forward force makes it."""
    more = 0.8 * 0.04 * np.cumsum(x["ax_mps2"] - x["ax_mps2"].mean())
    return x.assign(airspeed_mps=x["airspeed_mps"] + more - more.mean())


def stuck(x: pd.DataFrame) -> pd.DataFrame:
    """An angle of attack that stands still through a maneuver."""
    values = x["alpha_rad"].to_numpy(copy=True)
    values[:200] = values[0]
    return x.assign(alpha_rad=values)


def exchanged(x: pd.DataFrame) -> pd.DataFrame:
    """Aileron and rudder under each other's name."""
    return x.assign(aileron_rad=x["rudder_rad"], rudder_rad=x["aileron_rad"])


def climbing(x: pd.DataFrame) -> pd.DataFrame:
    """A height that falls while the vertical speed says that it climbs."""
    phase = x["t_s"] / 2.0
    return x.assign(altitude_m=100.0 - 3.0 * np.sin(phase), v_down_mps=-1.5 * np.cos(phase))


# Found in the columns: what is done about it is to read, to leave out, or nothing.
OF_COLUMNS: dict[str, tuple[str, Change]] = {
    "angle-size": ("alpha_rad", times("alpha_rad", 40.0)),
    "surface-size": ("elevator_rad", times("elevator_rad", 40.0)),
    "surface-idle": ("elevator_rad", times("elevator_rad", 1e-3)),
    "surface-sign": ("elevator_rad", times("elevator_rad", -1.0)),
    "surface-exchanged": ("aileron_rad", exchanged),
    "gravity": ("az_mps2", times("az_mps2", -1.0)),
    "airspeed-sign": ("airspeed_mps", times("airspeed_mps", -1.0)),
    "static-pressure": ("static_pa", times("static_pa", 0.01)),
    "density": ("density_kgpm3", times("density_kgpm3", 10.0)),
    "throttle": ("throttle", times("throttle", 100.0)),
    "airspeed-against-pressure": ("qbar_pa", times("qbar_pa", 3.0)),
    "theta-against-q": ("theta_rad", times("theta_rad", 1.8)),
    "phi-against-p": ("phi_rad", times("phi_rad", -1.0)),
    "psi-against-r": ("psi_rad", times("psi_rad", -1.0)),
    "alpha-against-q": ("alpha_rad", times("alpha_rad", 3.0)),
    "beta-against-r": ("beta_rad", times("beta_rad", -1.0)),
    "alpha-against-az": ("alpha_rad", times("alpha_rad", -1.0)),
    "beta-against-ay": ("ay_mps2", times("ay_mps2", -1.0)),
    "airspeed-against-ax": ("ax_mps2", drifted),
    "altitude-against-climb": ("altitude_m", climbing),
    "stuck-sensor": ("alpha_rad", stuck),
}
LATER = {
    "small-inputs", "feedback", "flow-angles", "calibration", "surface-rate",
    "instrument-errors", "time-digits",
}  # fmt: skip


@pytest.fixture(scope="module")
def record(simulated: Callable[[str, int], Path]) -> pd.DataFrame:
    """A calm flight as another logger's table."""
    table = pd.read_csv(simulated("calm", 19480) / "flight.csv")
    theirs = [name for name in ("t_s", *USED) if name in table]
    return table.loc[table["t_s"] > 8.0, theirs].iloc[::2].reset_index(drop=True)


def identified(path: Path, *options: str) -> dict[str, Any]:
    """Return what a person would type, answered by a method that takes no time."""
    arguments = ["identify", str(path), "--method", "equation-error", "--json", *options]
    return json.loads(answered(arguments))  # type: ignore[no-any-return]


def answered(arguments: list[str]) -> str:
    with contextlib.redirect_stdout(io.StringIO()) as out:
        assert main(arguments) == 0
    return out.getvalue()


def test_every_check_is_tried_here() -> None:
    assert set(OF_COLUMNS) | LATER == set(CHECKS)
    assert not set(OF_COLUMNS) & LATER


@pytest.mark.parametrize("check", OF_COLUMNS)
def test_an_accepted_column_is_used_as_it_is(check: str, record: pd.DataFrame) -> None:
    """What is done without it is in `test_unit_sign_checks` and its neighbours."""
    name, change = OF_COLUMNS[check]
    table = change(record)
    kept = read_flight_columns(table, accept=(check,))
    [found, *_] = [f for f in kept.findings if f.check == check]
    assert name in found.channels
    assert found.causes
    assert found.done == "accepted, used as it is"
    assert found.accepted
    assert not found.closed
    given = np.interp(kept.columns["t_s"], table["t_s"], table[name])
    np.testing.assert_allclose(kept.columns[name], given, atol=1e-9 * np.abs(given).max())


OF_TABLES: dict[str, Change] = {
    "small-inputs": lambda x: x.assign(**{s: 0.01 * x[s] for s in SURFACES}),
    "feedback": lambda x: x.assign(rudder_rad=0.4 * x["r_radps"]),
    "flow-angles": lambda x: x.drop(columns="alpha_rad"),
    "calibration": lambda x: x.assign(q_radps=x["q_radps"] + 0.02),
}


def test_a_search_that_did_not_converge_accuses_no_sensor(record: pd.DataFrame) -> None:
    """It says that it stopped, and that a sensor is off is nobody's to say then."""
    off = {"p_radps": record["p_radps"] + 0.3, "q_radps": 1.1 * record["q_radps"] + 0.2}
    how = {"models": ["short-period", "dutch-roll"], "methods": "equation-error"}
    found = host.identify(record.assign(**off), **how)  # type: ignore[arg-type]
    assert found.agreements == (None,)
    assert any("the search did not converge" in note for note in found.notes)
    assert not {f.check for f in found.findings} & {"calibration", "sensor-agreement"}


def test_a_column_that_no_equation_uses_cuts_and_accuses_nothing(record: pd.DataFrame) -> None:
    """A bank angle that sticks is none of the short period's business."""
    table = record.copy()
    busiest = int(np.argmax(np.abs(np.gradient(table["phi_rad"]))))
    table.loc[busiest - 100 : busiest + 100, "phi_rad"] = table["phi_rad"].iloc[busiest - 100]
    cut = read_flight_columns(table)
    assert [(f.check, f.channels) for f in cut.findings] == [("stuck-sensor", ("phi_rad",))]
    assert cut.columns["bridged"].any()
    read = ("alpha_rad", "q_radps", "elevator_rad")
    whole = read_flight_columns(table, equations=read)
    kept, notes = blamed(whole.findings, read)
    assert kept == []
    assert all(note.startswith("no equation uses phi_rad") for note in notes)
    assert "bridged" not in whole.columns


def test_blame_is_for_columns_that_an_equation_uses() -> None:
    both = Finding("theta-against-q", ("theta_rad", "q_radps"), "theta_rad moves twice as fast")
    other = Finding("phi-against-p", ("phi_rad", "p_radps"), "phi_rad moves twice as fast")
    kept, notes = blamed([both, other], ("q_radps",))
    assert [f.channels for f in kept] == [("q_radps",)]
    assert notes == ["no equation uses phi_rad, p_radps: phi_rad moves twice as fast"]
    assert blamed([both, other], ()) == ([both, other], [])


def test_a_table_without_air_says_so(record: pd.DataFrame) -> None:
    air = [name for name in ("density_kgpm3", "altitude_m", "static_pa") if name in record]
    assert air
    said = read_flight_columns(record.drop(columns=air)).notes
    assert any(note.startswith("density is not known") for note in said)
    assert not any("density" in note for note in read_flight_columns(record).notes)


@pytest.mark.parametrize("check", OF_TABLES)
def test_what_changes_no_column_says_that_accepting_overrides_nothing(
    check: str, record: pd.DataFrame, tmp_path: Path
) -> None:
    path = tmp_path / "x.csv"
    OF_TABLES[check](record).to_csv(path, index=False)
    # The gyro's zero is beyond what a calibration claims.
    claimed = ("--calibration", str(SENSORS_FILE)) if check == "calibration" else ()
    overrides_nothing(check, path, "--model", "short-period", "--model", "dutch-roll", *claimed)


@pytest.mark.parametrize("check", ["surface-rate", "instrument-errors"])
def test_so_do_those_of_an_autopilots_log(check: str, tmp_path: Path) -> None:
    path = write("dataflash", tmp_path)
    # Positions under a name that no reader knows: a log without GPS.
    path.write_bytes(path.read_bytes().replace(b"GPS\0", b"XPS\0"))
    overrides_nothing(check, path, "--model", "roll")


def overrides_nothing(check: str, path: Path, *how: str) -> None:
    plain, accepted = identified(path, *how), identified(path, *how, "--accept", check)
    [before] = [f for f in plain["findings"] if f["check"] == check]
    [after] = [f for f in accepted["findings"] if f["check"] == check]
    assert before["causes"]
    assert after["done"] == f"accepted, which overrides nothing: {before['done']}"
    assert after["accepted"]
    assert after["open"]
    for was, now in zip(plain["answers"], accepted["answers"], strict=True):
        assert was["marks"] == now["marks"]


def test_a_check_that_found_nothing_is_said(record: pd.DataFrame, tmp_path: Path) -> None:
    record.to_csv(tmp_path / "x.csv", index=False)
    found = identified(tmp_path / "x.csv", "--model", "short-period", "--accept", "density")
    assert "accepted check density found nothing in these data" in found["notes"]


def test_throttle_in_per_cent_hides_no_surface(record: pd.DataFrame, tmp_path: Path) -> None:
    """It was the only maneuver found, and the flight was refused."""
    times("throttle", 100.0)(record).to_csv(tmp_path / "x.csv", index=False)
    found = identified(tmp_path / "x.csv", "--model", "short-period", "--accept", "throttle")
    assert found["answers"]


@pytest.mark.parametrize("verb", ["identify", "predict"])
def test_all_checks_are_listed(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([verb, "--accept", "list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert {line.split()[0]: " ".join(line.split()[1:]) for line in lines} == CHECKS
