"""The air: standard atmosphere, Dryden spectra and intensities."""

from __future__ import annotations

import math

import numpy as np
import pytest
from host.aircraft.air import (
    Air,
    Turbulence,
    atmosphere,
    density_kgpm3,
    gusts,
    static_pressure_pa,
    turbulence,
)
from scipy import signal


def test_standard_atmosphere_at_two_heights() -> None:
    # ICAO Doc 7488: 0 m and 1000 m.
    air = atmosphere(101325.0, 15.0)
    assert static_pressure_pa(air, 0.0) == 101325.0
    assert density_kgpm3(air, 0.0) == pytest.approx(1.225, rel=1e-4)
    assert static_pressure_pa(air, 1000.0) == pytest.approx(89874.6, rel=1e-4)
    assert density_kgpm3(air, 1000.0) == pytest.approx(1.11164, rel=1e-4)


def test_lengths_and_intensities_of_the_military_specification() -> None:
    # MIL-F-8785C 3.7.3 at 328 ft: L_w = h, L_u = h/(0.177+0.000823h)^1.2, ratio ()^-0.4.
    t = turbulence(Air(turbulence_mps=1.0), 100.0)
    assert t.length_w_m == pytest.approx(100.0)
    assert t.length_u_m == pytest.approx(100.0 / 0.44702**1.2, rel=1e-3)
    assert t.sigma_u_mps == pytest.approx(0.44702**-0.4, rel=1e-3)


def test_gusts_have_the_intensity_and_spectrum_asked_for() -> None:
    speed, step = 17.0, 1e-3
    t = Turbulence(sigma_u_mps=0.6, sigma_w_mps=0.4, length_u_m=20.0, length_w_m=10.0)
    noise = np.random.default_rng(7).standard_normal((1_000_000, 4))
    out = gusts(t, noise, speed, 1.26, step)[20_000:]
    # 1000 s hold about 850 correlation times: 3 standard errors of an rms are 8 %.
    assert out[:, 0].std() == pytest.approx(0.6, rel=0.10)
    assert out[:, 1].std() == pytest.approx(0.6, rel=0.10)
    assert out[:, 2].std() == pytest.approx(0.4, rel=0.10)
    # One-sided spectrum of w: sigma^2 tau (1 + 3 x^2) / (1 + x^2)^2 * 2 with x = tau omega.
    f, power = signal.welch(out[:, 2], 1.0 / step, nperseg=65536)
    tau = t.length_w_m / speed
    band = (f > 0.1) & (f < 5.0)
    x = (2 * math.pi * f[band] * tau) ** 2
    expected = 2 * 0.4**2 * tau * (1 + 3 * x) / (1 + x) ** 2
    ratio = power[band] / expected
    assert np.exp(np.mean(np.log(ratio))) == pytest.approx(1.0, abs=0.08)
    # A first-order spectrum of the same intensity would be off by a factor of 3 at its upper end.
    upper = f[band] > 2.0
    assert np.exp(np.mean(np.log(ratio[upper]))) == pytest.approx(1.0, abs=0.12)
    first_order = 2 * 0.4**2 * 2 * tau / (1 + 4 * x)
    wrong = (power[band] / first_order)[upper]
    assert np.exp(np.mean(np.log(wrong))) != pytest.approx(1.0, abs=0.12)


def test_rotary_gusts_are_the_slopes_of_the_linear_ones() -> None:
    t = Turbulence(sigma_u_mps=0.6, sigma_w_mps=0.4, length_u_m=20.0, length_w_m=10.0)
    noise = np.random.default_rng(8).standard_normal((200_000, 4))
    out = gusts(t, noise, 17.0, 1.26, 1e-3)
    tau_b = 4 * 1.26 / (math.pi * 17.0)
    slow_w = signal.lfilter([1e-3 / tau_b], [1.0, -(1.0 - 1e-3 / tau_b)], out[:, 2])
    slope = np.gradient(slow_w, 1e-3)
    # Air that rises ahead (w negative there) turns nose-up: q = -dw/dx = -(dw/dt)/V.
    assert np.corrcoef(out[1000:, 4], -slope[1000:])[0, 1] > 0.98
    assert np.polyfit(slope[1000:], out[1000:, 4], 1)[0] == pytest.approx(-1 / 17.0, rel=0.03)
