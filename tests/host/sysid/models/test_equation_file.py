"""Files of a user's equations: what they say, what is refused and where, how they are written."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from host.errors import IdentificationError
from host.sysid.estimators import fit_output_error
from host.sysid.models import Maneuver, NonlinearModel, read_model
from host.sysid.models.equation_text import equation_text
from host.sysid.numerics import NonlinearProblem

pytestmark = pytest.mark.usefixtures("interpreted")

TEXT = """\
kind = "equations"
name = "pitch"
inputs = ["elevator_rad"]
columns = ["thrust_n"]
[constants]
V = 17.0
[definitions]
lift = "Za*alpha_rad*(1 - stall(alpha_rad))"
[rates]
alpha_rad = "q_radps + lift + 0.01*thrust_n/V"
q_radps = "Ma*sin(alpha_rad) + Mq*q_radps + Mde*elevator_rad + M0"
[outputs]
alpha_rad = "alpha_rad"
az_mps2 = "V*lift"
[parameters]
Za = { start = -5.0, upper = 0.0, unit = "1/s" }
Ma = -90.0
Mq = { start = -6.0, prior_sd = 3.0 }
Mde = -80.0
M0 = { each_record = true }
[tables.stall]
x = [0.0, 0.2, 0.3]
y = [0.0, 0.1, 0.4]
[starts]
q_radps = "0.1*alpha_rad + thrust_n - thrust_n"
[[delays]]
name = "servo_s"
outputs = ["elevator_rad"]
"""
# Each definition is 150 times the one before it, 199 times over.
CHAIN = "".join(
    f'd{k} = "' + f"+sin({'lift' if k == 0 else f'd{k - 1}'})" * 150 + '"\n' for k in range(199)
)


def test_a_file_says_what_a_model_is(tmp_path: Path) -> None:
    model = read(tmp_path, TEXT)
    assert model.states == ("alpha_rad", "q_radps")
    assert model.inputs == ("elevator_rad", "thrust_n")
    assert model.outputs == ("alpha_rad", "az_mps2")
    assert model.parameter_names == ("Za", "Ma", "Mq", "Mde", "servo_s")
    assert model.local_names(2) == ("initial.alpha_rad@2", "initial.q_radps@2", "M0@2")


def test_slopes_of_the_response_are_those_of_differences(tmp_path: Path) -> None:
    model = read(tmp_path, TEXT)
    t = np.arange(30) * 0.02
    u = np.column_stack([0.05 * np.sin(9.0 * t), 2.0 + 0.5 * t])
    rng = np.random.default_rng(1)
    records = [Maneuver(0.02, u * k, 0.1 * rng.standard_normal((30, 2))) for k in (1.0, 2.0)]
    problem = NonlinearProblem(model, records)
    theta = problem.first_guess() + 0.01 * rng.standard_normal(len(problem.names))
    responses = problem.respond(theta)
    assert responses is not None
    for number, response in enumerate(responses):
        for column, k in enumerate(problem.columns(number)):
            step = 1e-5 * max(abs(theta[k]), 0.01)
            up, down = theta.copy(), theta.copy()
            up[k] += step
            down[k] -= step
            high, low = problem.outputs(up), problem.outputs(down)
            assert high is not None and low is not None
            expected = (high[number] - low[number]) / (2.0 * step)
            found = response.sensitivities[:, :, column]
            assert found == pytest.approx(expected, abs=1e-5 * np.max(np.abs(expected)) + 1e-12)


def test_the_tangent_is_the_model_to_first_order(tmp_path: Path) -> None:
    model = read(tmp_path, TEXT.replace("- stall(alpha_rad)", "- alpha_rad"))
    theta = np.array([-5.0, -90.0, -6.0, -80.0, 0.0])
    x, u, own = np.array([0.1, 0.2]), np.array([0.02, 2.0]), np.array([0.5])
    tangent = model.tangent_at(x, u, theta, own)
    A, B, C, _ = tangent.matrices(theta)
    assert pytest.approx(np.array([[-5.0 * 0.8, 1.0], [-90.0 * np.cos(0.1), -6.0]])) == A
    assert pytest.approx(np.array([[0.0, 0.01 / 17.0], [-80.0, 0.0]])) == B
    assert pytest.approx(np.array([[1.0, 0.0], [17.0 * -5.0 * 0.8, 0.0]])) == C
    assert tangent.gradient("A", "Za")[0, 0] == pytest.approx(0.8)


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    model = read(tmp_path, TEXT)
    again = read(tmp_path, equation_text(model))
    assert (again.source, again.parameters) == (model.source, model.parameters)
    assert equation_text(again) == equation_text(model)


def test_a_first_guess_needs_a_value_where_it_was_measured_only(tmp_path: Path) -> None:
    """A speed of 1 m/s stood for every column, and the root had none."""
    model = read(tmp_path, TEXT.replace('"0.1*alpha_rad + ', '"sqrt(thrust_n - 4) + '))
    assert model.source.first_states({"alpha_rad": 0.1, "thrust_n": 13.0})["q_radps"] == 3.0
    with pytest.raises(IdentificationError, match=r"starts.q_radps: has no finite .*sqrt\(-1\)"):
        model.source.first_states({"alpha_rad": 0.1, "thrust_n": 3.0})


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("V = 17.0", "V = 0.0", r"rates.alpha_rad has no finite value.*: 0.02 / 0, at the start"),
        ('"V*lift"', '"V*lift + sqrt(alpha_rad - 1)"', r"outputs.az_mps2 has .*: sqrt\(-0.8\)"),
        ("stall(alpha_rad))", "log(stall(alpha_rad)))", r"rates.alpha_rad has .*: log\(0\)"),
    ],
)
def test_equations_without_a_value_at_the_start_are_named(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    text = TEXT.replace("y = [0.0, 0.1", "y = [-0.1, 0.0").replace(old, new)
    data = Maneuver(0.02, np.full((50, 2), 2.0), np.full((50, 2), 0.2))
    with pytest.raises(IdentificationError, match=said):
        fit_output_error(read(tmp_path, text), [data], coloured_noise=False)


def test_inputs_between_samples_are_what_the_file_says(tmp_path: Path) -> None:
    """Measured columns have noise: they stay as they are."""
    smooth = read(tmp_path, 'hold = "smooth"\n' + TEXT)
    assert smooth.smooth_inputs() == ("elevator_rad",)
    assert read(tmp_path, equation_text(smooth)).smooth_inputs() == ("elevator_rad",)
    assert read(tmp_path, TEXT).smooth_inputs() == ()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"q_radps + lift', '"q_radps + lfit', "line 10: rates.alpha_rad: column 11: 'lfit' is no"),
        ("sin(alpha_rad)", "sin(alpha_rad", "line 11: rates.q_radps: column "),
        ("(1 - stall", "(1 - __import__", "line 8: definitions.lift: column 19: '__import__' is"),
        ("V = 17.0", 'V = "x"', "line 6: constants.V is 'x', expected a number"),
        ('lift = "', 'lift = "drag + ', "line 8: definitions.lift: column 1: 'drag' is no name"),
        ('lift = "', 'lift = "lift + ', "line 8: definitions.lift: made of itself"),
        ('lift = "', 'drag = "lift"\nlift = "', "line 8: definitions.drag: made of lift, which st"),
        (
            "prior_sd = 3.0",
            "min = 3.0",
            "known are start, lower, upper, prior_sd, each_record, unit",
        ),
        ('kind = "equations"', 'kind = "equation"', ': [rates] are of equations; write kind = "e'),
        ('kind = "equations"', "", ': [rates] are of equations; write kind = "equations"'),
        ("upper = 0.0", "upper = -9.0", "line 16: parameters.Za: start -5 is not between"),
        ("Ma = -90.0", "Ma = -90.0\nidle = 1.0", "line 18: parameters.idle: enters no expression"),
        (
            "Ma = -90.0",
            "Ma = -90.0\nV = 1.0",
            ": V is named twice: as a parameter and as a constant",
        ),
        ("Ma = -90.0", "Ma = -90.0\nsin = 1.0", "line 18: parameters.sin: the name of a function"),
        ("x = [0.0, 0.2, 0.3]", "x = [0.0, 0.3, 0.2]", "line 21: tables.stall: x must rise"),
        ("x = [0.0, 0.2, 0.3]", "x = [0.0, 0.2]", "line 21: tables.stall: 2 points of x, 3 of y"),
        ('q_radps = "0.1*', 'speed = "0.1*', "line 25: starts.speed: no state"),
        ('q_radps = "0.1*', 'q_radps = "Mq*', "line 25: starts.q_radps: column 1: 'Mq' is no"),
        ('kind = "equations"', 'kind = "equations"\nrow = 1', ": unknown key row"),
        ("[outputs]", "[readings]", ": unknown key readings"),
        ("[constants]", 'hold = "cubic"\n[constants]', "hold: 'cubic', use zoh, foh, smooth"),
        ("M0 = { each_record = true }", "M0 = { each_record = 3 }", "line 20: parameters.M0:"),
    ],
)
def test_a_mistake_is_one_line_that_says_where(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    assert old in TEXT
    with pytest.raises(IdentificationError) as error:
        read(tmp_path, TEXT.replace(old, new))
    text = str(error.value)
    assert said in text and "\n" not in text and text.startswith(str(tmp_path))


@pytest.mark.parametrize(
    "text",
    [
        TEXT + "x = " + "[" * 100_000,
        TEXT.replace("17.0", "1" + "0" * 100_000),
        TEXT + "# " + "x" * 10_000_000,
        TEXT.replace('"q_radps + lift', '"' + "(" * 100_000),
        TEXT.replace('"q_radps + lift', '"lift' + "^9" * 50 + " + lift"),
        TEXT.replace("[parameters]", "[parameters]\n" + "\n".join(f"p{k} = 1" for k in range(999))),
        TEXT.replace("[rates]", CHAIN + "[rates]").replace('"q_radps +', '"d198^3 +'),
    ],
)
def test_a_hostile_file_is_refused_or_read_in_a_moment(tmp_path: Path, text: str) -> None:
    try:
        model = read(tmp_path, text)
    except IdentificationError as error:
        assert "\n" not in str(error) and len(str(error)) < 300
    else:
        assert len(model.source.nodes().text()) < 4_000_000


def read(folder: Path, text: str) -> NonlinearModel:
    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    model = read_model(path)
    assert isinstance(model, NonlinearModel)
    return model


def test_no_name_of_a_user_reaches_the_code(tmp_path: Path) -> None:
    text = read(tmp_path, TEXT).source.nodes().text()
    names = set(re.findall(r"[A-Za-z_]\w*", text))
    assert not names & {"alpha_rad", "elevator_rad", "Za", "lift", "stall", "V"}
