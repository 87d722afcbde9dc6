"""The firmware's attitude filter against virtual flights' truth and the original algorithm."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.attitude import dcm, flights, library
from tests.attitude.flights import Flown


@pytest.fixture(scope="module", params=["turns", "inputs", "thermals"])
def flown(request: pytest.FixtureRequest) -> Flown:
    return flights.fly_card(str(request.param), 1)


@pytest.mark.parametrize("source", flights.SPEEDS)
def test_roll_and_pitch_are_better_than_the_original(flown: Flown, source: str) -> None:
    mine, original = flights.judge(flown, source)
    assert np.all(mine.rms_deg[:2] < 0.6 * original.rms_deg[:2])
    assert np.all(mine.rms_deg[:2] < 2.5)
    assert np.all(mine.rms_deg < original.rms_deg)


def test_the_steep_card_reaches_sixty_degrees() -> None:
    bank_deg = np.rad2deg(flights.fly_card("turns", 1).true_rad[:, 0])
    assert bank_deg.max() > 58.0
    assert bank_deg.min() < -55.0


def test_the_gyro_bias_is_found_before_take_off() -> None:
    flown = flights.fly_card("inputs", 2)
    estimate = flights.ours(flown)
    before = np.searchsorted(flown.t_s, flown.record.card.flight.ground_s - 0.5)
    true = flown.record.draws.vector("gyro_bias_radps")
    found = estimate.bias_radps[before]
    assert np.abs(np.rad2deg(true)).max() > 0.1
    np.testing.assert_allclose(np.rad2deg(found), np.rad2deg(true), atol=0.03)


def test_a_wrong_sign_of_the_turn_would_show() -> None:
    flown = flights.fly_card("turns", 1)
    raw = flown.raw.copy()
    raw[:, 5] = -raw[:, 5]
    wrong = Flown(
        flown.record, flown.data, flown.t_s, flown.true_rad, raw, flown.field, flown.judged
    )
    estimate = flights.ours(wrong).angles_rad[flown.judged]
    assert flights.errors(estimate, flown.true_rad[flown.judged]).rms_deg[0] > 20.0


def test_exact_rates_keep_the_attitude_of_a_tumbling_body() -> None:
    """Gyro alone through 60 s of known coning motion: drift of the arithmetic, nothing else."""
    dt_s, count = 0.005, 12000
    t_s = np.arange(count) * dt_s
    shape = (np.sin(1.3 * t_s), np.cos(0.9 * t_s), np.sin(0.4 * t_s))
    rates = np.column_stack(shape) * [40.0, 30.0, 20.0]
    settle = 800
    still = np.zeros((settle, 3))
    counts = np.round(np.vstack([still, rates]) * 65.5).astype(np.int16)
    force = np.tile(np.array([0, 0, -8192], np.int16), (settle + count, 1))
    force[settle:] = 32767  # saturated: not used
    none = np.zeros((settle + count, 3), np.int16)
    estimate = library.run(
        counts, force, speed_cmps=np.zeros(settle + count, np.uint16), field=none,
        settings=library.Settings(filter_delay_us=0),
    )  # fmt: skip
    true = _integrate(np.deg2rad(counts[settle:] / 65.5), dt_s)
    off = flights.errors(estimate.angles_rad[settle:], true)
    assert np.all(off.most_deg < 0.3)


def test_the_original_algorithm_finds_level_and_north() -> None:
    """The yardstick itself: at rest, tilted, it ends where gravity and field point."""
    count = 1500
    phi, theta = math.radians(20.0), math.radians(-10.0)
    sp, cp, st, ct = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
    down, north = np.array([-st, sp * ct, cp * ct]), np.array([ct, sp * st, cp * st])
    angles = dcm.run(
        np.zeros((count, 3)), np.tile(-9.81 * down, (count, 1)),
        field=np.tile(30 * north + 32 * down, (count, 1)), declination_rad=0.1,
        speed_mps=np.zeros(count),
    )  # fmt: skip
    np.testing.assert_allclose(angles[-1], [phi, theta, 0.1], atol=5e-3)


def _integrate(rates: flights.Array, dt_s: float) -> flights.Array:
    """Return Euler angles by exact rotations through the mean of two samples."""
    c, out = np.eye(3), np.empty_like(rates)
    last = rates[0] * 0.0
    for i, rate in enumerate(rates):
        turn = (last + rate) / 2 * dt_s
        last = rate
        angle = float(np.linalg.norm(turn))
        axis = turn / angle if angle > 0 else turn
        k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        c = c @ (np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k)
        out[i] = (
            math.atan2(c[2, 1], c[2, 2]), -math.asin(c[2, 0]), math.atan2(c[1, 0], c[0, 0]),
        )  # fmt: skip
    return out
