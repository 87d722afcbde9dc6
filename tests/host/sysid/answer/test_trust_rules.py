"""The mark follows from the interval, and what overrules it is a short list."""

from dataclasses import replace

import numpy as np
import pytest
from host.sysid.answer import CAREFUL, TRUSTED, answer_document
from host.sysid.answer.doubt import Evidence
from host.sysid.answer.servo_lines import servo_document
from host.sysid.checks import Finding
from host.sysid.estimators.servo_parameters import SERVO, ServoEstimate, ServoNumber
from host.sysid.linear import Answer
from host.sysid.models import Trim, template
from studies.wrong_flights import LinearFlight

from tests.host.sysid.at_hand import identify
from tests.host.sysid.recorded import linear_flight
from tests.host.sysid.verdicts import verdict_lines, verdict_of

RELIED_ON = (TRUSTED, CAREFUL)
METHOD = "output-error"


def answer_to(flight: LinearFlight, name: str = "short-period", method: str = METHOD) -> Answer:
    [answer] = identify(
        flight.columns,
        names=(name,),
        method=method,
        windows=flight.windows,
        user_model=flight.model,
    )
    return answer


def relied_on(answer: Answer, evidence: Evidence | None = None) -> set[str]:
    marks = verdict_of(answer, evidence or Evidence()).marks
    return {name for name, mark in marks.items() if mark in RELIED_ON}


def reason(answer: Answer, name: str, evidence: Evidence | None = None) -> str:
    return verdict_of(answer, evidence or Evidence()).reasons[name][-1]


@pytest.fixture(scope="module")
def flight() -> LinearFlight:
    return linear_flight("short-period", "none", "white", 1)


@pytest.fixture(scope="module")
def right(flight: LinearFlight) -> Answer:
    return answer_to(flight)


@pytest.fixture(scope="module")
def by_white(flight: LinearFlight) -> Answer:
    return answer_to(flight, method="output-error-white")


def test_a_right_model_is_trusted(right: Answer, by_white: Answer) -> None:
    for answer in (right, by_white):
        marks = verdict_of(answer).marks
        assert {"Z_alpha", "M_alpha", "M_q", "M_de"} <= {
            n for n, mark in marks.items() if mark == TRUSTED
        }


def test_what_is_not_predicted_is_evidence_and_no_veto(right: Answer) -> None:
    [alpha, q, az] = right.fits
    failing = replace(q, nrmse=2.71, ljung_box_p=1e-9)
    answer = replace(right, fits=(alpha, failing, az), validation=(alpha, failing, az))
    assert relied_on(answer) == relied_on(right)
    assert "  the unseen maneuver is not predicted in q_radps" in verdict_of(answer).lines


def test_what_inputs_drive_beside_the_model_is_in_the_interval() -> None:
    """A lag that no column shows moves M_q by 14 of the intervals that noise alone gives."""
    flight = linear_flight("short-period", "hidden lag", "white", 1)
    answer = answer_to(flight)
    assert answer.coherence is not None
    assert "q_radps" in answer.coherence.coherent
    assert any("follows the inputs" in w for w in answer.result.warnings)
    assert not {n for n, m in verdict_of(answer).marks.items() if m == TRUSTED} & {"M_q", "M_de"}


def test_an_estimate_on_its_bound_is_not_relied_on(flight: LinearFlight) -> None:
    model = template("short-period", Trim(17.0, 0.06, 0.06))
    bounded = tuple(
        replace(p, lower=-100.0, upper=0.0) if p.name == "M_alpha" else p for p in model.parameters
    )
    own = replace(model, name="bounded", parameters=bounded)
    answer = answer_to(replace(flight, model=own))
    assert answer.result.value("M_alpha") == pytest.approx(-100.0)
    assert "M_alpha" not in relied_on(answer)
    assert "on its bound" in reason(answer, "M_alpha")


@pytest.mark.parametrize(
    ("template_name", "impossible"),
    [
        ("short-period", {"elevator_rad": "M_de"}),
        ("lateral", {"rudder_rad": "N_dr", "aileron_rad": "L_da"}),
    ],
)
def test_an_impossible_sign_is_not_relied_on(
    template_name: str, impossible: dict[str, str]
) -> None:
    right = linear_flight(template_name, "none", "white", 2)
    turned = right.columns | {column: -right.columns[column] for column in impossible}
    answer = answer_to(replace(right, columns=turned), template_name)
    for name in impossible.values():
        assert name not in relied_on(answer)
        assert "its sign is impossible" in " ".join(verdict_of(answer).reasons[name])


