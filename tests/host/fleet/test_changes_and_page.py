"""A fleet drawn at the level of estimates: who changed, why, and the page that says so."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.aircraft.prior.prior_file import read_prior
from host.arrays import Array
from host.fleet.flight_task import IDENTIFIED, SET_ASIDE
from host.fleet.pages.aircraft_changes import AircraftHistory, change_lines, histories
from host.fleet.pages.fleet_figures import drift_figure
from host.fleet.pages.fleet_page import fleet_page
from host.fleet.pages.type_prior import type_prior
from host.fleet.statistics.changes import ChangeTest
from host.fleet.statistics.loaded_flight import LoadedFlight
from host.fleet.statistics.type_model import TypeModel, type_model
from studies.fleet_changes import (
    USUAL,
    Watched,
    covariance,
    false_alarms,
    patterns,
    power,
    unchanged,
)

from tests.browser.chromium import PHONE, Chromium

HOSTILE = "<script>alert(1)</script>"


def drawn(aircraft: int = 4, flights: int = 12) -> list[LoadedFlight]:
    """Return a fleet whose third aircraft's elevator is thrown 30 % further from flight 10 on."""
    rng, own, usual = np.random.default_rng(8), covariance(), np.array(list(USUAL.values()))
    root, found = np.linalg.cholesky(own), []
    for number in range(aircraft):
        mine = usual * (1.0 + 0.05 * rng.standard_normal(len(usual)))
        for flight in range(flights):
            values = mine + root @ rng.standard_normal(len(usual))
            if number == 2 and flight >= 9:
                values = values + 0.30 * patterns()["throw of the elevator"]
            found.append(
                LoadedFlight(
                    aircraft=f"N{number}" if number else HOSTILE,
                    names=tuple(USUAL),
                    values=values,
                    own=own,
                    sources=(("aircraft file 1", "mass_share"),),
                    loadings=0.01 * mine[None],
                    date=f"2026-0{1 + flight // 10}-{10 + flight % 10}",
                    conditions={
                        "alpha_rad": 0.1,
                        "airspeed_mps": 17.0,
                        "chord_m": 0.25,
                        "span_m": 1.25,
                    },
                )
            )
    return found


@pytest.fixture(scope="module")
def fleet() -> tuple[TypeModel, list[AircraftHistory]]:
    kept = ("CL_alpha", "CL_de", "Cm_de")  # a picture each
    flights = [replace(f, left_out=frozenset(set(USUAL) - set(kept))) for f in drawn()]
    model = type_model("trainer", flights, (0.01, 0.0, -0.02))
    return model, histories(model)


def test_the_changed_aircraft_and_its_cause_are_named(
    fleet: tuple[TypeModel, list[AircraftHistory]],
) -> None:
    _, found = fleet
    assert [one.aircraft for one in found if one.alarms] == ["N2"]
    (line,) = change_lines(found)
    assert line.startswith("changed: N2 from flight 10 (2026-01-19) on: throw of the elevator")
    assert "; moved: Cm_de" in line
    size = next(one for one in found if one.alarms).alarms[-1].size
    assert size == pytest.approx(0.30, abs=0.08)


def test_a_shift_is_noticed_and_nothing_else_is() -> None:
    """The spread between flights is estimated, from the first flights of twelve aircraft."""
    kind = Watched()
    fleets = unchanged(kind, 12, 3)
    for cause in ("place of the CG", "throw of the elevator", "lag of the rudder"):
        found = power(kind, fleets, cause, 5.0, 4)
        assert found.alarmed >= 0.9
        assert found.named >= 0.75
    assert false_alarms(kind, fleets, 10, 5) <= 2.5


def test_what_intervals_of_flights_miss_is_counted_and_no_change() -> None:
    """Flights that scatter twice as far as their covariances say, in the lag of one servo."""
    rng, names, usual = np.random.default_rng(9), ("rudder_lag_s", "Cm_q"), np.array([0.02, -11.0])
    own = np.diag([1e-6, 0.25])
    patterns = {"lag of the rudder": np.array([1.0, 0.0]), "damping": np.array([0.0, 1.0])}
    plain = ChangeTest(patterns, np.zeros(len(names)))

    def flights(count: int) -> tuple[list[Array], list[Array]]:
        scatter = np.array([2e-3, 0.5]) * rng.standard_normal((count, 2))
        return list(usual + scatter), [own] * count

    test = plain.scaled([flights(8) for _ in range(12)])
    assert set(test.scales) == {"lag of the rudder"}
    assert test.scales["lag of the rudder"] == pytest.approx(2.0, rel=0.15)
    later = [flights(28) for _ in range(5)]
    alarms = [sum(len(one.alarms(*x)) for x in later) for one in (plain, test)]
    assert alarms[0] >= 5
    assert alarms[1] == 0
    assert plain.scaled([]).scales == {}


def test_the_page_shows_everything_and_runs_nothing(
    fleet: tuple[TypeModel, list[AircraftHistory]], tmp_path: Path
) -> None:
    model, found = fleet
    rows = pd.DataFrame(
        [
            {"state": IDENTIFIED, "aircraft": "N1", "source": "a.bin", "reason": ""},
            {"state": SET_ASIDE, "aircraft": "N1", "source": HOSTILE, "reason": "hangs"},
        ]
    )
    page = fleet_page(model, found, rows)
    assert page.count("<img ") == len(model.effects) + len(model.aircraft)
    assert "script-src &#x27;none&#x27;" in page or "script-src 'none'" in page
    assert HOSTILE not in page
    for word in (
        "throw of the elevator",
        "hangs",
        "new aircraft",
        "fly more aircraft: 4 are few",
        "moments about 0.010, 0.000, -0.020 m; alpha 5.7 deg, airspeed 17.0 m/s",
    ):
        assert word in page
    path = tmp_path / "trainer.html"
    path.write_text(page, encoding="utf-8")
    with Chromium() as browser:
        shown = browser.open(path.as_uri())
        shown.wait_for("document.readyState === 'complete'")
        assert shown.evaluate("[...document.images].filter((one) => !one.naturalWidth).length") == 0
        shown.resize(PHONE)
        assert shown.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
        assert [one for one in shown.requests if not one.startswith("data:")] == [path.as_uri()]
        assert shown.console_errors == []


def test_an_aircraft_whose_findings_leave_no_derivative_still_has_its_page() -> None:
    flights = [
        replace(f, watched={"rudder_lag_s": (0.02, 1e-3)}, left_out=frozenset(USUAL))
        if f.aircraft == "N1" else f
        for f in drawn(4, 5)
    ]  # fmt: skip
    model = type_model("trainer", flights)
    found = histories(model)
    one = next(h for h in found if h.aircraft == "N1")
    assert one.names == ("rudder_lag_s",)
    assert drift_figure(model, one) is not None


def test_the_prior_is_what_identify_reads(
    fleet: tuple[TypeModel, list[AircraftHistory]], tmp_path: Path
) -> None:
    model, _ = fleet
    path = tmp_path / "trainer.prior.toml"
    path.write_text(type_prior(model))
    prior = read_prior(path)
    table = prior.at(0.0)
    for name, effect in model.effects.items():
        assert math.isclose(table[name], effect.new_aircraft.value)
        assert math.isclose(prior.half_widths[name], 0.5 * effect.new_aircraft.width)
