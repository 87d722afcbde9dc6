"""Coefficients straight from flight by `host identify`: words, numbers, pictures, files."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from host.aircraft.mass_properties import AirframeData, Condition, airframe_data
from host.cli import main
from host.export.pictures import save
from host.sysid.answer import read_truth, true_coefficients
from host.sysid.answer.figure_kinds import Bar, interval_bars
from host.sysid.coefficients import CoefficientAnswer
from host.sysid.coefficients.coefficient_estimator import merged_windows
from host.sysid.coefficients.coefficient_modes import coefficient_modes, quantities
from host.sysid.conversion import ConversionPoint, to_derivatives
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.pipeline import Identification, identify
from scipy import io

NAME = "ultrastick25e"
RED = "#d62728"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A flight of the survey card, every tolerance drawn, without the recorder."""
    folder = tmp_path_factory.mktemp("survey")
    flags = ["--firmware", "none", "--no-picture", "--seed", "31", "-o", str(folder)]
    assert main(["simulate", "survey", *flags]) == 0
    return folder


@pytest.fixture(scope="module")
def found(folder: Path) -> Identification:
    """What `host identify` finds in that flight, once for all below."""
    source, truth = folder / "flight.csv", folder / "flight.truth.toml"
    return identify(source, aircraft=NAME, models="coefficients", truth=truth)


@pytest.fixture(scope="module")
def answer(found: Identification) -> CoefficientAnswer:
    assert found.coefficients is not None
    return found.coefficients


def test_finds_all_maneuvers_and_their_truth(folder: Path, answer: CoefficientAnswer) -> None:
    assert [w.longitudinal for w in answer.windows] == 3 * [True] + 6 * [False]
    truth = read_truth(folder / "flight.truth.toml")
    inside = total = 0
    for table in answer.tables:
        expected = true_coefficients(truth, table.template)
        for c in table.coefficients:
            total += 1
            inside += abs(c.value - expected[c.name]) <= c.half_width
    assert total == 24
    assert inside >= 20
    # The bound means something: intervals a fifth as wide do not hold the truth.
    narrow = sum(
        abs(c.value - true_coefficients(truth, t.template)[c.name]) <= 0.2 * c.half_width
        for t in answer.tables
        for c in t.coefficients
    )
    assert narrow < 15


def test_modes_need_no_inertia(folder: Path, answer: CoefficientAnswer) -> None:
    truth = read_truth(folder / "flight.truth.toml")["maneuver"]
    found = {m.name.replace(" ", "_"): m for m in answer.modes}
    for name, axis, within in (("short_period", "elevator", 0.03), ("dutch_roll", "rudder", 0.02)):
        expected = [m["modes"][name] for m in truth if axis in m["axes"]]
        frequency = sum(f for f, _ in expected) / len(expected)
        damping = sum(d for _, d in expected) / len(expected)
        assert found[name].frequency_radps == pytest.approx(frequency, rel=within)
        assert found[name].damping == pytest.approx(damping, abs=0.03)
        # Inertia is uncertain by 5 %, which is 2.5 % of a frequency; the motion does not care.
        assert 1.96 * found[name].frequency_sd_radps < 0.02 * frequency


def test_the_rotor_settles_within_a_phugoid(folder: Path, answer: CoefficientAnswer) -> None:
    """Held at its speed it damps the phugoid twice as much."""
    truth = read_truth(folder / "flight.truth.toml")["maneuver"]
    found = next(m for m in answer.modes if m.name == "phugoid")
    expected = [m["modes"]["phugoid"] for m in truth if "elevator" in m["axes"]]
    frequency, damping = (sum(x) / len(x) for x in zip(*expected, strict=True))
    assert found.frequency_radps == pytest.approx(frequency, rel=0.03)
    assert found.damping == pytest.approx(damping, rel=0.1)


def test_another_inertia_than_the_fit_used_moves_the_modes(answer: CoefficientAnswer) -> None:
    frame = airframe_data(NAME)
    heavy = AirframeData(
        **{f: getattr(frame, f) for f in frame.__dataclass_fields__ if f != "iyy_kgm2"},
        iyy_kgm2=1.2 * frame.iyy_kgm2,
    )
    same, other = (
        next(m for m in coefficient_modes(answer.fit, a) if m.name == "short period")
        for a in (frame, heavy)
    )
    assert other.frequency_radps < 0.95 * same.frequency_radps


