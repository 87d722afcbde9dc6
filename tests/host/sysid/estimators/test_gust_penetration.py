"""Air that turns: its parameters act through the gust alone."""

import numpy as np
import pytest
from host.sysid.estimators.filter_error_gust import fit_with_gust, gust_parameters
from host.sysid.estimators.gust_model import gust_model
from host.sysid.estimators.gust_penetration import (
    GUST_LAG,
    PREFIX,
    penetration_of,
    with_gust_penetration,
    without_gust_penetration,
)
from host.sysid.models import LinearModel, Maneuver, Trim, template
from host.sysid.models.fit_result import without_parameters
from scipy import linalg

SPEED_MPS, SPAN_M, DT_S = 18.0, 1.8, 0.02
TRUE = {
    "Z_alpha": -7.4, "Z_q": -0.08, "Z_de": -0.6, "M_alpha": -91.0, "M_q": -11.3, "M_de": -121.0,
}  # fmt: skip


def _model() -> LinearModel:
    return template("short-period", Trim(SPEED_MPS), delays=())


def _theta(model: LinearModel) -> np.ndarray:
    return np.array([TRUE[p.name] for p in model.parameters])


def _flown(seed: int, *, turning: bool) -> Maneuver:
    """Fly 20 s of 3-2-1-1s in gusts of 1 m/s, which turn or do not (MIL-F-8785C, 3.7.5)."""
    model = _model()
    wide = gust_model(model, SPEED_MPS, 50.0, span_m=SPAN_M if turning else None)
    A, B, C, D = wide.matrices(_theta(model))
    rng = np.random.default_rng(seed)
    fine = DT_S / 20
    n = len(wide.states)
    whole = np.zeros((n + 2, n + 2))
    whole[:n, :n], whole[:n, n], whole[wide.states.index("gust_rad"), n + 1] = A, B[:, 0], 1.0
    step = linalg.expm(whole * fine)
    x, rows, elevator = np.zeros(n), [], np.zeros(round(20.0 / DT_S))
    for begin in (1.0, 8.0, 14.0):
        for k, sign in enumerate((1, 1, 1, -1, -1, 1, -1)):
            first = round((begin + 0.25 * k) / DT_S)
            elevator[first : first + round(0.25 / DT_S)] = np.deg2rad(3.0) * sign
    power = (1.0 / SPEED_MPS) * np.sqrt(2.0 * SPEED_MPS / 50.0 / fine)
    for k in range(len(elevator)):
        rows.append(C @ x + D[:, 0] * elevator[k])
        after = elevator[min(k + 1, len(elevator) - 1)]
        for j in range(20):
            held = elevator[k] + (after - elevator[k]) * (j + 0.5) / 20
            x = (step @ np.concatenate([x, [held, power * rng.standard_normal()]]))[:n]
    noise = np.where(
        np.char.startswith(wide.outputs, "a") & np.char.endswith(wide.outputs, "mps2"), 0.1, 0.003
    )
    outputs = np.array(rows) + noise * rng.standard_normal((len(rows), len(wide.outputs)))
    return Maneuver(dt_s=DT_S, inputs=elevator[:, None], outputs=outputs)


@pytest.mark.parametrize("turning", [False, True])
def test_moments_are_right_whether_the_air_turns_or_not(turning: bool) -> None:
    """As an angle alone it left M_alpha 73 and M_q 140 % off where it turns."""
    model = _model()
    errors = []
    for seed in range(3):
        found = fit_with_gust(model, [_flown(seed, turning=turning)], SPEED_MPS).result
        assert found.method == "filter error with gust"
        half = found.half_width()
        for name in ("M_alpha", "M_q", "M_de"):
            k = found.index(name)
            errors.append((found.estimate[k] - TRUE[name]) / TRUE[name])
            assert abs(found.estimate[k] - TRUE[name]) < 2.0 * half[k]
        # The effect of turning air on pitch is M_q times 4 b/pi over V; a point feels none.
        effect = TRUE["M_q"] * np.pi * SPEED_MPS / (4.0 * SPAN_M)
        k = found.index("gust_M")
        assert abs(found.estimate[k] + (effect if turning else 0.0)) < 3.0 * half[k]
    assert np.sqrt(np.mean(np.square(errors))) < 0.12


def test_parameters_of_turning_air_come_and_go() -> None:
    model = _model()
    wide, start = with_gust_penetration(model, SPEED_MPS, np.append(_theta(model), [5.0, 6.0]))
    more = [p.name for p in wide.parameters if p.name.startswith(PREFIX)]
    assert more == ["gust_Z", "gust_M", GUST_LAG]
    np.testing.assert_array_equal(start[-2:], [5.0, 6.0])
    assert start[len(model.parameters) :][2] == SPEED_MPS / 1.5
    assert without_gust_penetration(wide).parameters == model.parameters
    assert without_gust_penetration(wide).terms == model.terms
    assert penetration_of(model, wide).terms == wide.terms
    for plain, same in zip(
        model.matrices(_theta(model)),
        wide.matrices(start[:-2] + 1e3 * (start[:-2] == 0)),
        strict=True,
    ):
        np.testing.assert_array_equal(plain, same)  # without a gust they move nothing


def test_an_answer_has_no_parameter_of_the_air() -> None:
    model = _model()
    found = fit_with_gust(model, [_flown(5, turning=True)], SPEED_MPS).result
    bare = without_gust_penetration(found.model)
    alone = without_parameters(found, bare, gust_parameters(found))
    assert alone.model.parameters == model.parameters
    assert not [name for name in alone.names if name.startswith(PREFIX)]
    for name in alone.names:
        assert alone.value(name) == found.value(name)
        assert alone.half_width()[alone.index(name)] == found.half_width()[found.index(name)]
    assert not gust_parameters(alone)
