"""Strength of the vertical gust by the residuals; thrust at the airspeed it is corrected to."""

import numpy as np
import pytest
from host.aircraft.air import Turbulence, gusts
from host.aircraft.powerplant import powerplant
from host.sysid.coefficients.vertical_gust import vertical_gust_mps

NAME = "ultrastick25e"
AIRSPEED_MPS, STEP_S = 20.0, 0.03
SIGMA_MPS = 0.3


def test_fast_gusts_tell_how_strong_all_are() -> None:
    """By 80 minutes of the twin's own Dryden gusts, at the rate of the fit."""
    ten = round(STEP_S / 0.003)
    noise = np.random.default_rng(5).standard_normal((160_000 * ten, 4))
    dryden = Turbulence(0.41, SIGMA_MPS, 260.0, 100.0)
    vertical = gusts(dryden, noise, AIRSPEED_MPS, 1.26, 0.003)[::ten, 2]
    rate = np.diff(vertical) / STEP_S
    parts = rate[: len(rate) // 800 * 800].reshape(-1, 800)
    power = np.mean(np.abs(np.fft.rfft(parts, axis=1)) ** 2, axis=0) / 800
    hertz = np.fft.rfftfreq(800, STEP_S)
    kept = (hertz > 0.4) & (hertz < 4.5)
    found = vertical_gust_mps(power[kept], AIRSPEED_MPS, STEP_S)
    assert found == pytest.approx(SIGMA_MPS, rel=0.1)


def test_thrust_follows_the_airspeed_it_is_corrected_to() -> None:
    plant, n = powerplant(NAME), 400
    throttle, air = 0.72, 1.21

    def thrust(airspeed_mps: float, density_kgpm3: float) -> float:
        around, density = np.full(n, airspeed_mps), np.full(n, density_kgpm3)
        return float(plant.run(np.full(n, throttle), around, density, 0.03)[0][-1])

    by_speed, by_density = plant.settled_slopes(throttle, AIRSPEED_MPS, air)
    still = thrust(AIRSPEED_MPS, air)
    assert thrust(1.02 * AIRSPEED_MPS, air) - still == pytest.approx(
        0.02 * AIRSPEED_MPS * by_speed, rel=0.05
    )
    assert thrust(AIRSPEED_MPS, 1.03 * air) - still == pytest.approx(0.03 * by_density, rel=0.05)
    assert by_speed < -0.1