def test_modes_need_no_zero_of_the_pitot(answer: CoefficientAnswer) -> None:
    fit, drift_pa = answer.fit, 6.0
    (was, sd), frame = fit.errors["pitot_zero_pa"], airframe_data(NAME)
    more = (fit.condition.qbar_pa - was) / (fit.condition.qbar_pa - was - drift_pa)
    assert more > 1.02
    rates = tuple(f"_{k}" for k in "pqr")
    scaled = tuple(
        replace(d, value=d.value * (more**0.5 if d.name.endswith(rates) else more))
        for d in fit.derivatives
    )
    errors = fit.errors | {"pitot_zero_pa": (was + drift_pa, sd)}
    other = coefficient_modes(replace(fit, derivatives=scaled, errors=errors), frame)
    for mode, same in zip(answer.modes, other, strict=True):
        if mode.name in ("short period", "dutch roll"):
            assert same.frequency_radps == pytest.approx(mode.frequency_radps, rel=0.003)


def test_modes_are_at_the_airspeed_of_their_own_maneuvers(answer: CoefficientAnswer) -> None:
    fit, frame = answer.fit, airframe_data(NAME)
    along, across = fit.condition.airspeed_ratio
    quick = replace(fit, condition=replace(fit.condition, airspeed_ratio=(1.02 * along, across)))
    before, after = (
        {m.name: m.frequency_radps for m in coefficient_modes(f, frame)} for f in (fit, quick)
    )
    assert after["short period"] == pytest.approx(1.02 * before["short period"], rel=0.002)
    assert after["dutch roll"] == pytest.approx(before["dutch roll"], rel=1e-9)


def test_the_linear_motion_is_that_of_the_true_aircraft(
    folder: Path, answer: CoefficientAnswer
) -> None:
    truth = read_truth(folder / "flight.truth.toml")
    flown, at = truth["flown"], truth["maneuver"][0]
    pressure = at["condition"]["qbar_pa"] * 0.3093671232
    for entry, name, arm, inertia, row in (
        ((2, 1), "Cm_alpha", 0.2530602, flown["iyy_kgm2"], "longitudinal"),
        ((1, 1), "Cl_p", 1.26365**2 / (2 * at["condition"]["airspeed_mps"]), flown["ixx_kgm2"],
         "lateral"),
    ):  # fmt: skip
        expected = pressure * arm * true_coefficients(truth, row)[name] / inertia
        system = answer.systems[row]
        assert abs(system.A[entry] - expected) <= 1.5 * system.A_half[entry]
        # The coefficient carries 5 % of inertia, the motion does not.
        assert system.A_half[entry] < 0.055 * abs(expected)
    assert answer.systems["lateral"].B.shape == (4, 2)


def test_public_conversion_gives_the_same_motion(answer: CoefficientAnswer) -> None:
    flight, frame = answer.fit.condition, airframe_data(NAME)
    for name, row, entry in (
        ("M_alpha", "longitudinal", (2, 1)), ("M_q", "longitudinal", (2, 2)),
        ("L_p", "lateral", (1, 1)), ("N_beta", "lateral", (2, 0)),
    ):  # fmt: skip
        system, faster = answer.systems[row], flight.airspeed_ratio[row == "lateral"]
        at = Condition(flight.airspeed_mps * faster, flight.qbar_pa * faster**2)
        found = to_derivatives(
            quantities(answer.fit), ConversionPoint(frame, at, flight.alpha_rad), {}
        )
        assert found.value(name) == pytest.approx(system.A[entry], rel=1e-4)
        assert 1.96 * found.deviation(name) == pytest.approx(system.A_half[entry], rel=1e-2)


def test_delays_left_over_are_told(folder: Path, answer: CoefficientAnswer) -> None:
    drawn = read_truth(folder / "flight.truth.toml")["drawn"]
    value, half = answer.delays["delay_imu_s"]
    assert abs(value - float(drawn["imu_delay_s"])) <= max(1.5 * half, 3e-4)
    assert half < 1e-3


