"""Inputs between samples: smooth ones, those that jump, and residuals that they make."""

from __future__ import annotations

import numpy as np
import pytest
from host.arrays import Array
from host.sysid.models import LinearModel, Maneuver, model_from
from host.sysid.numerics import OutputProblem, minimise
from host.sysid.numerics.between_samples import (
    left_between_samples,
    likely_jumps,
    with_jump,
    with_means_of_smooth_motion,
)
from scipy.signal import lfilter

DT_S, SAMPLES, FINE = 0.05, 120, 20


def roll(hold: str) -> LinearModel:
    return model_from(
        {
            "states": ["p_radps"],
            "inputs": ["aileron_rad"],
            "outputs": ["p_radps"],
            "delays": [],
            "state_biases": [],
            "hold": hold,
            "A": [["L_p"]],
            "B": [["L_da"]],
            "parameters": {"L_p": -4.0, "L_da": 30.0},
        }
    )


def flown(fine: Array, *, moves: bool = False, noise_sd: float = 0.0) -> Maneuver:
    """Return a record of an input that is held (or moves) for a twentieth of a sample."""
    F = np.exp(-5.0 * DT_S / FINE)
    drive = fine + np.append(fine[1:], fine[-1]) if moves else 2.0 * fine
    p = lfilter([0.0, 4.0 * (1.0 - F)], [1.0, -F], drive)[::FINE]
    p += noise_sd * np.random.default_rng(1).standard_normal(len(p))
    return Maneuver(DT_S, fine[::FINE, None], p[:, None])


def smooth() -> Array:
    t_s = np.arange(SAMPLES * FINE) * DT_S / FINE
    return 0.1 * np.sin(3.0 * t_s) * np.sin(0.8 * t_s)


def held() -> Array:
    return np.repeat(smooth()[::FINE], FINE)


def jumping() -> Array:
    """Return steps at instants of their own, none at a sample."""
    u = np.zeros(SAMPLES * FINE)
    for begin, end, size in ((207, 403, 0.1), (403, 614, -0.1), (1011, 1118, 0.1)):
        u[begin:end] = size
    return u


def clean(model: LinearModel, data: Maneuver) -> bool:
    problem = OutputProblem(model, [data])
    optimum = minimise(problem, problem.first_guess())
    return bool(left_between_samples(problem, optimum.theta, optimum.responses)[0])


@pytest.mark.parametrize(
    ("data", "hold"),
    [
        (flown(held()), "foh"),
        (flown(smooth(), moves=True), "zoh"),
        (flown(jumping()), "foh"),
        (flown(jumping()), "zoh"),
    ],
    ids=["held", "smooth", "jumps, lines", "jumps, held"],
)
def test_what_the_wrong_hold_leaves_is_no_noise(data: Maneuver, hold: str) -> None:
    assert clean(roll(hold), data)


@pytest.mark.parametrize("noise_sd", [0.02, 0.2])
def test_noise_is_not_what_inputs_do_between_samples(noise_sd: float) -> None:
    """Also beside the wrong hold, of which 0.02 rad/s are four tenths."""
    assert not clean(roll("foh"), flown(held(), noise_sd=noise_sd))
    assert not clean(roll("foh"), flown(smooth(), moves=True, noise_sd=noise_sd))


def test_a_slow_gust_is_not_what_inputs_do_between_samples() -> None:
    data = flown(smooth(), moves=True)
    gust = lfilter([0.05], [1.0, -0.97], np.random.default_rng(2).standard_normal(SAMPLES))
    assert not clean(roll("foh"), Maneuver(DT_S, data.inputs, data.outputs + gust[:, None]))


def test_jumps_are_found_where_they_were_and_move_the_mean() -> None:
    data = flown(jumping())
    jumps = likely_jumps(roll("foh"), [data])
    assert sorted(j.sample for j in jumps[:5]) == [10, 20, 30, 50, 55]
    assert jumps[0].most == pytest.approx(0.1)
    for hold in ("zoh", "foh"):
        [moved] = with_jump([data], jumps[0], hold)
        assert np.sum(moved.inputs - data.inputs) == pytest.approx(jumps[0].most)


def test_a_ramp_and_a_hold_have_no_jumps() -> None:
    ramp = Maneuver(DT_S, 0.01 * np.arange(40.0)[:, None], np.zeros((40, 1)))
    assert all(j.sample in (0, 38) for j in likely_jumps(roll("foh"), [ramp]))


def test_steps_are_no_smooth_motion() -> None:
    steps = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, 0.0, 0.0])
    np.testing.assert_allclose(with_means_of_smooth_motion(steps), steps, atol=1e-12)


def test_a_smooth_motion_is_not_made_smaller() -> None:
    """20 rad/s sampled every 10 ms: lines cut off 0.33 %."""
    fine = np.arange(3141) / 1000.0
    motion = np.sin(20.0 * fine)

    def gain(samples: Array) -> float:
        return float(np.interp(fine, fine[::10], samples) @ motion / (motion @ motion))

    assert gain(motion[::10]) == pytest.approx(1.0 - 0.2**2 / 12.0, abs=2e-4)
    assert gain(with_means_of_smooth_motion(motion[::10])) == pytest.approx(1.0, abs=6e-4)
