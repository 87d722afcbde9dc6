"""Trust is earned: every case here stood under "trust" or "use with care" before the rule was."""

from dataclasses import replace

import numpy as np
import pytest
from host.sysid.answer import CAREFUL, TRUSTED, answer_document
from host.sysid.answer.doubt import Evidence
from host.sysid.answer.linear_rules import driven_by_inputs
from host.sysid.answer.servo_lines import servo_document
from host.sysid.checks import Finding
from host.sysid.estimators.servo_parameters import SERVO, ServoEstimate, ServoNumber
from host.sysid.linear import Answer
from host.sysid.models import Trim, template
from host.sysid.validation import Prediction
from studies.wrong_flights import LinearFlight, fly

from tests.host.sysid.at_hand import identify
from tests.host.sysid.verdicts import NO_EVIDENCE, verdict_lines, verdict_of

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
    return fly("short-period", "none", "white", 1)


@pytest.fixture(scope="module")
def right(flight: LinearFlight) -> Answer:
    return answer_to(flight)


@pytest.fixture(scope="module")
def by_white(flight: LinearFlight) -> Answer:
    return answer_to(flight, method="output-error-white")


def test_a_right_model_is_trusted(right: Answer, by_white: Answer) -> None:
    evidence = Evidence((right, by_white))
    for answer in (right, by_white):
        marks = verdict_of(answer, evidence).marks
        assert {"Z_alpha", "M_alpha", "M_q", "M_de"} <= {
            n for n, mark in marks.items() if mark == TRUSTED
        }


def test_a_fit_that_fails_in_an_output_is_not_relied_on_there(right: Answer) -> None:
    [alpha, q, az] = right.fits
    failing = replace(q, nrmse=2.71, ljung_box_p=0.9)
    answer = replace(right, fits=(alpha, failing, az))
    assert relied_on(right) - relied_on(answer) == {"Z_q", "M_alpha", "M_q", "M_de"}
    assert reason(answer, "M_alpha") == "the fit fails in q_radps (NRMSE 271 %)"


def test_noise_of_a_sensor_is_no_failure_of_the_fit(right: Answer) -> None:
    """Six tenths of an output may be white noise; a residual with a memory is the model's."""
    alpha = right.fits[0]
    noisy = replace(right, fits=(replace(alpha, nrmse=0.6, ljung_box_p=0.4),))
    missed = replace(right, fits=(replace(alpha, nrmse=0.6, ljung_box_p=1e-9),))
    assert relied_on(noisy) == relied_on(right)
    assert not relied_on(missed) & {"Z_alpha", "M_alpha"}


def test_what_gusts_among_the_states_make_is_no_failure(right: Answer) -> None:
    """Airspeed in gusts: a free simulation misses it by more than half, as its own air says."""
    alpha = replace(right.fits[0], nrmse=0.8, ljung_box_p=1e-9)
    missed = replace(right, fits=(alpha,), validation=(alpha,))
    for allowed, relied in (
        (Prediction(0.8, 1.1, by_gusts=True), True),
        (Prediction(0.8, 0.7, by_gusts=True), False),
        (Prediction(0.8, 1.1), False),
    ):
        judged = replace(missed, predictions={alpha.name: allowed}, explained={})
        assert not relied_on(judged) & {"M_alpha"}  # the maneuvers fitted fail
        judged = replace(judged, explained={alpha.name: allowed})
        assert ("M_alpha" in relied_on(judged)) == relied


def test_an_unseen_maneuver_that_noise_cannot_explain_is_not_predicted(
    flight: LinearFlight,
) -> None:
    """The last maneuver was flown with a weaker elevator: NRMSE is far below one half."""
    last = flight.windows[-1]
    changed = flight.columns["elevator_rad"].copy()
    changed[flight.columns["t_s"] >= last.start_s - 0.5] *= 1.25
    answer = answer_to(replace(flight, columns=flight.columns | {"elevator_rad": changed}))
    [q] = [f for f in answer.validation if f.name == "q_radps"]
    assert q.nrmse < 0.5
    assert not relied_on(answer) & {"M_alpha", "M_q", "M_de"}
    assert reason(answer, "M_de").startswith("q_radps is not predicted (NRMSE ")


def test_what_inputs_drive_beside_the_model_is_no_noise() -> None:
    answer = answer_to(fly("short-period", "hidden lag", "white", 1))
    assert answer.coherence is not None
    assert "q_radps" in answer.coherence.coherent
    assert not relied_on(answer) & {"M_alpha", "M_q", "M_de"}
    assert any("follows the inputs" in w for w in answer.result.warnings)
    # Of an output that is explained to a percent it is little, and widening answers for it.
    little = replace(answer, fits=tuple(replace(f, nrmse=0.01) for f in answer.fits))
    assert not driven_by_inputs(little, NO_EVIDENCE)
    assert driven_by_inputs(answer, NO_EVIDENCE)


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
    right = fly(template_name, "none", "white", 2)
    turned = right.columns | {column: -right.columns[column] for column in impossible}
    answer = answer_to(replace(right, columns=turned), template_name)
    for name in impossible.values():
        assert name not in relied_on(answer)
        assert "its sign is impossible" in " ".join(verdict_of(answer).reasons[name])


@pytest.mark.parametrize("name", ["Z_alpha", "M_de"])
def test_a_sign_counts_however_narrow_the_interval(right: Answer, name: str) -> None:
    estimate = right.result.estimate.copy()
    estimate[right.result.index(name)] *= -1.0
    answer = replace(right, result=replace(right.result, estimate=estimate))
    assert name in relied_on(right)
    assert name not in relied_on(answer)
    own = replace(answer, own_model=True)  # of which only the bounds speak
    assert name in relied_on(own)


