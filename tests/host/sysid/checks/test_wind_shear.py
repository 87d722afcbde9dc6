"""Wind that changes with height, and gusts along the path, accuse no right forward force."""

import numpy as np
import pytest
from host.constants import GRAVITY_MPS2
from host.sysid.checks import check

Columns = dict[str, np.ndarray]
SPEED_MPS, STEP_S, LONG_S, GUST_M = 150.0, 0.02, 60.0, 250.0
LIFT, LIFT_SLOPE, PITCH, DAMPING, CONTROL = 0.056, 0.7, -1.72, -0.9, -2.0  # rad, 1/s, 1/s2
DRAG, INDUCED = 0.5, 60.0  # m/s2, and the same per rad2 of the angle of attack
NOISE = {"airspeed_mps": 0.3, "alpha_rad": 1.5e-3, "ax_mps2": 0.03, "az_mps2": 0.03}


def elevator(t: float) -> float:
    """Return 3-2-1-1 steps every 19 s, rad."""
    since = ((t - 2.5) % 19.0) / 0.9
    return 0.044 * float(np.select([since < 3, since < 5, since < 6, since < 7], [1, -1, 1, -1], 0))


def record(shear_per_s: float = 0.0, gust_mps: float = 0.0, seed: int = 0) -> Columns:
    """Return an airliner's longitudinal motion; the head wind grows with height by the shear."""
    rng, fade = np.random.default_rng(seed), np.exp(-SPEED_MPS * STEP_S / GUST_M)
    speed, path, theta, q, gust = SPEED_MPS, 0.0, LIFT, 0.0, 0.0
    rows = []
    for t in np.arange(0.0, LONG_S, STEP_S):
        flown = speed + gust
        alpha, control, pressure = theta - path, elevator(t), (flown / SPEED_MPS) ** 2
        lift = pressure * (GRAVITY_MPS2 + SPEED_MPS * LIFT_SLOPE * (alpha - LIFT))
        drag = pressure * (DRAG + INDUCED * alpha**2)
        thrust = DRAG + INDUCED * LIFT**2
        ax = thrust - drag * np.cos(alpha) + lift * np.sin(alpha)
        az = -lift * np.cos(alpha) - drag * np.sin(alpha)
        rows.append((t, flown, alpha, q, theta, ax, az, control))
        along = ax * np.cos(alpha) + az * np.sin(alpha) - GRAVITY_MPS2 * np.sin(path)
        across = ax * np.sin(alpha) - az * np.cos(alpha) - GRAVITY_MPS2 * np.cos(path)
        speed += STEP_S * (along + shear_per_s * speed * np.sin(path))
        path += STEP_S * across / flown
        q += STEP_S * (pressure * (PITCH * (alpha - LIFT) + CONTROL * control) + DAMPING * q)
        theta += STEP_S * q
        gust = fade * gust + gust_mps * np.sqrt(1.0 - fade**2) * rng.standard_normal()
    names = ("t_s", "airspeed_mps", "alpha_rad", "q_radps", "theta_rad", "ax_mps2", "az_mps2")
    columns = dict(zip((*names, "elevator_rad"), np.array(rows).T, strict=True))
    noisy = {
        k: v + NOISE.get(k, 8e-4) * rng.standard_normal(len(v))
        for k, v in columns.items()
        if k not in ("t_s", "elevator_rad")
    }
    return columns | noisy


@pytest.mark.parametrize("shear_per_s", [0.04, 0.12, -0.08])
def test_shear_accuses_no_right_force_and_hides_no_wrong_one(shear_per_s: float) -> None:
    """In wind that grew by 0.04 m/s a metre a right force was turned round."""
    right = record(shear_per_s)
    assert check(right) == []
    [found] = check(right | {"ax_mps2": -right["ax_mps2"]})
    assert found.check == "airspeed-against-ax"
    assert found.wrong_unit
    [found] = check(right | {"ax_mps2": right["ax_mps2"] / GRAVITY_MPS2})
    assert found.wrong_unit


@pytest.mark.parametrize("seed", [0, 1, 10])
def test_gusts_along_the_path_are_no_factor_of_the_force(seed: int) -> None:
    """Speed that moved 1.5 to 1.7 times as fast, known to a fifth, was a finding."""
    assert check(record(gust_mps=0.5, seed=seed)) == []
