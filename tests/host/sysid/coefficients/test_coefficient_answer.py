"""Coefficients straight from flight by `host identify`: words, numbers, pictures, files."""

import json
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from host.aircraft.mass_properties import Condition, airframe_data
from host.cli import main
from host.export.pictures import save
from host.sysid.answer import read_truth, true_coefficients
from host.sysid.answer.figure_kinds import Bar, interval_bars
from host.sysid.coefficients import CoefficientAnswer
from host.sysid.coefficients.coefficient_estimator import merged_windows
from host.sysid.coefficients.coefficient_modes import quantities
from host.sysid.conversion import ConversionPoint, to_derivatives
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.pipeline import Identification, identify
from scipy import io

NAME = "ultrastick25e"
RED = "#d62728"


@pytest.fixture(scope="module")
def folder(simulated: Callable[[str, int], Path]) -> Path:
    """A flight of the survey card, every tolerance drawn, without the recorder."""
    return simulated("survey", 31)


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
