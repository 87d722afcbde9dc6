"""Intervals widened by what neighbouring scores have in common."""

import numpy as np
from host.sysid.estimators.innovations import hac_inflation, inflation_lines
from scipy import signal
from studies.gusts import fly, gusty_aircraft
from studies.turbulence import fit_both, linear_setup

DT_S, SAMPLES = 0.02, 1500


def _factor(memory: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return the factor of a straight-line fit, and its error over the error it would tell."""
    x = signal.lfilter([1.0], [1.0, -0.95], rng.standard_normal((SAMPLES, 2)), axis=0)
    noise = signal.lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], rng.standard_normal(SAMPLES))
    inverse = np.linalg.inv(x.T @ x)
    miss = inverse @ x.T @ noise
    left = noise - x @ miss
    factor = hac_inflation([x[:, None, :]], [left[:, None]], [DT_S], inverse)
    return factor, miss / np.sqrt(np.diag(inverse))


def test_factor_is_what_the_errors_scatter_by() -> None:
    rng = np.random.default_rng(11)
    for memory, scatter in ((0.0, 1.0), (0.8, 2.7)):
        runs = [_factor(memory, rng) for _ in range(200)]
        stated = np.sqrt(np.mean([f**2 for f, _ in runs]))
        seen = np.sqrt(np.mean([e**2 for _, e in runs]))
        np.testing.assert_allclose(seen, scatter, rtol=0.1)
        np.testing.assert_allclose(stated, seen, rtol=0.15)


def test_factor_never_narrows() -> None:
    rng = np.random.default_rng(12)
    assert min(np.min(_factor(-0.9, rng)[0]) for _ in range(20)) == 1.0


def test_right_model_is_hardly_widened() -> None:
    setup = linear_setup("longitudinal")
    truth = np.ones(3)
    half = [fit_both(setup, m, truth)[1] for m in fly("longitudinal", 0.5, [1, 2], with_pilot=True)]
    # The bound of the same flights is 0.36, 0.29 and 0.56 % of 3.92, 1.66 and 10.9.
    bound = 1.96 * np.array([0.36, 0.29, 0.56]) * [0.0392, 0.0166, 0.109]
    assert np.all(np.mean(half, axis=0) < 1.6 * bound)


def test_what_was_widened_is_named() -> None:
    model = gusty_aircraft().models["longitudinal"]
    names = [p.name for p in model.parameters]
    factor = np.ones(len(names) + 5)
    assert inflation_lines(model, factor) == []
    factor[names.index("Cm_alpha")] = 1.44
    (said,) = inflation_lines(model, factor)
    assert "widened Cm_alpha 1.4 times" in said
