"""Optimal cards: their tones tell most within the excursions, and the card flies as written."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.file import Aircraft
from host.aircraft.linear_aircraft import load
from host.cli import main
from host.constants import NORMAL_95
from host.planning import prior_range
from host.planning.card_design import TARGET_EXCURSIONS
from host.planning.card_planning import exact, point_of
from host.planning.identified_aircraft import identified_range
from host.planning.optimal_card import (
    FIRST_DRAW,
    OptimalCard,
    optimal_card,
    prior_of,
    standard_card,
)
from host.planning.prior_range import random_aircraft
from host.planning.tone_design import powers, relative_variances
from host.planning.tone_information import tone_table
from host.twin.flight.fly import fly
from host.twin.sensors.local_flow import air_data
from host.twin.testcard import cards
from host.twin.testcard.cards import CardError
from host.wire.flight_card import card_faults, read_card


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load("ultrastick25e")


@pytest.fixture(scope="module")
def found(aircraft: Aircraft) -> OptimalCard:
    return optimal_card(aircraft)


def test_all_axes_move_at_once_on_harmonics_of_their_own(found: OptimalCard) -> None:
    point = found.card.segments[1]
    assert point.axes == ("elevator", "aileron", "rudder")
    harmonics = [tone.harmonic for tone in point.tones]
    assert len(set(harmonics)) == len(harmonics) <= 10
    assert max(harmonics) <= 5.0 * point.duration_s
    # It begins near zero: no step that nobody asked for.
    for axis in point.axes:
        own = [t for t in point.tones if t.axis == axis]
        begin = sum(t.share * math.sin(2.0 * math.pi * t.phase_turn) for t in own)
        assert abs(begin) < 0.5, axis


def test_drawn_aircraft_keep_the_excursions(aircraft: Aircraft, found: OptimalCard) -> None:
    worst = 0.0
    for k in range(3):
        record = fly(exact(found.card), aircraft=random_aircraft(aircraft, FIRST_DRAW + k))
        data = air_data(record)
        point = point_of(record, data, found.card.segments[1], record.schedule.windows[0])
        shares = [getattr(point, name) / limit for name, limit in TARGET_EXCURSIONS.items()]
        worst = max(worst, *shares)
    assert 0.6 < worst < 1.15


def test_chosen_powers_beat_a_flat_spectrum(aircraft: Aircraft) -> None:
    hertz = np.arange(2, 36) / 10.0
    table = tone_table(aircraft, "longitudinal", 17.0, 0.3, hertz)
    best = powers([table], "longitudinal", np.ones(len(hertz), dtype=np.bool_), (3,))
    load = np.sum(np.abs(table.response) ** 2, axis=1)
    flat = np.full(len(hertz), np.sum(best * load) / np.sum(load))
    assert np.count_nonzero(best > 1e-6 * best.max()) <= 3
    widest = [relative_variances(table, "longitudinal", w).max() for w in (best, flat)]
    assert widest[0] < 0.7 * widest[1]


def test_information_is_that_of_a_regression_on_simulated_sines(aircraft: Aircraft) -> None:
    """Twice the amplitude tells four times as much; two frequencies tell three parameters."""
    table = tone_table(aircraft, "longitudinal", 17.0, 0.3, np.array([0.8, 2.4]))
    one = relative_variances(table, "longitudinal", np.array([1.0, 1.0]))
    assert relative_variances(table, "longitudinal", np.array([4.0, 4.0])) == pytest.approx(one / 4)
    rank = [np.linalg.matrix_rank(table.information[k, 1], tol=1e-9 * np.trace(
        table.information[k, 1])) for k in range(2)]  # fmt: skip
    assert rank == [2, 2]
    assert np.linalg.matrix_rank(table.information[:, 1].sum(axis=0)) == 3


def test_draws_follow_what_the_prior_says(aircraft: Aircraft) -> None:
    shares = [
        random_aircraft(aircraft, seed).vectors["aerodynamics.cm_q"][0]
        / aircraft.vectors["aerodynamics.cm_q"][0]
        for seed in range(200)
    ]
    assert np.std(shares) == pytest.approx(prior_range.SHARES["q"], rel=0.2)
    aircraft = Aircraft(
        "x", "x", aircraft.scalars, aircraft.vectors,
        {"aerodynamics.cm_q": "identified, default: -11 +- 1.1 (95 %)"},
    )  # fmt: skip
    assert prior_range.share(aircraft, "cm_q") == pytest.approx(0.1 / 1.96, rel=0.01)
    assert prior_range.share(aircraft, "cn_p") == prior_range.CROSS_SHARE


def test_a_prior_file_takes_the_place_of_the_aircrafts_own(
    aircraft: Aircraft, tmp_path: Path
) -> None:
    path = tmp_path / "prior.toml"
    path.write_text("[coefficients]\nCm_q = -14.0\nCl_p = -0.5\n")
    moved, names = prior_of(aircraft, path)
    assert names == ["Cm_q", "Cl_p"]
    assert set(moved.vectors["aerodynamics.cm_q"]) == {-14.0}
    assert set(moved.vectors["aerodynamics.croll_p"]) == {-0.5}


def test_the_standard_card_has_a_3211_on_each_axis(aircraft: Aircraft) -> None:
    points = standard_card(aircraft, repeat=2).segments[1:-1]
    assert [p.axes[0] for p in points] == ["elevator", "aileron", "rudder"] * 2
    assert {p.kind for p in points} == {"3211"}


def test_the_verb_writes_a_card_for_the_twin_and_one_for_the_logger(
    found: OptimalCard, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.setattr("host.planning.optimal_card.optimal_card", lambda *_, **__: found)
    text, data = tmp_path / "optimal.toml", tmp_path / "flight.card"
    asked = ["plan", "--optimal", "--flights", "0", "--save", str(text), "--card", str(data)]
    assert main(asked) == 2  # of which aircraft?
    assert not data.exists()
    assert "name the aircraft" in capsys.readouterr().err
    asked += ["--aircraft", "ultrastick25e"]
    assert main([*asked, "--amplitude", "0.33"]) == 0
    said = capsys.readouterr()
    assert "default calibration" in said.err
    flown = cards.load(text)
    assert flown.segments == found.card.segments
    card = data.read_bytes()
    assert card_faults(card) == []
    rows = read_card(card).rows
    assert len(rows) == len(found.card.segments) - 2
    degrees = dict(zip(flown.segments[1].axes, flown.segments[1].amplitudes, strict=True))
    us = 0.33 * math.radians(degrees["elevator"]) / 1.754613e-3
    assert rows[0]["amplitude_us"][1] == pytest.approx(us, abs=1.0)
    assert main([*asked, "--want", "0"]) == 2
    assert main(["plan", "demo", "--optimal"]) == 2
    assert main(["plan", "demo", "--flights", "0", "--card", str(data)]) == 2
    assert "which the logger never drives" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("tones", "said"),
    [
        ([["elevator", 3, 0.5, 0.0]], "tones have none of aileron"),
        ([["rudder", 3, 0.5, 0.0]], "tone ['rudder', 3, 0.5, 0.0]"),
        ([["elevator", 3, 0.0, 0.0]], "tone_share"),
        ([["elevator", 0, 0.5, 0.0]], "expected [axis, harmonic"),
        ("many", "expected a list"),
    ],
)
def test_tones_that_cannot_be_flown_are_named(tones: object, said: str, tmp_path: Path) -> None:
    row = {"kind": "multisine", "axis": ["elevator", "aileron"], "amplitude": [1.0, 1.0],
           "duration_s": 10.0, "tones": tones}  # fmt: skip
    with pytest.raises(CardError) as error:
        cards.parse({"format": 1, "aircraft": "ultrastick25e", "segment": [row]}, "card")
    assert said in str(error.value)


MODEL = """\
name = "longitudinal"
states = ["airspeed_mps", "alpha_rad", "q_radps", "theta_rad"]
inputs = ["elevator_rad"]
outputs = ["q_radps"]
A = [[-0.4, 2.4, 0.0, -9.8], [-0.07, "Z_alpha", 0.97, 0.0], [0.1, "M_alpha", "M_q", 0.0],
     [0.0, 0.0, 1.0, 0.0]]