def test_methods_that_differ_by_a_factor_of_two_are_not_trusted(
    right: Answer, by_white: Answer
) -> None:
    estimate = by_white.result.estimate.copy()
    k = by_white.result.index("M_q")
    estimate[k] *= 2.0
    other = replace(by_white, result=replace(by_white.result, estimate=estimate))
    evidence = Evidence((right, other))
    for answer in (right, other):
        assert "M_q" in relied_on(answer)
        assert relied_on(answer) - relied_on(answer, evidence) == {"M_q"}
        assert "methods disagree" in reason(answer, "M_q", evidence)


def test_two_fits_to_the_same_noise_may_differ_by_less_than_two_flights(
    right: Answer, by_white: Answer
) -> None:
    """Half of the joint interval of independent fits is too much for fits to the same data."""
    k, j = right.result.index("M_q"), by_white.result.index("M_q")
    joint = np.hypot(right.result.half_width()[k], by_white.result.half_width()[j])
    estimate = by_white.result.estimate.copy()
    estimate[j] = right.result.estimate[k] + 0.9 * joint
    other = replace(by_white, result=replace(by_white.result, estimate=estimate))
    assert "M_q" not in relied_on(right, Evidence((right, other)))


def test_a_method_that_is_not_valid_in_this_noise_does_not_speak_against_one_that_is(
    flight: LinearFlight, right: Answer
) -> None:
    biased = answer_to(flight, method="equation-error")
    evidence = Evidence((right, biased))
    assert relied_on(right, evidence) == relied_on(right)
    k = biased.result.index("M_alpha")
    estimate = biased.result.estimate.copy()
    estimate[k] *= 0.5
    wrong = replace(biased, result=replace(biased.result, estimate=estimate))
    assert relied_on(right, Evidence((right, wrong))) == relied_on(right)
    assert "M_alpha" not in relied_on(wrong, Evidence((right, wrong)))


@pytest.mark.parametrize(
    ("channel", "lost"),
    [
        ("elevator_rad", {"Z_de", "M_de"}),
        ("q_radps", {"Z_q", "M_alpha", "M_q", "M_de"}),
        ("az_mps2", {"Z_alpha", "Z_q", "Z_de"}),
    ],
)
def test_a_channel_with_an_open_finding_is_not_relied_on(
    channel: str, lost: set[str], right: Answer
) -> None:
    found = Finding("angle-size", (channel,), "it moves twice as fast", done="scale estimated")
    evidence = Evidence((right,), (found,))
    assert relied_on(right) - relied_on(right, evidence) == relied_on(right) & lost
    assert relied_on(right, Evidence((right,), (found.accept(),))) == relied_on(right, evidence)
    closed = replace(found, closed=True)
    assert relied_on(right, Evidence((right,), (closed,))) == relied_on(right)
    words = f"{channel} has an open finding (angle-size)"
    assert any(line.endswith(words) for line in verdict_lines([right], [], evidence))


def test_an_airspeed_in_doubt_takes_the_forces_over_it() -> None:
    """It is no state of the model: nothing was taken, and half of Y_beta stood under "trust"."""
    answer = answer_to(fly("lateral", "none", "white", 1), "lateral")
    evidence = Evidence((answer,), (Finding("beta-against-ay", ("airspeed_mps",), "in kt?"),))
    lost = relied_on(answer) - relied_on(answer, evidence)
    assert lost
    assert {name[0] for name in lost} == {"Y"}


def test_every_reason_is_in_the_words_and_in_the_document(right: Answer) -> None:
    found = Finding("surface-sign", ("elevator_rad",), "the elevator works backwards")
    evidence = Evidence((right,), (found,))
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


def test_what_commands_do_is_not_told_from_a_lag_that_nothing_tells(right: Answer) -> None:
    """Thor's whole flight: a delay of -59 +- 72 ms, and no word about M_q."""
    answer = commanded(right, informed=False)
    pitch = {"M_alpha", "M_q", "M_de"}
    assert relied_on(right) - relied_on(answer) == pitch
    assert reason(answer, "M_q").startswith("the lag behind the commands is not known (the data")
    said = verdict_of(answer).lines
    [line] = [x for x in said if "the servos' lag and" in x]
    assert "the servos' lag and M_alpha, M_q, M_de are not separable" in line
    document = servo_document(answer)
    assert document is not None
    assert document["not_told_apart"] == ["M_alpha", "M_q", "M_de"]
    assert document["unknown_lag"] == "the data do not tell it"
    for known in (
        commanded(right, informed=True),
        commanded(right, informed=False, prior_half_width=0.006),
    ):
        assert relied_on(known) == relied_on(right)


@pytest.mark.parametrize(("vague_one", "other"), [("M_de", "M_q"), ("M_q", "M_de")])
def test_a_command_without_an_effect_and_a_rate_without_damping_tell_no_lag(
    right: Answer, vague_one: str, other: str
) -> None:
    """Thor's pitch under its autopilot: a delay of -7 +- 9 ms and M_q of -11 +- 18, no word."""
    covariance = right.result.covariance.copy()
    k = right.result.index(vague_one)
    covariance[k, k] = right.result.estimate[k] ** 2
    vague = replace(right, result=replace(right.result, covariance=covariance))
    answer = commanded(vague, informed=True)
    assert other in relied_on(vague) - relied_on(answer)
    assert f"{vague_one} may be zero" in reason(answer, other)