def test_says_what_to_trust_and_why_not(
    folder: Path,
    found: Identification,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.setattr("host.sysid.pipeline.stages.identify", lambda *_, **__: found)
    again = tmp_path / "again.toml"
    flags = ["--aircraft", NAME, "--model", "coefficients"]
    source = str(folder / "flight.csv")
    more = ["--plots", str(tmp_path / "plots"), "--save-aircraft", str(again)]
    more += ["--save-model", str(tmp_path / "x.toml")]
    truth = ["--truth", str(folder / "flight.truth.toml"), "--mat", str(tmp_path / "x.mat")]
    assert main(["identify", source, *flags, *more, *truth, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)["answers"][0]
    table = document["coefficients"]
    assert table["Cn_p"]["flagged"]
    assert "tilt" in table["Cn_p"]["widened_by"]
    assert not table["Cm_q"]["flagged"]
    assert any("not known: Cn_p" in line for line in document["verdict"])
    assert len(document["unseen"]["windows"]) == 9
    unseen = document["unseen"]["nrmse"]
    assert set(unseen) == {"CL", "CD", "Cm", "CY", "Cl", "Cn"}
    assert all(s["fitted"] < s["unseen"] < 1.1 * s["fitted"] for s in unseen.values())
    scattered = {n: r for n, r in document["repeats"].items() if r["widened_by"] > 1.0}
    assert all(r["p_value"] < 0.01 for r in scattered.values())
    named = [line for line in document["verdict"] if "maneuvers disagree on" in line]
    assert len(named) == len(scattered)
    text = str(found)
    assert text.startswith("Known from this flight: ")
    assert "of 24 intervals" in text
    assert {p.name for p in (tmp_path / "plots").iterdir()} == {
        f"coefficients_{k}.svg" for k in ("fit", "poles", "intervals", "input")
    }
    content = io.loadmat(tmp_path / "x.mat", squeeze_me=True)
    assert content["coefficients_lateral"]["B"].item().shape == (4, 2)
    assert (tmp_path / "x.toml").read_text() == again.read_text()
    with again.open("rb") as file:
        saved = tomllib.load(file)["aerodynamics"]
    assert saved["cm_q"][0] == pytest.approx(table["Cm_q"]["value"], rel=1e-6)


def test_without_an_aircraft_there_is_one_clear_line(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", str(folder / "flight.csv"), "--model", "coefficients"]) == 2
    assert "--aircraft" in capsys.readouterr().err


def test_aileron_and_rudder_flown_together_are_one_window() -> None:
    def item(axis: str, first: float, last: float) -> DetectedManeuver:
        return DetectedManeuver(axis, "multisine", first, last - 3.0, last, 0.1, 9)

    windows = merged_windows(
        [
            item("aileron_rad", 10.0, 33.0),
            item("rudder_rad", 10.4, 32.0),
            item("elevator_rad", 40.0, 63.0),
            item("rudder_rad", 70.0, 80.0),
        ]
    )
    assert [(w.first_s, w.last_s, w.longitudinal) for w in windows] == [
        (39.5, 63.0, True),
        (9.5, 33.0, False),
        (69.5, 80.0, False),
    ]


def test_bars_that_are_marked_are_red(tmp_path: Path) -> None:
    path = tmp_path / "bars.svg"
    known = [Bar("Y_v", -0.9, 0.1, 0.9, marked=False), Bar("Y_p", 0.1, 0.09, 0.1, marked=False)]
    assert RED not in save(interval_bars(known, "refused"), path).read_text()
    marked = Bar("Z_q", 1.0, 0.1, 1.0, marked=True)
    assert RED in save(interval_bars([*known, marked], "refused"), path).read_text()


def test_the_truth_of_a_simulated_flight_is_a_diamond(tmp_path: Path) -> None:
    def words(bar: Bar) -> str:
        return save(interval_bars([bar], "flagged"), tmp_path / "bars.svg").read_text()

    plain = words(Bar("Cm_q", -11.0, 1.4, 11.0, marked=False))
    assert "simulated" not in plain
    assert words(Bar("Cm_q", -11.0, 1.4, 11.0, marked=False, truth=-10.8)).count("<use") > (
        plain.count("<use")
    )
