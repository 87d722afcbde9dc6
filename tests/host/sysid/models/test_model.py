"""Model descriptions: templates against a non-linear truth, TOML there and back, refusals."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from host.constants import GRAVITY_MPS2
from host.errors import IdentificationError
from host.sysid import LinearModel, Maneuver, Parameter, Term
from host.sysid.models import Trim, model_from, read_model, template
from host.sysid.models.modal_analysis import longitudinal_names
from host.sysid.models.model_file import parse_entry
from host.sysid.models.model_text import model_text
from host.sysid.models.reduced_model import without_outputs
from host.sysid.models.residual_delays import without_standard_delays
from host.sysid.models.state_space_model import DelayGroup
from host.sysid.models.templates import TEMPLATES, longitudinal

TRIM = Trim(airspeed_mps=17.0, alpha_rad=0.1, theta_rad=0.16)


def test_longitudinal_template_is_the_slope_of_the_equations_of_motion() -> None:
    """Wind-axis equations with made-up forces, linearised numerically at a trim."""
    V0, alpha0, theta0, g = 17.0, 0.1, 0.16, GRAVITY_MPS2
    gamma0 = theta0 - alpha0

    def motion(x: np.ndarray, de: float) -> np.ndarray:
        V, alpha, q, theta = x
        along = g * np.sin(gamma0) - 0.3 * (V - V0) - 4.0 * (alpha - alpha0) - 0.2 * de
        normal = -g * np.cos(gamma0) - 1.1 * (V - V0) - 80.0 * (alpha - alpha0) - 9.0 * de
        gamma = theta - alpha
        rates = [
            along - g * np.sin(gamma),
            q + (normal + g * np.cos(gamma)) / V,
            0.2 * (V - V0) - 60.0 * (alpha - alpha0) - 7.0 * q - 90.0 * de,
            q,
        ]
        ax = along * np.cos(alpha) - normal * np.sin(alpha)
        az = along * np.sin(alpha) + normal * np.cos(alpha)
        return np.array([*rates, ax, az])

    x0 = np.array([V0, alpha0, 0.0, theta0])
    step = 1e-6
    slope = np.column_stack(
        [
            (motion(x0 + step * e, 0.0) - motion(x0 - step * e, 0.0)) / (2.0 * step)
            for e in np.eye(4)
        ]
    )
    by_input = (motion(x0, step) - motion(x0, -step)) / (2.0 * step)
    model = longitudinal(TRIM)
    values = {
        "D_V": -0.3, "D_alpha": -4.0, "D_de": -0.2,
        "Z_V": -1.1 / V0, "Z_q": 0.0, "Z_alpha": -80.0 / V0, "Z_de": -9.0 / V0,
        "M_V": 0.2, "M_alpha": -60.0, "M_q": -7.0, "M_de": -90.0,
    }  # fmt: skip
    theta = np.array([values[p.name] for p in model.parameters])
    A, B, C, D = model.matrices(theta)
    np.testing.assert_allclose(A, slope[:4], atol=1e-6)
    np.testing.assert_allclose(B[:, 0], by_input[:4], atol=1e-6)
    np.testing.assert_allclose(C[4:], slope[4:], atol=1e-6)
    np.testing.assert_allclose(D[4:, 0], by_input[4:], atol=1e-6)


@pytest.mark.parametrize("name", list(TEMPLATES))
def test_templates_leave_kinematics_and_gravity_alone(name: str) -> None:
    model = template(name, TRIM)
    kinematic = [s for s in model.states if s in ("theta_rad", "phi_rad")]
    for state in kinematic:
        if name == "phugoid":
            continue
        row = model.states.index(state)
        assert not [t for t in model.terms if t.matrix in "AB" and t.row == row]
    assert set(model.initial_states) == set(model.states)


@pytest.mark.parametrize("name", list(TEMPLATES))
def test_templates_survive_a_file(name: str, tmp_path: Path) -> None:
    model = template(name, TRIM, imu_sd_m=0.01)
    path = tmp_path / "model.toml"
    path.write_text(model_text(model))
    back = read_model(path)
    theta = np.linspace(-1.0, 2.0, len(model.parameters))
    position = [model.parameter_names.index(p.name) for p in back.parameters]
    for ours, theirs in zip(model.matrices(theta), back.matrices(theta[position]), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert back.state_biases == model.state_biases
    assert back.output_biases == model.output_biases
    assert back.accelerometer_offsets == model.accelerometer_offsets
    assert back.delays == model.delays == ()


def test_entries_are_parsed() -> None:
    assert parse_entry("17.0*Z_alpha - 9.81 + x", "here") == (
        -9.81,
        [("Z_alpha", 17.0), ("x", 1.0)],
    )
    assert parse_entry("-1e-3*k", "here") == (0.0, [("k", -1e-3)])
    wrongs = ("a b", "3 *", "", " ", "2*3*x", "a,b", "1.2.3*x", "x*2", True, float("nan"), None)
    for wrong in wrongs:
        with pytest.raises(IdentificationError, match="here"):
            parse_entry(wrong, "here")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"states": "x"}, "list of signal names"),
        ({"A": [[1.0]]}, "rows of 2"),
        ({"speed": 3}, "unknown key speed"),
        ({"parameters": {"k": {"begin": 1}}}, "parameter k: unknown key begin; known are start"),
        ({"parameters": {"kk": 1}}, "parameter kk enters no matrix; those that do are k"),
        ({"parameters": {"k": "fast"}}, "parameter k is 'fast', expected a number"),
        ({"parameters": {"k": {"start": True}}}, "k: start is True, expected a number"),
        ({"parameters": {"k": {"start": float("inf")}}}, "start is inf, expected a number"),
        ({"parameters": {"k": {"prior_sd": 0}}}, "prior_sd is 0, expected above 0"),
        ({"parameters": {"k": {"lower": 1, "upper": -1}}}, "lower 1 is not below upper -1"),
        ({"parameters": {"k": {"start": 3, "upper": 2}}}, "start 3 is not between .* upper 2"),
        ({"inputs": ["a"]}, "a is a state and an input"),
        ({"delays": [{"name": "d", "outputs": "a"}]}, "delay d: outputs must be a list"),
        ({"delays": [{"name": "d", "outputs": ["a"], "prior_sd": 1}]}, "unknown key prior_sd;"),
        ({"delays": [{"name": "d", "outputs": ["a"], "limit_s": -1}]}, "limit_s is -1"),
        ({"delays": [{"name": "k", "outputs": ["a"]}]}, "delay k: another parameter"),
        ({"delays": [{"name": n, "outputs": ["a"]} for n in "de"]}, "e: a has a delay already"),
        ({"levers": [{"output": "a", "state": "b"}]}, "a lever needs output, state and parameter"),
        ({"A": [["k", float("nan")], [0, 0]]}, "nan, expected a number"),
        ({"hold": "cubic"}, "use zoh or foh"),
        ({"state_biases": ["zeta"]}, "state bias on zeta"),
    ],
)
def test_a_wrong_file_is_one_clear_line(change: dict[str, object], message: str) -> None:
    document: dict[str, object] = {
        "states": ["a", "b"],
        "inputs": ["u"],
        "outputs": ["a", "b"],
        "A": [["k", 1], [0, 0]],
        "B": [[0], [1]],
    }
    assert model_from(document).parameter_names == ("k",)
    with pytest.raises(IdentificationError, match=message) as caught:
        model_from({**document, **change}, "file.toml")
    assert "\n" not in str(caught.value)


def test_constants_left_out_are_freed_where_records_need_them() -> None:
    document: dict[str, object] = {
        "states": ["q", "theta"],
        "inputs": ["u"],
        "outputs": ["q", "theta", "az"],
        "A": [["k", 0], [1, 0]],
        "B": [["b"], [0]],
        "C": [[1, 0], [0, 1], ["k", 0]],
        "parameters": {"k": {"upper": -1.0}},
    }
    model = model_from(document)
    assert model.initial_states == ("q", "theta")
    assert model.state_biases == ("q",)
    assert model.output_biases == ("az",)
    assert model.parameters[0].start == -1.0
    none: dict[str, object] = {"initial_states": [], "state_biases": [], "output_biases": []}
    bare = model_from({**document, **none})
    assert bare.local_names(1) == ()


def test_delays_left_out_are_those_of_the_sensors() -> None:
    document: dict[str, object] = {
        "states": ["alpha_rad", "q_radps"],
        "inputs": ["u"],
        "outputs": ["alpha_rad", "q_radps"],
        "A": [["k", 1], [0, 0]],
        "B": [[0], [1]],
    }
    model = model_from(document)
    assert [(d.name, d.outputs) for d in model.delays] == [
        ("delay_vanes_s", ("alpha_rad",)),
        ("delay_imu_s", ("q_radps",)),
    ]
    assert without_standard_delays(model).delays == ()
    assert model_from({**document, "delays": []}).delays == ()
    own = {"name": "delay_vanes_s", "outputs": ["alpha_rad"], "prior_sd_s": 0.002}
    kept = model_from({**document, "delays": [own]})
    assert without_standard_delays(kept).delays == kept.delays


def test_names_of_any_letters_survive_a_file(tmp_path: Path) -> None:
    model = LinearModel(
        'say "hi"', ("α",), ("u",), ("α",), np.zeros((1, 1)), np.ones((1, 1)), np.eye(1),
        np.zeros((1, 1)), (Term("A", 0, 0, "Z_α"),), (Parameter("Z_α", -1.0),),
    )  # fmt: skip
    path = tmp_path / "model.toml"
    path.write_text(model_text(model), encoding="utf-8")
    back = read_model(path)
    assert (back.name, back.states, back.parameters) == (model.name, ("α",), model.parameters)
    path.write_text(model_text(replace(model, name="clear\x1b[2J\n")), encoding="utf-8")
    assert read_model(path).name == r"clear\x1b[2J\x0a"  # what a terminal would act on is text


def test_model_refuses_contradictions() -> None:
    def build(**change: Any) -> LinearModel:
        settings: dict[str, Any] = {
            "name": "m", "states": ("a",), "inputs": ("u",), "outputs": ("a",),
            "A": np.zeros((1, 1)), "B": np.zeros((1, 1)), "C": np.eye(1), "D": np.zeros((1, 1)),
            "terms": (Term("A", 0, 0, "k"),), "parameters": (Parameter("k"),),
        }  # fmt: skip
        return LinearModel(**{**settings, **change})

    assert build().parameter_names == ("k",)
    cases: list[tuple[dict[str, Any], str]] = [
        ({"A": np.zeros((2, 2))}, "expected"),
        ({"terms": (Term("A", 1, 0, "k"),)}, "no entry"),
        ({"terms": (Term("A", 0, 0, "other"),)}, "no parameter"),
        ({"terms": ()}, "enters no matrix"),
        ({"parameters": (Parameter("k"), Parameter("k"))}, "named twice"),
    ]
    for change, message in cases:
        with pytest.raises(IdentificationError, match=message):
            build(**change)


def test_garbage_samples_are_named() -> None:
    good = np.zeros((20, 1))
    bad = good.copy()
    bad[7, 0] = np.nan
    for inputs, outputs, dt_s, message in (
        (bad, good, 0.1, "sample 7"),
        (good[:5], good, 0.1, "5 samples"),
        (good, good, 0.0, "not positive"),
        (good[:3], good[:3], 0.1, "at least 8"),
        (good[:, 0], good, 0.1, "dimensions"),
    ):
        with pytest.raises(IdentificationError, match=message):
            Maneuver(dt_s, inputs, outputs)


def test_an_output_left_out_leaves_the_others_alone() -> None:
    model = longitudinal(TRIM)
    fewer = without_outputs(model, ("theta_rad", "ax_mps2"))
    theta = np.linspace(-1.0, 1.0, len(model.parameters))
    keep = [k for k, y in enumerate(model.outputs) if y in fewer.outputs]
    assert fewer.outputs == ("airspeed_mps", "alpha_rad", "q_radps", "az_mps2")
    A, B, C, D = model.matrices(theta)
    for ours, theirs in zip(fewer.matrices(theta), (A, B, C[keep], D[keep]), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    arm = without_outputs(longitudinal(TRIM, imu_sd_m=0.01), ("theta_rad",))
    assert {x.output for x in arm.accelerometer_offsets} == {"ax_mps2", "az_mps2"}


@pytest.mark.parametrize(
    ("roots", "names"),
    [
        ([-3 + 4j, -0.1 + 0.6j], ["short period", "phugoid"]),
        ([-70.0, -9.0, -0.2 + 0.6j], ["root of the short period"] * 2 + ["phugoid"]),
        ([-3 + 4j, -0.4, 0.1], ["short period"] + ["root of the phugoid"] * 2),
        ([-9.0, -1 + 1j, 0.1], ["root of the short period", "oscillatory mode",
                                "root of the phugoid"]),
    ],
)  # fmt: skip
def test_a_slow_pair_is_the_phugoid_also_where_the_fast_one_does_not_swing(
    roots: list[complex], names: list[str]
) -> None:
    """An overdamped short period left its name to the phugoid, 96 % off in frequency."""
    assert longitudinal_names([complex(r).imag > 0.0 for r in roots]) == names


def test_numbers_of_numpy_are_written_as_numbers(tmp_path: Path) -> None:
    two = np.float64(2.0)
    model = template("longitudinal", TRIM, imu_sd_m=two / 100.0)
    parameters = tuple(replace(p, lower=-two * 1e4, prior_sd=two) for p in model.parameters)
    delays = (DelayGroup("delay_s", ("q_radps",), prior_sd_s=two, limit_s=two),)
    accelerometer_offsets = tuple(replace(x, gain=two) for x in model.accelerometer_offsets)
    model = replace(
        model, parameters=parameters, delays=delays, accelerometer_offsets=accelerometer_offsets
    )
    path = tmp_path / "model.toml"
    path.write_text(model_text(model), encoding="utf-8")
    again = read_model(path)
    named = {p.name: p for p in parameters}
    assert {p.name: p for p in again.parameters} == named
    assert len(again.accelerometer_offsets) == len(accelerometer_offsets) > 0
    assert (again.delays, again.accelerometer_offsets) == (delays, accelerometer_offsets)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('kind = "coefficients"\nrows.Cm = ["alpha"]', "terms of coefficients, expected matrices"),
        ('rows.Cm = ["alpha"]', 'write kind = "coefficients" above'),
        ('rates.q_radps = "-q_radps"', 'write kind = "equations" above'),
    ],
)
def test_a_file_of_another_kind_says_which(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "own.toml"
    path.write_text(text)
    with pytest.raises(IdentificationError, match=said):
        read_model(path)
