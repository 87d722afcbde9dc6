"""A surface that a law moves is found and named; one that a pilot moves never is."""

import json
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.sysid.answer import CAREFUL, TRUSTED
from host.sysid.answer.coefficient_view import CoefficientView
from host.sysid.answer.doubt import Evidence
from host.sysid.answer.feedback_pairs import alike_derivatives, combined_derivatives
from host.sysid.answer.trust_rules import input_feedback
from host.sysid.checks import Feedback, Finding
from host.sysid.checks.feedback_findings import feedback_findings
from host.sysid.coefficients import CoefficientAnswer
from host.sysid.flight import read_flight_columns
from host.sysid.linear import Answer
from host.sysid.maneuvers import detect_maneuvers, select_maneuvers
from host.sysid.models import Term

from tests.host.logs import ROOT
from tests.host.sysid.at_hand import identify
from tests.host.sysid.closed_loop import DT_S, Law, doublets, flown
from tests.host.sysid.recorded import linear_flight
from tests.host.sysid.verdicts import verdict_of

SAMPLES = 1600
STARTS = (100, 400, 700, 1000, 1300)
DAMPER = Law("rudder_rad", {"r_radps": 0.4})
Columns = dict[str, np.ndarray]


def lateral(law: Law | None, seed: int = 1, side_s: float = 0.3) -> Columns:
    inputs = {"aileron_rad": doublets(SAMPLES, STARTS, side_s, 0.07)}
    if law is None:
        inputs["rudder_rad"] = doublets(SAMPLES, tuple(s + 150 for s in STARTS[:3]), side_s, 0.10)
    return flown("lateral", inputs, law, seed)


def found_in(columns: Columns) -> list[Finding]:
    whole = float(columns["t_s"][0]), float(columns["t_s"][-1])
    return feedback_findings(columns, select_maneuvers(columns, stretches=[whole]))


def test_a_yaw_damper_is_named_with_its_delay_and_gain() -> None:
    [found] = found_in(lateral(DAMPER))
    assert found.check == "feedback"
    assert found.channels == ()
    said, late, r2 = found.text.partition(" ms, R2 ")[0], found.text, found.text.split("R2 ")[1]
    assert said.startswith("rudder_rad follows r_radps at ")
    assert int(said.split()[-1]) == pytest.approx(40, abs=10)
    assert late.endswith(": N_dr and N_r are not separable")
    assert float(r2[:4]) > 0.95
    assert found.feedback is not None
    assert found.feedback.gains[0] == pytest.approx(0.4, abs=0.02)
    assert found.done.startswith("only N_r + 0.")


@pytest.mark.parametrize("seed", [1, 2])
def test_wash_out_and_lag_are_named_too(seed: int) -> None:
    [washed] = found_in(lateral(replace(DAMPER, washout_s=1.0), seed))
    assert "through a wash-out of " in washed.text
    time_s = float(washed.text.split("wash-out of ")[1].split()[0])
    assert time_s == pytest.approx(1.0, rel=0.2)
    [lagged] = found_in(lateral(replace(DAMPER, lag_s=0.1), seed))
    assert float(lagged.text.split("a lag of ")[1].split()[0]) == pytest.approx(0.1, rel=0.2)
    [both] = found_in(lateral(replace(DAMPER, lag_s=0.1, washout_s=2.0), seed))
    assert float(both.text.split("a lag of ")[1].split()[0]) == pytest.approx(0.1, rel=0.2)
    assert "a wash-out of " in both.text
    assert both.feedback is not None
    assert both.feedback.filtered
    assert both.done.startswith("only what they do together is known")


def test_two_signals_are_named() -> None:
    [found] = found_in(lateral(replace(DAMPER, gains={"r_radps": 0.3, "p_radps": 0.06})))
    assert found.feedback is not None
    assert set(found.feedback.signals) == {"r_radps", "p_radps"}
    assert "N_dr, N_r and N_p are not separable" in found.text


def sines(highest_hz: float, rng: np.random.Generator) -> np.ndarray:
    hz = np.arange(0.1, highest_hz, 0.1)
    phase = rng.uniform(0.0, 2.0 * np.pi, len(hz))
    waves = np.sin(2.0 * np.pi * hz * DT_S * np.arange(SAMPLES)[:, None] + phase)
    return np.asarray(0.05 * waves.sum(axis=1) / np.sqrt(len(hz)))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(
    "law",
    [
        Law("rudder_rad", {"r_radps": 0.4, "p_radps": 0.09}, 0.06, washout_s=3.0),
        Law("rudder_rad", {"r_radps": 0.56}, 0.08, 0.25, 0.4),
    ],
)
def test_a_filter_between_those_that_are_tried_names_no_signal_too_many(
    law: Law, seed: int
) -> None:
    """What a filter next to the true one left, side-slip explained."""
    inputs = {"aileron_rad": sines(3.0, np.random.default_rng(seed))}
    [found] = found_in(flown("lateral", inputs, law, seed))
    assert found.feedback is not None
    assert set(found.feedback.signals) == set(law.gains)