B = [[0.0], [-0.9], ["M_de"], [0.0]]
C = [[0.0, 0.0, 1.0, 0.0]]
D = [[0.0]]
[parameters]
Z_alpha = { start = -7.0 }
M_alpha = { start = -200.0 }
M_q = { start = -13.0 }
M_de = { start = -150.0 }
[fit]
method = "output error"
Z_alpha = [-7.0, 0.0]
M_alpha = [-200.0, 40.0]
M_q = [-13.0, 2.0]
M_de = [-150.0, 15.0]
[trim]
airspeed_mps = 17.0
alpha_rad = 0.1
theta_rad = 0.1
"""


def test_an_identified_model_is_a_prior_within_its_intervals(
    aircraft: Aircraft, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "model.toml"
    model.write_text(MODEL)
    fleet = identified_range(aircraft, [model], 120)
    # Body axes: w = V alpha (all but the cosine of alpha), so M_alpha stands divided by V.
    pitch = np.array([a.straight.longitudinal_a[2] for a in fleet if a.straight is not None])
    share = float(np.std(pitch[:, 1] / pitch[0, 1]))
    assert share == pytest.approx(0.2 / NORMAL_95, rel=0.12)
    assert np.std(pitch[:, 2]) == pytest.approx(2.0 / NORMAL_95, rel=0.12)
    lateral = np.array([a.straight.lateral_a[1, 1] for a in fleet if a.straight is not None])
    assert np.std(lateral) / abs(lateral[0]) > 0.05  # of roll it says nothing: as before a flight

    card = tmp_path / "card.toml"
    command = ["plan", "--optimal", "--prior", str(model), "--flights", "0", "--save", str(card)]
    assert main(command) == 0
    assert "drawn from their intervals" in capsys.readouterr().err
    assert cards.load(str(card)).segments[1].kind == "multisine"
    assert main([*command, "--airspeed", "25"]) == 2
    assert "says nothing of another airspeed" in capsys.readouterr().err
    assert main([*command, "--prior", "handbook.toml"]) == 2
    assert "--prior" in capsys.readouterr().err
