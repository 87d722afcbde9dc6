"""Delays, process noise and transitions: exact ones, and those that a search tries far away."""

import warnings

import numpy as np
from host.sysid.numerics import discretise
from host.sysid.numerics.ar_noise import autocovariance
from host.sysid.numerics.fractional_delay import delay_columns, slope_by_delay
from host.sysid.numerics.process_noise import discrete_noise
from scipy import linalg


def test_delay_of_a_cubic_is_exact_and_its_slope_too() -> None:
    time = np.arange(40.0)
    cubic = (0.1 * time**3 - time**2 + 3.0)[:, None]
    for shift in (0.0, 0.3, 1.0, 1.7, -2.4, 60.2, -60.2):
        late, slope = delay_columns(cubic, shift), slope_by_delay(cubic, shift)
        t = time - shift
        np.testing.assert_allclose(late[:, 0], 0.1 * t**3 - t**2 + 3.0, rtol=1e-10, atol=1e-9)
        np.testing.assert_allclose(slope[:, 0], -(0.3 * t**2 - 2.0 * t), rtol=1e-9, atol=1e-8)


def test_noise_of_poles_next_to_one_has_a_positive_variance() -> None:
    """What a fit left of a record without noise had -7e14; `host identify` ended in a traceback."""
    poles = [0.99661, 0.99661, 0.99561, 0.99561, 0.999, 0.99663]
    found = autocovariance(-np.poly(poles)[1:], 200)
    assert found[0] > 0.0
    assert np.linalg.eigvalsh(linalg.toeplitz(found)).min() > -1e-9 * found[0]


def test_noise_of_what_dies_away_within_a_sample_is_that_of_a_steady_state() -> None:
    """The exponential behind it grows as fast as states decay: at e^37 all of it was rounding, one
    entry eight times too large."""
    A, intensity = np.array([[-16.0, -16.0], [0.0, -1860.0]]), np.array([0.0, 0.12])
    F, Q = discrete_noise(A, intensity, 0.02)
    steady = linalg.solve_continuous_lyapunov(A, -np.diag(intensity))
    np.testing.assert_allclose(F, linalg.expm(0.02 * A), atol=1e-14)
    np.testing.assert_allclose(Q, steady - F @ steady @ F.T, rtol=1e-9)


def test_noise_of_a_model_that_diverges_within_a_sample_says_nothing() -> None:
    """A search tries such models; a user saw two warnings of numpy on the terminal."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _, Q = discrete_noise(np.diag([5e4, -5e4]), np.ones(2), 0.02)
    assert not np.isfinite(Q).all()


def test_what_a_search_tries_far_away_warns_of_nothing() -> None:
    """A person saw numpy's warning of a matrix product in the answer to a real record."""
    index = np.zeros(1, dtype=np.int64)
    far = np.array([[-1e160, 1e160, 0.0, 0.0], [1e160, -1e160, 1.0, 0.0]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        E, slopes = discretise(far, 2, 1, False, 0.02, index, index, index, np.ones(1), 1)
    assert not np.all(np.isfinite(E))
    assert not np.all(np.isfinite(slopes))