@pytest.mark.parametrize(("name", "beside"), [("M_de", "M_q"), ("M_de", "M_alpha")])
def test_a_sign_counts_however_narrow_the_interval(right: Answer, name: str, beside: str) -> None:
    """It takes its row along: what is wrong of one is not right of its neighbours."""
    estimate = right.result.estimate.copy()
    estimate[right.result.index(name)] *= -1.0
    answer = replace(right, result=replace(right.result, estimate=estimate))
    assert {name, beside} <= relied_on(right)
    assert not {name, beside} & relied_on(answer)
    assert reason(answer, beside).startswith(f"{name} linked to it: its sign is impossible")
    own = replace(answer, own_model=True)  # of which only the bounds speak
    assert name in relied_on(own)


def test_an_airspeed_in_doubt_takes_the_forces_over_it() -> None:
    """It is no state of the model: nothing was taken, and half of Y_beta stood under "trust"."""
    answer = answer_to(linear_flight("lateral", "none", "white", 1), "lateral")
    evidence = Evidence((Finding("beta-against-ay", ("airspeed_mps",), "in kt?"),))
    lost = relied_on(answer) - relied_on(answer, evidence)
    assert lost
    assert {name[0] for name in lost} == {"Y"}


def test_every_reason_is_in_the_words_and_in_the_document(right: Answer) -> None:
    found = Finding("surface-sign", ("elevator_rad",), "the elevator works backwards")
    evidence = Evidence((found,))
    lines = verdict_lines([right], [], evidence)
    marks = answer_document(right, lines, verdict_of(right, evidence))["marks"]
    assert set(marks) == set(verdict_of(right).marks)
    assert all(entry["reasons"] for entry in marks.values())
    reason = marks["M_de"]["reasons"][-1]
    assert marks["M_de"]["mark"] == "do not rely on"
    assert any(line.endswith(reason) and "M_de" in line for line in lines)


def commanded(answer: Answer, *, informed: bool, prior_half_width: float = 0.1) -> Answer:
    """The same answer, its elevator only commanded."""
    delay = ServoNumber(SERVO[0], -0.02, 0.06, prior_half_width, data_informed=informed)
    rest = [ServoNumber(n, 5.0, 1.0, 1.0, data_informed=False) for n in SERVO[1:]]
    names = answer.model.parameter_names
    none = np.zeros((len(names), len(names)))
    servo = ServoEstimate(("elevator_rad",), (delay, *rest), names, none, dict.fromkeys(names, 0.1))
    return replace(answer, servo=servo)


def test_a_lag_that_nothing_tells_is_said(right: Answer) -> None:
    """Thor's whole flight: a delay of -59 +- 72 ms, and no word about M_q."""
    answer = commanded(right, informed=False)
    said = verdict_of(answer).lines
    [line] = [x for x in said if "the servos' lag and" in x]
    assert "the servos' lag and M_alpha, M_q, M_de are not separable" in line
    document = servo_document(answer)
    assert document is not None
    assert document["not_told_apart"] == ["M_alpha", "M_q", "M_de"]
    assert document["unknown_lag"] == "the data do not tell it"
    known = commanded(right, informed=True)
    assert not [x for x in verdict_of(known).lines if "the servos' lag and" in x]


@pytest.mark.parametrize("vague_one", ["M_de", "M_q"])
def test_a_command_without_an_effect_and_a_rate_without_damping_tell_no_lag(
    right: Answer, vague_one: str
) -> None:
    """Thor's pitch under its autopilot: a delay of -7 +- 9 ms and M_q of -11 +- 18, no word."""
    covariance = right.result.covariance.copy()
    k = right.result.index(vague_one)
    covariance[k, k] = right.result.estimate[k] ** 2
    vague = replace(right, result=replace(right.result, covariance=covariance))
    document = servo_document(commanded(vague, informed=True))
    assert document is not None
    assert document["unknown_lag"] == f"{vague_one} may be zero"
