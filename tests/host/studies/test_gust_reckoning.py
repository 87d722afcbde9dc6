"""The gust of a flight by dead reckoning, and whether it turns with the aircraft."""

import numpy as np
from host.arrays import Array
from host.sysid.estimators import fit
from scipy.spatial.transform import Rotation
from studies.gust_reckoning import gust_motion, turning
from studies.gusts import AXES, DT_S
from studies.nonlinear_gusts import fly_nonlinear, varying
from studies.turbulence import PROCESS, fit_both, nonlinear_setup


def _turned(rates: Array, start: Array) -> Array:
    """Return a vector that stays with the ground, in body axes that turn at constant rates."""
    times = DT_S * np.arange(len(rates))
    return np.asarray(Rotation.from_rotvec(-times[:, None] * rates).apply(start))


def _columns(samples: int, wind: Array, rates: Array) -> dict[str, Array]:
    """Return a flight without forces whose air moves by `wind` in body axes."""
    flow = _turned(rates, np.array([17.0, 0.3, 1.5])) - wind
    speed = np.linalg.norm(flow, axis=1)
    zero = np.zeros(samples)
    return {
        "airspeed_mps": speed,
        "alpha_rad": np.arctan2(flow[:, 2], flow[:, 0]),
        "beta_rad": np.arcsin(flow[:, 1] / speed),
        "p_radps": rates[:, 0],
        "q_radps": rates[:, 1],
        "r_radps": rates[:, 2],
        "theta_rad": zero,
        "phi_rad": zero,
        "ax_mps2": zero,
        "ay_mps2": zero,
        "az_mps2": zero - 9.80665,
    }


def test_reckoning_finds_the_gust_but_for_a_wind_over_the_ground() -> None:
    samples = 300
    rates = np.tile([0.4, -0.3, 0.2], (samples, 1))
    t = DT_S * np.arange(samples)
    wind = np.column_stack([np.sin(t), 0.5 * np.cos(2.0 * t), 0.2 * t])
    gust, steady = gust_motion(_columns(samples, wind, rates), DT_S)
    left = wind - gust
    constant = np.linalg.lstsq(steady.reshape(-1, 3), left.ravel(), rcond=None)[0]
    np.testing.assert_allclose(left, steady @ constant, atol=2e-3)
    assert np.std(left) > 0.1  # and that wind is really not known
    np.testing.assert_allclose(steady[:, :, 1], _turned(rates, np.eye(3)[1]), atol=2e-3)


def test_turning_is_the_rate_the_flow_gets() -> None:
    """A gust constant in body axes: differences of what vanes and pitot read say the same."""
    samples = 400
    rates = np.tile([0.5, 0.3, -0.4], (samples, 1))
    wind = np.tile([1.0, -0.8, 0.6], (samples, 1))
    columns, still = _columns(samples, wind, rates), _columns(samples, 0.0 * wind, rates)
    found = turning(columns, wind)
    alpha, beta, speed = (columns[c] for c in ("alpha_rad", "beta_rad", "airspeed_mps"))
    flow = speed[:, None] * np.column_stack(
        [np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta)]
    )
    # What kinematics say of this flow alone: without forces it turns against the rates.
    u, v, w = -np.cross(rates, flow).T
    slower = (flow[:, 0] * u + flow[:, 1] * v + flow[:, 2] * w) / speed
    plain = {
        "airspeed_mps": slower,
        "alpha_rad": (np.cos(alpha) * w - np.sin(alpha) * u) / (speed * np.cos(beta)),
        "beta_rad": (v - np.sin(beta) * slower) / (speed * np.cos(beta)),
    }
    for name, values in found.items():
        slope = np.gradient(columns[name], DT_S)[1:-1]
        np.testing.assert_allclose(slope, (plain[name] + values)[1:-1], atol=3e-3)
        assert np.max(np.abs(slope - plain[name][1:-1])) > 0.02
        np.testing.assert_allclose(turning(still, 0.0 * wind)[name], 0.0)


def test_flight_tells_that_the_gusts_turn() -> None:
    flight = fly_nonlinear("lateral", 1.0, [5], with_pilot=True)[0]
    setup = nonlinear_setup("lateral", flight.airspeed_mps)
    start = np.concatenate([setup.wide.start, np.zeros(len(setup.wide.local_names(1)))])
    result = fit(
        "filter-error", setup.wide, [flight.maneuver], process=PROCESS["lateral"], start=start,
        compare_noise=False,
    )  # fmt: skip
    half = float(result.half_width()[result.index("gust_turns")])
    assert half < 0.3  # 0.98 beforehand
    assert abs(result.value("gust_turns") - 1.0) < 1.5 * half
    assert result.value("gust_turns") > half  # 0: they stay with the ground


def test_airspeed_off_the_trim_biases_no_moment() -> None:
    """Torque of the propeller does not follow V^2; without its terms Cn_r is 4 % off."""
    flight = fly_nonlinear("lateral", 0.0, [3], with_pilot=False)[0]
    setup = nonlinear_setup("lateral", flight.airspeed_mps)
    result = fit("output-error-white", setup.plain, [flight.maneuver])
    truth = np.array([flight.truth[name] for name in AXES["lateral"]])
    found = np.array([result.value(name) for name in AXES["lateral"]])
    assert np.all(np.abs(found / truth - 1.0) < [0.01, 0.003, 0.03])
    assert abs(result.value("L_V")) > 3.0 * float(result.half_width()[result.index("L_V")])


def test_search_does_not_end_where_the_airspeed_is_all_noise() -> None:
    """Seed 2046 did: accelerometer exact, 0.9 m/s of noise on airspeed, D_V of the wrong sign."""
    flight = fly_nonlinear("longitudinal", 1.0, [2046], with_pilot=True)[0]
    setup = nonlinear_setup("longitudinal", flight.airspeed_mps)
    truth = np.array([flight.truth[name] for name in AXES["longitudinal"]])
    ours, half, _, _ = fit_both(setup, flight.maneuver, truth)
    assert np.all(np.abs(ours) < 0.03)
    assert half[0] < 0.012
    assert varying("longitudinal", flight.airspeed_mps).trim.airspeed_mps != 17.0
