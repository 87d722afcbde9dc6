"""Noise models and the intervals that stand on them."""

import numpy as np
from host.sysid import fit
from host.sysid.numerics.ar_noise import fit_ar, lagged_moments, stabilise
from scipy import signal
from studies.coverage import coloured_noise
from studies.data import noisy
from studies.navion import navion_structured


def test_given_back_moments_remove_the_bias_of_residuals() -> None:
    rng = np.random.default_rng(3)
    regressors = np.vander(np.linspace(-1.0, 1.0, 120), 9)
    Q, _ = np.linalg.qr(regressors)
    raw, corrected = [], []
    for _ in range(400):
        noise = coloured_noise(rng, np.array([0.8]), 120, np.ones(1))[:, 0]
        residual = noise - Q @ (Q.T @ noise)
        none = np.zeros((120, 1))
        raw.append(fit_ar(lagged_moments([residual], [none], 1), 1)[0][0])
        a = raw[-1]
        for _ in range(8):
            white_Q = Q[1:] - a * Q[:-1]
            white_r = residual[1:] - a * residual[:-1]
            covariance = np.linalg.inv(white_Q.T @ white_Q)
            shift = covariance @ white_Q.T @ white_r
            variance = np.mean((white_r - white_Q @ shift) ** 2)
            share = Q @ np.linalg.cholesky(variance * covariance)
            a = fit_ar(lagged_moments([residual - Q @ shift], [share], 1), 1)[0][0]
        corrected.append(a)
    assert np.mean(raw) < 0.70
    assert np.mean(corrected) > 0.74  # what remains is the bias of 120 samples: (1 + 3a)/N = 0.03


def test_poles_are_kept_inside_the_circle() -> None:
    inside = stabilise(np.array([2.5, -1.4]))
    assert np.max(np.abs(np.roots(np.concatenate([[1.0], -inside])))) < 1.0


def test_the_standard_correction_stays_short_of_the_default() -> None:
    rng = np.random.default_rng(6)
    maneuver = noisy(600)
    colour = signal.lfilter([1.0], [1.0, -0.9], rng.standard_normal(maneuver.outputs.shape), axis=0)
    coloured = type(maneuver)(
        maneuver.dt_s,
        maneuver.inputs,
        maneuver.outputs + colour * maneuver.outputs.std(axis=0) * 0.1,
    )
    default = fit("output-error", navion_structured(), [coloured])
    standard = fit("output-error-white", navion_structured(), [coloured])
    white = np.sqrt(np.diag(standard.covariance_white))
    assert np.median(standard.standard_error / white) > 1.3
    assert np.median(default.half_width() / standard.half_width()) < 1.3