def test_a_bank_loop_takes_nothing() -> None:
    """Bank turns gravity only, so what follows it tells derivatives as a pilot's input does."""
    steps = np.repeat(np.random.default_rng(17718).uniform(-0.2, 0.2, 8), SAMPLES // 8)
    inputs = {
        "aileron_rad": steps,
        "rudder_rad": doublets(SAMPLES, tuple(s + 50 for s in STARTS), 0.3, 0.1),
    }
    law = Law("aileron_rad", {"phi_rad": -0.5, "p_radps": -0.06})
    assert found_in(flown("lateral", inputs, law, 17718)) == []


def noisier(columns: Columns, seed: int, rate_dps: float, *names: str) -> Columns:
    """Return columns whose gyros have noise that the law, with gyros of its own, has not."""
    rng = np.random.default_rng(seed)
    noise = {n: np.radians(rate_dps) * rng.standard_normal(len(columns[n])) for n in names}
    return columns | {n: columns[n] + added for n, added in noise.items()}


@pytest.mark.parametrize("seed", [3, 4])
def test_a_damper_is_named_where_gyros_are_as_noisy_as_the_aircraft_turns(seed: int) -> None:
    """It was silent: the noise of the gyro, which is no input, was half of what the law left."""
    quiet = lateral(DAMPER, seed)
    [found] = found_in(
        noisier(quiet, seed, 57.3 * float(np.std(quiet["r_radps"])) / 1.5, "r_radps")
    )
    assert int(found.text.split(" ms")[0].split()[-1]) == pytest.approx(40, abs=15)
    assert found.feedback is not None
    assert found.feedback.signals == ("r_radps",)
    assert found.feedback.gains[0] == pytest.approx(0.4, abs=0.04)  # noise made it smaller


def test_noise_of_gyros_makes_no_law_of_a_pilots_inputs() -> None:
    for seed in (3, 4, 5, 6):
        columns = noisier(lateral(None, seed), seed, 1.0, "p_radps", "r_radps")
        assert found_in(columns) == []


@pytest.mark.parametrize("side_s", [0.3, 0.8])
@pytest.mark.parametrize("seed", [3, 4])
def test_doublets_of_a_pilot_are_no_feedback(seed: int, side_s: float) -> None:
    assert found_in(lateral(None, seed, side_s)) == []


@pytest.mark.parametrize("highest_hz", [0.3, 0.5, 1.0, 3.0])
def test_slow_inputs_that_the_aircraft_follows_are_no_feedback(highest_hz: float) -> None:
    """Below the short period q and p follow the stick, and smooth inputs are known beforehand."""
    rng = np.random.default_rng(5)
    alone = {"elevator_rad": sines(highest_hz, rng)}
    assert found_in(flown("short-period", alone, None, 5)) == []
    both = {"aileron_rad": sines(highest_hz, rng), "rudder_rad": sines(highest_hz, rng)}
    assert found_in(flown("lateral", both, None, 5)) == []


def test_a_surface_that_rests_follows_nothing() -> None:
    columns = lateral(DAMPER)
    still = columns | {"rudder_rad": 1e-3 * columns["rudder_rad"], "aileron_rad": np.zeros(SAMPLES)}
    assert found_in(still) == []


def test_the_laws_of_a_real_aircraft() -> None:
    """Its rudder is 0.066 r behind a wash-out of 0.5 s, to four digits.

    Its ailerons and elevator hold attitudes, on which no force depends.
    """
    folder = ROOT / "tests/data/thor75"
    read = read_flight_columns(folder / "flight75_240_270.csv", folder / "map.toml")
    [found] = found_in(read.columns)
    assert found.text == (
        "rudder_rad follows r_radps at 0 ms through a wash-out of 0.5 s, R2 1.00: N_dr and N_r"
        " are not separable"
    )
    assert found.feedback is not None
    assert found.feedback.signals == ("r_radps",)
    assert found.feedback.gains[0] == pytest.approx(0.066, abs=0.001)


def test_a_damper_engaged_after_the_rest_before_an_input_is_named() -> None:
    """In the rest the rudder stands still and the aircraft turns: no law explains both."""
    rest = 300
    columns = {n: np.concatenate([np.zeros(rest), v]) for n, v in lateral(DAMPER).items()}
    time = np.arange(rest) * DT_S
    columns |= {
        "t_s": np.arange(rest + SAMPLES) * DT_S,
        "r_radps": columns["r_radps"] + np.pad(0.2 * np.sin(2.0 * time), (0, SAMPLES)),
    }
    [first, *others] = detect_maneuvers(columns)
    rested = replace(first, lead_s=first.start_s)
    [found] = feedback_findings(columns, [rested, *others])
    assert found.text.startswith("rudder_rad follows r_radps at ")


@pytest.fixture(scope="module")
def answer() -> Answer:
    """Rudder and ailerons by a pilot: what a law would take away is all there."""
    flight = linear_flight("lateral", "none", "white", 1)
    [answer] = identify(
        flight.columns, names=("lateral",), method="output-error-white", windows=flight.windows
    )
    return answer


def test_the_pair_is_not_relied_on_and_the_rest_is(answer: Answer) -> None:
    law = Feedback("rudder_rad", ("r_radps",), (0.4,))
    marks, doubted = (
        verdict_of(answer, Evidence(findings=found)).marks
        for found in ((), (Finding("feedback", (), "", feedback=law),))
    )
    changed = {name for name in marks if marks[name] != doubted[name]}
    assert {"N_r", "N_dr"} <= changed <= {"Y_r", "Y_dr", "L_r", "L_dr", "N_r", "N_dr"}
    assert {"L_p", "L_da", "N_beta"} <= {n for n, m in doubted.items() if m in (TRUSTED, CAREFUL)}


def test_an_attitude_that_no_force_depends_on_takes_nothing(answer: Answer) -> None:
    """Bank turns gravity only, and heading is no state: of both the gain is known."""
    for signal in ("phi_rad", "psi_rad"):
        assert not alike_derivatives(answer.model, Feedback("aileron_rad", (signal,), (-0.5,)))


def test_all_parameters_at_one_place_are_alike(answer: Answer) -> None:
    """A user's Cl_r acts on the yaw rate too where axes are no principal ones."""
    yaw = answer.model.states.index("r_radps")
    shared = Term("A", yaw, yaw, "L_r", 0.1)
    law = Feedback("rudder_rad", ("r_radps",), (0.4,))
    for terms in ((shared, *answer.model.terms), (*answer.model.terms, shared)):
        model = replace(answer.model, terms=terms)
        assert set(alike_derivatives(model, law)[-1]) == {"N_dr", "N_r", "L_r"}
        told = combined_derivatives(
            replace(answer, model=model), [Finding("feedback", (), "", feedback=law)]
        )
        assert "N_dr" not in " ".join(told)


def test_what_the_pair_does_together_is_told(answer: Answer) -> None:
    law = Feedback("rudder_rad", ("r_radps",), (0.4,))
    [line] = combined_derivatives(answer, [Finding("feedback", (), "", feedback=law)])
    [part] = [x for x in line.split(": ")[1].split(", ") if x.startswith("N_r + 0.4 N_dr = ")]
    value, half = (float(x) for x in part.split(" = ")[1].split(" +- "))
    assert value == pytest.approx(-2.2 - 0.4 * 28.0, abs=1.5 * half)
    assert half < 0.1 * abs(value)
    filtered = replace(law, filtered=True)
    assert combined_derivatives(answer, [Finding("feedback", (), "", feedback=filtered)]) == []


def test_it_is_in_json_and_exits_0(tmp_path: object, capsys: pytest.CaptureFixture[str]) -> None:
    path = f"{tmp_path}/x.csv"
    pd.DataFrame(lateral(DAMPER)).to_csv(path, index=False)
    how = ["--model", "dutch-roll", "--method", "equation-error", "--from", "0", "--to", "31"]
    assert main(["identify", path, *how, "--accept", "feedback", "--json"]) == 0
    [found] = [f for f in json.loads(capsys.readouterr().out)["findings"] if f["feedback"]]
    assert found["accepted"]
    assert found["feedback"]["surface"] == "rudder_rad"
    assert found["feedback"]["signals"] == ["r_radps"]


def test_coefficients_of_the_pair_are_doubted_in_equations_that_have_both() -> None:
    names = ["CY_beta", "CY_dr", "Cl_p", "Cl_r", "Cl_dr", "Cn_beta", "Cn_r", "Cn_dr", "Cn_da"]
    fitted = SimpleNamespace(derivatives=[SimpleNamespace(name=n) for n in names])
    law = Feedback("rudder_rad", ("r_radps",), (0.4,))
    view = CoefficientView(cast(CoefficientAnswer, SimpleNamespace(fit=fitted)))
    found = Finding("feedback", (), "", feedback=law)
    [doubt] = input_feedback(view, Evidence(findings=(found,)))
    assert doubt.names == ("Cl_r", "Cl_dr", "Cn_r", "Cn_dr")
