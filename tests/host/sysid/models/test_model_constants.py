"""Constants and noise that a model file states: known, shared by all records, or their own."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from host.errors import IdentificationError
from host.sysid import Maneuver, fit
from host.sysid.models import model_from, read_model
from host.sysid.models.model_text import model_text
from host.sysid.models.parameter_units import parameter_unit
from host.sysid.numerics import OutputProblem
from host.sysid.validation.free_simulation import frozen_at

from tests.host.sysid.held import assert_held

BASE: dict[str, Any] = {
    "name": "short-period",
    "states": ["alpha_rad", "q_radps"],
    "inputs": ["elevator_rad"],
    "outputs": ["alpha_rad", "q_radps", "az_mps2"],
    "delays": [],
    "A": [["Z_alpha", 1.0], ["M_alpha", "M_q"]],
    "B": [["Z_de"], ["M_de"]],
    "C": [[1, 0], [0, 1], ["17.0*Z_alpha", 0]],
    "D": [[0], [0], ["17.0*Z_de"]],
    "parameters": {
        "Z_alpha": {"start": -4.0}, "M_alpha": {"start": -60.0}, "M_q": {"start": -6.0},
        "Z_de": {"start": 0.0}, "M_de": {"start": -70.0},
    },
}  # fmt: skip
TRUTH = {"Z_alpha": -6.0, "M_alpha": -80.0, "M_q": -9.0, "Z_de": -0.9, "M_de": -90.0}
NOISE = (0.002, 0.004, 0.08)
DT_S = 0.02
START, RATE_BIAS, OUTPUT_BIAS = (0.05, 0.0), (0.4, 2.0), -0.7


def model(**keys: Any) -> Any:
    return model_from({**BASE, **keys})


def records(count: int, seed: int) -> list[Maneuver]:
    """Return records of the truth: start not zero, the same biases in all, white noise."""
    known = model(
        initial_states=dict(zip(BASE["states"], START, strict=True)),
        state_biases=dict(zip(BASE["states"], RATE_BIAS, strict=True)),
        output_biases={"az_mps2": OUTPUT_BIAS},
    )
    frozen = frozen_at(known, np.array([TRUTH[p.name] for p in known.parameters]))
    rng = np.random.default_rng(seed)
    found = []
    for k in range(count):
        t = DT_S * np.arange(200)
        u = np.column_stack([0.05 * np.sign(np.sin(2.0 * np.pi * (1.0 + 0.2 * k) * t)), t**0])
        outputs = OutputProblem(frozen, [Maneuver(DT_S, u, np.zeros((200, 3)))]).outputs(
            np.zeros(0)
        )
        assert outputs is not None
        found.append(
            Maneuver(DT_S, u, outputs[0].T + rng.standard_normal((200, 3)) * NOISE, name=f"r{k}")
        )
    return found


def without_constant(data: list[Maneuver]) -> list[Maneuver]:
    return [Maneuver(m.dt_s, m.inputs[:, :1], m.outputs, name=m.name) for m in data]


KNOWN: dict[str, Any] = {
    "initial_states": {"alpha_rad": 0.05, "q_radps": 0.0},
    "state_biases": {"alpha_rad": 0.4, "q_radps": 2.0},
    "output_biases": {"az_mps2": -0.7},
}
SHARED: dict[str, Any] = {
    "initial_states": {"alpha_rad": "alpha_0", "q_radps": 0.0},
    "state_biases": {"alpha_rad": "b_alpha", "q_radps": "b_q"},
    "output_biases": {"az_mps2": "b_az"},
}


@pytest.mark.parametrize("method", ["output-error", "output-error-white", "filter-error"])
def test_known_constants_are_held(method: str) -> None:
    result = fit(method, model(**KNOWN), records(2, 1))
    assert not any("@" in name for name in result.names)
    assert_held(result, TRUTH, times=1.5)


@pytest.mark.parametrize("method", ["output-error-white", "filter-error"])
def test_shared_constants_are_one_parameter_of_all_records(method: str) -> None:
    result = fit(method, model(**SHARED), records(4, 2))
    own = {"alpha_0": 0.05, "b_alpha": 0.4, "b_q": 2.0, "b_az": -0.7}
    assert_held(result, TRUTH | own, times=1.5)


def test_a_shared_constant_has_the_unit_of_its_equation() -> None:
    shared = model(**SHARED)
    assert parameter_unit(shared, "b_alpha") == "1/s"
    assert parameter_unit(shared, "b_q") == "1/s2"


def test_shared_constants_are_known_better_than_each_records_own() -> None:
    data = records(4, 2)
    shared = fit("output-error-white", model(**SHARED), data)
    starts = {"alpha_rad": "own", "q_radps": 0.0}
    own = fit("output-error-white", model(**{**SHARED, "initial_states": starts}), data)
    narrow = shared.half_width()[shared.index("alpha_0")]
    wide = [own.half_width()[own.index(f"initial.alpha_rad@{k}")] for k in (1, 2, 3, 4)]
    assert narrow < 0.7 * min(wide)


def test_shared_constants_agree_with_finite_differences() -> None:
    shared = model(**SHARED)
    problem = OutputProblem(shared, records(2, 3))
    theta = problem.first_guess() + 0.01
    response = problem.respond(theta)
    assert response is not None
    for k in range(len(theta)):
        step = np.zeros(len(theta))
        step[k] = 1e-6
        up, down = problem.outputs(theta + step), problem.outputs(theta - step)
        assert up is not None
        assert down is not None
        for number in (0, 1):
            slope = (up[number] - down[number]) / 2e-6
            np.testing.assert_allclose(
                response[number].sensitivities[:, :, k], slope, rtol=1e-5, atol=1e-6
            )


def test_known_noise_is_what_the_intervals_count() -> None:
    """Residuals of one record say what they like: ten times the noise, ten times the interval."""
    data = records(1, 4)
    names = BASE["outputs"]
    known = model(**KNOWN, noise=dict(zip(names, NOISE, strict=True)))
    large = model(**KNOWN, noise={y: 10.0 * sd for y, sd in zip(names, NOISE, strict=True)})
    halves = [fit("output-error-white", m, data).half_width() for m in (known, large)]
    np.testing.assert_allclose(halves[1], 10.0 * halves[0], rtol=1e-6)
    bound = OutputProblem(known, data)
    found = fit("output-error-white", known, data)
    response = bound.respond(found.estimate)
    assert response is not None
    J = response[0].sensitivities / np.array(NOISE)[:, None, None]
    information = np.einsum("jka,jkb->ab", J, J)
    np.testing.assert_allclose(
        np.sqrt(np.diag(np.linalg.inv(information))), found.standard_error, rtol=1e-4
    )


def test_noise_of_one_output_may_be_known_and_that_of_others_not() -> None:
    data = records(2, 5)
    found = fit("output-error", model(**KNOWN, noise={"q_radps": 0.004}), data)
    variance = np.asarray(found.details["innovation_variance"])
    assert variance[1] == pytest.approx(0.004**2)
    assert variance[0] == pytest.approx(0.002**2, rel=0.3)


def test_constants_survive_a_file(tmp_path: Path) -> None:
    for keys in (KNOWN, SHARED, {"initial_states": {"alpha_rad": "own", "q_radps": 0.1}}):
        before = model(**keys, noise={"q_radps": 0.004})
        path = tmp_path / "m.toml"
        path.write_text(model_text(before))
        after = read_model(path)
        for field in ("inputs", "initial_states", "known_starts", "shared_starts", "known_noise"):
            assert getattr(after, field) == getattr(before, field)
        np.testing.assert_array_equal(after.B, before.B)
        np.testing.assert_array_equal(after.D, before.D)
        assert set(after.terms) == set(before.terms)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"initial_states": 3}, "initial_states must be a list of signal names, or a table"),
        ({"initial_states": {"beta_rad": 0.0}}, "initial_states: no signal beta_rad; there are"),
        ({"state_biases": {"q_radps": "2 b"}}, "state_biases: q_radps = '2 b', expected \"own\""),
        ({"output_biases": {"az_mps2": [1]}}, r"output_biases: az_mps2 is \[1\]"),
        ({"noise": {"q_radps": 0.0}}, "noise: q_radps is 0"),
        ({"noise": ["q_radps"]}, "noise must be a table"),
        ({"noise": {"theta_rad": 0.1}}, "noise: no signal theta_rad"),
    ],
)
def test_mistakes_are_one_line(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(IdentificationError, match=words) as caught:
        model(**keys)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("method", "keys", "words"),
    [
        ("filter-error", {"noise": {"q_radps": 0.1}}, "known noise"),
        ("equation-error", {"noise": {"q_radps": 0.1}}, "known noise"),
        ("extended-kalman", {"initial_states": {"q_radps": 0.1}}, "initial states"),
    ],
)
def test_a_method_that_cannot_hold_them_is_refused(
    method: str, keys: dict[str, Any], words: str
) -> None:
    with pytest.raises(IdentificationError, match=words):
        fit(method, model(**keys), without_constant(records(1, 1)))
