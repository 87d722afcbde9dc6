"""Linear aircraft: published matrices and identified models, flown like any other."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.aircraft import file as aircraft
from host.aircraft.airframe import Array
from host.aircraft.file import Aircraft, AircraftError
from host.aircraft.linear_aircraft import load
from host.aircraft.linearisation import linear_aircraft_derivatives, linearise, modes
from host.aircraft.rigid_body import run
from host.aircraft.trim import solve
from host.cli import main
from host.errors import IdentificationError
from host.planning.identified_aircraft import is_model, with_models
from host.sysid.models import LinearModel, Trim, template
from host.sysid.models.model_text import model_text
from host.twin.faults import Fault
from host.twin.flight.fly import fly
from host.twin.outcome.truth_files import maneuvers
from host.twin.sensors.local_flow import air_data
from host.twin.testcard import cards
from scipy.signal import lsim

NAME = "ultrastick25e_linear17"


def published() -> dict[str, Array]:
    document = tomllib.loads((aircraft.FOLDER / f"{NAME}.toml").read_text())
    return {key: np.array(value) for key, value in document.items() if key[-2:] in ("_a", "_b")}


def test_it_flies_with_the_matrices_it_was_published_with() -> None:
    frame = load(NAME).airframe()
    trim = solve(frame, 17.0)
    assert trim.residual < 1e-12
    linear, given = linearise(frame, trim), published()
    # Gravity and the turning of attitude are the twin's own: they agree to the source's digits.
    for name in ("longitudinal_a", "lateral_a"):
        found = getattr(linear, name)
        assert np.allclose(found[:3, :3], given[name][:3, :3], atol=1e-6)
        assert np.allclose(found, given[name], atol=3e-3)
    assert np.allclose(linear.longitudinal_b, given["longitudinal_b"], atol=1e-6)
    assert np.allclose(linear.lateral_b, given["lateral_b"], atol=1e-6)
    # The source's aileron is one surface.
    assert given["lateral_b"][1, 0] == pytest.approx(2 * 78.2349394)
    found = {m.name: m for m in modes(linear)}
    assert found["short period"].frequency_radps == pytest.approx(15.7, abs=1.5)


def test_a_small_doublet_is_the_matrices_own_response() -> None:
    frame = load(NAME).airframe()
    trim, given = solve(frame, 17.0), published()
    t = np.arange(0.0, 4.0, 1e-3)
    command = np.tile(trim.command, (len(t) - 1, 1))
    wave = 0.004 * np.sign(np.sin(2.0 * np.pi * t)) * (t < 1.0)
    command[:, 0] += wave[:-1]
    command[:, 1] += wave[:-1]
    states, _ = run(frame, trim.state, command, np.zeros(9), 1.2, 1e-3)
    for name, column, row, surface in (("longitudinal", 4, 2, 13), ("lateral", 3, 1, 14)):
        a, b = given[f"{name}_a"], given[f"{name}_b"][:, :1]
        deflection = states[:, surface] - trim.state[surface]
        _, _, expected = lsim((a, b, np.eye(4), np.zeros((4, 1))), deflection, t)
        error = states[:, column] - expected[:, row]
        assert np.abs(error).max() < 0.01 * np.abs(expected[:, row]).max(), name
        # A damping 5 % off would be seen.
        a[row, row] *= 1.05
        _, _, wrong = lsim((a, b, np.eye(4), np.zeros((4, 1))), deflection, t)
        seen = np.abs(states[:, column] - wrong[:, row]).max()
        assert seen > 0.01 * np.abs(expected[:, row]).max(), name


def test_a_card_flies_it_with_a_pilot_in_gusts() -> None:
    card = replace(cards.load("demo"), aircraft=NAME)
    record = fly(card, seed=3)
    data = air_data(record)
    flying = record.t_s > 7.0
    assert not record.touched_ground
    assert np.abs(data.airspeed_mps[flying] - 17.0).max() < 4.0
    found = maneuvers(record, data)
    assert len(found) == len(record.schedule.windows)
    derivatives = found[0]["derivatives"]
    assert isinstance(derivatives, dict)
    assert derivatives["M_de"] == pytest.approx(-133.69054096, rel=1e-6)
    assert derivatives["Z_q"] == pytest.approx(15.71859022 - 16.974, abs=1e-3)
    # The specific force of steady flight is that of gravity.
    calm = fly(replace(cards.load("calm"), aircraft=NAME), seed=1)
    quiet = (calm.t_s > 6.0) & (calm.t_s < 7.0)
    assert np.linalg.norm(calm.specific_force_mps2[quiet].mean(axis=0)) == pytest.approx(
        9.80665, rel=0.01
    )


def saved(folder: Path, name: str, *, trim: bool = True) -> tuple[Path, LinearModel]:
    """A model as `host identify --save-model` writes it, with values of its own."""
    about = Trim(18.0, 0.09, 0.09)
    model = template(name, about, accelerometers=True)
    rng = np.random.default_rng(4)
    values = model.start * (1.0 + 0.1 * rng.standard_normal(len(model.start)))
    model = model.with_start(values)
    path = folder / f"{name}.toml"
    path.write_text(model_text(model, None, about if trim else None))
    return path, model


def in_model_axes(flown: Aircraft, name: str) -> tuple[Array, Array]:
    frame = flown.airframe()
    trim = solve(frame, 18.0)
    linear = linearise(frame, trim)
    if name in ("lateral", "dutch-roll", "roll"):
        t = np.diag([18.0, 1.0, 1.0, 1.0])
        back = np.asarray(np.linalg.inv(t), dtype=np.float64)
        return back @ linear.lateral_a @ t, back @ linear.lateral_b
    t = np.eye(4)
    t[:2, :2] = [
        [math.cos(0.09), -18.0 * math.sin(0.09)],
        [math.sin(0.09), 18.0 * math.cos(0.09)],
    ]
    back = np.asarray(np.linalg.inv(t), dtype=np.float64)
    return back @ linear.longitudinal_a @ t, back @ linear.longitudinal_b


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("longitudinal", [0, 1, 2, 3]), ("short-period", [1, 2]), ("lateral", [0, 1, 2, 3]),
        ("dutch-roll", [0, 2]), ("roll", [1, 3]),
    ],
)  # fmt: skip
def test_a_saved_model_flies_with_the_matrices_it_has(
    tmp_path: Path, name: str, rows: list[int]
) -> None:
    path, model = saved(tmp_path, name)
    assert is_model(path)
    flown = with_models(load("ultrastick25e"), [path])
    a, b = in_model_axes(flown, name)
    given_a, given_b, _, _ = model.matrices(model.start)
    # The angle of climb is not in an aircraft that flies level: 1 % of gravity.
    assert np.allclose(a[np.ix_(rows, rows)], given_a, rtol=1e-6, atol=0.02)
    columns = [("aileron_rad", "rudder_rad").index(x) if "_" in x and x[0] != "e" else 0
               for x in model.inputs]  # fmt: skip
    assert np.allclose(b[np.ix_(rows, columns)], given_b, rtol=1e-5, atol=1e-5)


def test_two_saved_models_fly_together_and_others_are_refused(tmp_path: Path) -> None:
    base = load("ultrastick25e")
    both = [saved(tmp_path, name)[0] for name in ("longitudinal", "lateral")]
    flown = with_models(base, both)
    d = linear_aircraft_derivatives(flown.airframe(), solve(flown.airframe(), 18.0))
    longitudinal, lateral = (tomllib.loads(path.read_text())["parameters"] for path in both)
    assert d["M_q"] == pytest.approx(longitudinal["M_q"]["start"], rel=1e-6)
    assert d["L_p"] == pytest.approx(lateral["L_p"]["start"], rel=1e-6)
    assert "longitudinal.toml, lateral.toml" in flown.title
    with pytest.raises(AircraftError, match="cannot be flown"):
        with_models(base, [saved(tmp_path, "phugoid")[0]])
    with pytest.raises(IdentificationError, match=r"no \[trim\]"):
        with_models(base, [saved(tmp_path, "roll", trim=False)[0]])


def test_what_a_linear_aircraft_cannot_do_is_refused(tmp_path: Path) -> None:
    card = replace(cards.load("calm"), aircraft=NAME)
    with pytest.raises(AircraftError, match="no motor to cut"):
        fly(replace(card, faults=(Fault("motor_cut", 9.0),)))
    with pytest.raises(AircraftError, match=r"linear about 17\.0 m/s, calm wants 14\.0"):
        fly(replace(card, flight=replace(card.flight, airspeed_mps=14.0)))
    text = (aircraft.FOLDER / f"{NAME}.toml").read_text()
    for change, message in (
        (("-9.79069403", "9.79069403"), "gravity enters with 9.791"),
        (("base = ", "bass = "), "no aircraft"),
        (("source = ", "# source = "), "the matrices have no source"),
        (("w_mps = 0.94", "w_mps = true"), "w_mps is True, expected a number"),
        (("[0.46979388], ", ""), r"longitudinal_b has shape \(3, 1\)"),
    ):
        path = tmp_path / "broken.toml"
        path.write_text(text.replace(*change))
        with pytest.raises(AircraftError, match=message):
            load(path)


def test_the_command_flies_what_identify_saved(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, _ = saved(tmp_path, "short-period")
    card = tmp_path / "card.toml"
    card.write_text(
        'format = 1\naircraft = "ultrastick25e"\n[flight]\nground_s = 1.0\n[[segment]]\n'
        'kind = "doublet"\naxis = "elevator"\namplitude = 2.0\nwidth_s = 0.4\n'
    )
    options = ["--firmware", "none", "--no-picture", "-o", str(tmp_path / "flown")]
    assert main(["simulate", str(card), "--aircraft", str(path), *options]) == 0
    assert "linear, with short-period.toml" in capsys.readouterr().out
    truth = tomllib.loads((tmp_path / "flown" / "flight.truth.toml").read_text())
    start = tomllib.loads(path.read_text())["parameters"]["M_q"]["start"]
    assert truth["maneuver"][0]["derivatives"]["M_q"] == pytest.approx(start, rel=1e-6)
    twice = ["--aircraft", "ultrastick25e", "--aircraft", "kadetlt40"]
    assert main(["simulate", str(card), *twice, *options]) == 2
    assert "one aircraft flies" in capsys.readouterr().err
