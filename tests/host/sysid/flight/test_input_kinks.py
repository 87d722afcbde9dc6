"""Surfaces between their samples: what lines miss of a servo's motion, and what they do not."""

import numpy as np
import pytest
from host.arrays import Array
from host.sysid.flight.input_kinks import with_means_of_motion

STEP_S = 0.01


def settling(begin: float, radps: float, times: int = 400) -> tuple[Array, float]:
    """Return samples of a servo of first order that starts at once, and its integral; in steps."""
    fine = np.arange(65 * times + 1) / times - 5.0
    late = np.maximum(fine - begin, 0.0)
    moved = 1.0 - np.exp(-radps * STEP_S * late)
    return moved[::times], float(np.trapezoid(moved, fine))


def missed(values: Array, whole: float) -> float:
    """Return what lines between samples miss of an integral."""
    return float(np.trapezoid(values)) - whole


@pytest.mark.parametrize("radps", [10.0, 20.0, 40.0])
def test_a_servo_that_starts_at_a_sample_is_not_late(radps: float) -> None:
    values, whole = settling(0.0, radps)
    assert missed(values, whole) < -0.08 * radps * STEP_S
    assert abs(missed(with_means_of_motion(values), whole)) < 0.1 * abs(missed(values, whole))


@pytest.mark.parametrize("radps", [10.0, 20.0, 40.0])
def test_a_servo_that_starts_anywhere_is_missed_by_less(radps: float) -> None:
    left = []
    for begin in np.linspace(0.02, 0.98, 25):
        values, whole = settling(begin, radps)
        left.append((missed(values, whole), missed(with_means_of_motion(values), whole)))
    by_lines, by_kinks = np.sqrt(np.mean(np.square(left), axis=0))
    assert by_kinks < 0.5 * by_lines


@pytest.mark.parametrize(
    "values",
    [
        [0, 0, 0, 1, 1, 1, 1],
        [0, 0, 0, 0.5, 1, 1, 1],
        [0, 0, 0, 1, 2, 3, 3, 3],
        [0, 0, 0, 1, 1, 1, -1, -1, -1, 0, 0, 0],
        [0, 1, 2, 1, 0],
    ],
)
def test_steps_and_straight_lines_stay(values: list[float]) -> None:
    np.testing.assert_allclose(with_means_of_motion(np.array(values, dtype=float)), values)


def test_noise_grows_by_little() -> None:
    noise = np.random.default_rng(0).standard_normal(20000)
    assert np.std(with_means_of_motion(noise)) < 1.1
