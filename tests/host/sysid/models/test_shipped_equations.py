"""The equations that are shipped: read, and the truth found by each."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from host.arrays import Array
from host.sysid.models import Maneuver, NonlinearModel, read_model
from host.sysid.numerics import NonlinearProblem

pytestmark = pytest.mark.usefixtures("interpreted")

FOLDER = Path(str(files("host.sysid.models").joinpath("equations")))
G = 9.80665


def shipped(name: str) -> NonlinearModel:
    model = read_model(FOLDER / f"{name}.toml")
    assert isinstance(model, NonlinearModel)
    return model


def rates(model: NonlinearModel, x: Array, u: Array) -> dict[str, float]:
    """Return dx/dt of a model at its start values."""
    e, found = model.source, np.zeros(len(x))
    own = np.array([p.start for p in model.own_parameters])
    p = model.parameter_vector(model.start, own)
    e.code.functions["rates"](x, u, p, e.constant_values, e.table_values, found)
    return dict(zip(model.states, found.tolist(), strict=True))


@pytest.mark.parametrize("name", ["longitudinal", "lateral", "six_degrees", "flight_path"])
def test_every_file_is_read_and_its_code_is_small(name: str) -> None:
    assert len(shipped(name).source.text()) < 100_000


def test_six_degrees_fly_as_the_longitudinal_model_in_the_plane() -> None:
    plane, space = shipped("longitudinal"), shipped("six_degrees")
    V, alpha, theta, q = 16.0, 0.08, 0.2, 0.3
    x = np.array([V, alpha, theta, q, 0.0, 0.0, 0.0])
    wings = rates(plane, x, np.array([0.05, 3.0, 0.0, 0.0, 0.0]))
    x = np.array([V * np.cos(alpha), 0.0, V * np.sin(alpha), 0.0, q, 0.0, 0.0, theta, *np.zeros(6)])
    body = rates(space, x, np.array([0.05, 0.0, 0.0, 3.0]))
    u, w = x[0], x[2]
    assert (u * body["u_mps"] + w * body["w_mps"]) / V == pytest.approx(wings["airspeed_mps"])
    turned = (u * body["w_mps"] - w * body["u_mps"]) / V**2
    assert turned == pytest.approx(wings["alpha_rad"])
    assert body["q_radps"] == pytest.approx(wings["q_radps"])
    for name in ("v_mps", "p_radps", "r_radps", "phi_rad"):
        assert body[name] == pytest.approx(0.0, abs=1e-12)


def test_six_degrees_roll_and_yaw_as_the_lateral_model_to_first_order() -> None:
    side, space = shipped("lateral"), shipped("six_degrees")
    V, alpha, theta, phi = 16.0, 0.08, 0.1, 0.02
    beta, p, r, da, dr = 1e-5, 2e-5, -1e-5, 1e-5, 3e-5
    air = np.zeros(3)
    own = rates(side, np.array([beta, p, r, phi, *air]), np.array([da, dr, V, alpha, theta, 0.0]))
    x = np.array(
        [V * np.cos(alpha), V * beta, V * np.sin(alpha), p, 0.0, r, phi, theta, *np.zeros(6)]
    )
    body = rates(space, x, np.array([0.0, da, dr, 3.0]))
    assert body["p_radps"] == pytest.approx(own["p_radps"], rel=1e-6)
    assert body["r_radps"] == pytest.approx(own["r_radps"], rel=1e-6)
    assert body["v_mps"] / V == pytest.approx(own["beta_rad"], rel=1e-6)


def test_a_steady_gust_is_an_angle_of_attack_to_moments_and_none_to_gravity() -> None:
    plane = shipped("longitudinal")
    V, alpha, theta, w = 16.0, 0.08, 0.2, 0.4
    u = np.array([0.05, 3.0, 0.0, 0.0, 0.0])
    gusty = rates(plane, np.array([V, alpha, theta, 0.0, 0.0, w, w]), u)
    air = np.array([V * np.cos(alpha), V * np.sin(alpha) + w])
    met = np.array([np.hypot(*air), np.arctan2(air[1], air[0]), theta, *np.zeros(4)])
    assert gusty["q_radps"] == pytest.approx(rates(plane, met, u)["q_radps"])
    turning = rates(plane, np.array([V, alpha, theta, 0.0, 0.0, w, 0.0]), u)
    assert turning["q_radps"] > gusty["q_radps"]  # the air turns with it: less damping


def test_a_rolling_gust_moves_the_aircraft_as_its_own_roll_does_the_other_way() -> None:
    side = shipped("lateral")
    u = np.array([0.0, 0.0, 16.0, 0.0, 0.0, 0.0])
    still = rates(side, np.zeros(7), u)
    air = rates(side, np.array([0, 0, 0, 0, 0, 0, 0.2]), u)
    own = rates(side, np.array([0, 0.2, 0, 0, 0, 0, 0]), u)
    for name in ("p_radps", "r_radps"):
        assert air[name] - still[name] == pytest.approx(still[name] - own[name])


def test_the_air_of_six_degrees_is_that_of_the_files_of_one_plane() -> None:
    plane, side, space = shipped("longitudinal"), shipped("lateral"), shipped("six_degrees")
    V, alpha, theta, w, behind = 16.0, 0.08, 0.2, 0.4, 0.1
    front = 0.3
    gusty = np.array([V, alpha, theta, 0.0, front, w, behind])
    wings = rates(plane, gusty, np.array([0.05, 3.0, 0.0, 0.0, 0.0]))
    path = [V * np.cos(alpha), 0.0, V * np.sin(alpha), 0.0, 0.0, 0.0, 0.0, theta]
    air = np.array([*path, front, w, behind, *np.zeros(3)])
    body = rates(space, air, np.array([0.05, 0, 0, 3.0]))
    assert body["q_radps"] == pytest.approx(wings["q_radps"])
    assert body["gust_fore_mps"] == pytest.approx(wings["gust_fore_mps"])
    beta, lagged, roll = 1e-5, 4e-6, 2e-5
    level = np.array([0.0, 0.0, 0.0, 0.0, beta, lagged, roll])
    own = rates(side, level, np.array([0.0, 0.0, V, alpha, theta, 0.0]))
    air = np.array([*path, *np.zeros(3), V * beta, V * lagged, roll])
    body = rates(space, air, np.array([0.0, 0.0, 0.0, 3.0]))
    assert body["r_radps"] == pytest.approx(own["r_radps"], rel=1e-6)
    assert body["p_radps"] == pytest.approx(own["p_radps"], rel=1e-6)


def test_a_gust_from_the_front_is_airspeed_and_turns_no_path() -> None:
    """Taken for motion, r times it passed for a side gust: Cn_r was 4 % off, and Cm_alpha 3."""
    space = shipped("six_degrees")
    u, r, gust = 16.0, 0.3, 0.8
    inputs = np.array([0.05, 0.0, 0.0, 3.0])
    own = rates(space, np.array([u, 0, 1.3, 0, 0, r, 0, 0.1, *np.zeros(6)]), inputs)
    met = rates(space, np.array([u - gust, 0, 1.3, 0, 0, r, 0, 0.1, gust, *np.zeros(5)]), inputs)
    for name in ("p_radps", "q_radps", "r_radps"):
        assert met[name] == pytest.approx(own[name])
    assert met["v_mps"] - own["v_mps"] == pytest.approx(r * gust)
    plane, w, q, columns = shipped("longitudinal"), 1.3, 0.2, np.array([0.05, 3.0, 0, 0, 0])
    still, front = (
        rates(plane, np.array([np.hypot(a, w), np.arctan2(w, a), 0.1, q, b, 0, 0]), columns)
        for a, b in ((u, 0.0), (u - gust, gust))
    )
    assert front["q_radps"] == pytest.approx(still["q_radps"])


def test_flight_path_of_an_aircraft_at_rest_in_a_turn_stands_still() -> None:
    V, phi, alpha = 17.0, 0.5, 0.06
    turn = G * np.tan(phi) / V
    x = np.array([V * np.cos(alpha), 0.0, V * np.sin(alpha), phi, alpha])
    body = [-turn * np.sin(alpha), turn * np.sin(phi) * np.cos(alpha),
            turn * np.cos(phi) * np.cos(alpha)]  # fmt: skip
    p, q, r = body
    u, w = x[0], x[2]
    force = [
        q * w + G * np.sin(alpha),
        r * u - p * w - G * np.cos(alpha) * np.sin(phi),
        -q * u - G * np.cos(alpha) * np.cos(phi),
    ]
    found = rates(shipped("flight_path"), x, np.array([*force, p, q, r]))
    assert list(found.values()) == pytest.approx([0.0] * 5, abs=1e-9)


def test_flight_path_needs_no_surface() -> None:
    """A record without surfaces was refused, though they drive nothing of it."""
    assert shipped("flight_path").controls() == ()


@pytest.mark.parametrize("name", ["lateral", "six_degrees", "flight_path"])
def test_its_slopes_are_those_of_differences(name: str) -> None:
    model = shipped(name)
    rng = np.random.default_rng(2)
    samples = 8
    typical = {"airspeed_mps": 16.0, "thrust_n": 3.0, "az_mps2": -G}
    mean = np.array([typical.get(u, 0.02) for u in model.inputs])
    u = mean * (1.0 + 0.1 * rng.standard_normal((samples, len(mean))))
    y = np.array([typical.get(n, 0.05) for n in model.outputs])
    data = Maneuver(0.02, u, y + 0.01 * rng.standard_normal((samples, len(y))))
    problem = NonlinearProblem(model, [data])
    theta = problem.first_guess() + 0.003
    responses = problem.respond(theta)
    assert responses is not None
    for k, unknown in enumerate(problem.names):
        step = 1e-5
        up, down = theta.copy(), theta.copy()
        up[k] += step
        down[k] -= step
        high, low = problem.outputs(up), problem.outputs(down)
        assert high is not None and low is not None
        expected = (high[0] - low[0]) / (2.0 * step)
        worst = np.max(np.abs(responses[0].sensitivities[:, :, k] - expected))
        assert worst < 1e-5 * max(np.max(np.abs(expected)), 1.0), unknown
