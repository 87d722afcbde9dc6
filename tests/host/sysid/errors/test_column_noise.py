"""Noise of measured columns that drive equations is in the intervals of output error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from host.sysid.errors.column_noise import column_noise
from host.sysid.estimators import fit
from host.sysid.models import Maneuver, Trim, equations_from

pytestmark = pytest.mark.usefixtures("interpreted")

DT_S, SAMPLES, GYRO, ATTITUDE = 0.04, 100, 0.05, 0.002
PITCH = equations_from(
    {
        "kind": "equations",
        "inputs": ["elevator_rad"],
        "columns": ["q_radps"],
        "rates": {"theta_rad": "q_radps - q_bias_radps + 0*elevator_rad"},
        "outputs": {"theta_rad": "theta_rad"},
        "parameters": {"q_bias_radps": 0.0},
    }
)
TRIM = Trim(17.0, 0.1, 0.1)


def record(seed: int, gyro: float = GYRO) -> Maneuver:
    """Return 4 s in which the attitude swings, of a gyro with noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(SAMPLES) * DT_S
    q = 0.3 * np.cos(2.0 * t) + gyro * rng.standard_normal(SAMPLES)
    theta = 0.15 * np.sin(2.0 * t) + ATTITUDE * rng.standard_normal(SAMPLES)
    return Maneuver(DT_S, np.column_stack([np.zeros(SAMPLES), q]), theta[:, None])


def test_the_zero_of_a_noisy_gyro_is_held() -> None:
    """The attitude integrates the gyro's noise: without it 5 of 12 intervals held."""
    found, bare, counted = [], [], []
    for seed in range(8):
        data = [record(seed)]
        plain = fit("output-error-white", PITCH, data)
        found.append(plain.estimate[0])
        bare.append(plain.standard_error[0])
        added = column_noise(plain, data, TRIM)[0, 0]
        counted.append(np.hypot(plain.standard_error[0], np.sqrt(added)))
    scatter = np.sqrt(np.mean(np.square(found)))
    assert np.median(bare) < 0.5 * scatter
    assert 0.6 < np.median(counted) / scatter < 1.7


def test_a_clean_column_a_surface_and_a_filter_add_nothing() -> None:
    clean = [record(1, gyro=0.0)]
    plain = fit("output-error-white", PITCH, clean)
    added = column_noise(plain, clean, TRIM)[0, 0]
    assert added < 0.1 * plain.covariance[0, 0]
    innovations = replace(plain, residual_kind="innovation")
    assert not np.any(column_noise(innovations, [record(1)], TRIM))
