"""Slow gusts that the turning aircraft takes along: columns, strength and statistics."""

import numpy as np
import pytest
from host.aircraft.air import Turbulence, gusts
from host.aircraft.mass_properties import airframe_data
from host.aircraft.powerplant import powerplant
from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.sysid.coefficients import Window, standard_model, window_transform
from host.sysid.coefficients.aero_equations import FlightHistory, equations
from host.sysid.coefficients.slow_gusts import (
    GUST_TERMS,
    LEGENDRE_TERMS,
    gust_information,
    gust_regressors,
    gust_strength,
)
from host.sysid.reconstruction import Record

NAME = "ultrastick25e"
AIRSPEED_MPS, STEP_S = 20.0, 0.03
SIGMA = {"u": 0.41, "w": 0.3}
PLACE = {"u": 0, "w": 2}
FORCES = ("CL", "CD")


@pytest.fixture(scope="module")
def air() -> Array:
    """80 minutes of the twin's own Dryden gusts, (n, 6), at the rate of the fit."""
    ten = round(STEP_S / 0.003)
    noise = np.random.default_rng(5).standard_normal((160_000 * ten, 4))
    dryden = Turbulence(SIGMA["u"], SIGMA["w"], 260.0, 100.0)
    return gusts(dryden, noise, AIRSPEED_MPS, 1.26, 0.003)[::ten]


def smooth(random: np.random.Generator, size: float, n: int) -> Array:
    at = np.arange(n) * STEP_S
    waves = [np.sin(2.0 * np.pi * (f * at + random.uniform())) for f in random.uniform(0.2, 2.0, 5)]
    return np.asarray(size * np.mean(waves, axis=0))


@pytest.mark.parametrize("name", sorted(GUST_TERMS))
def test_columns_are_what_a_gust_in_body_axes_leaves_of_the_kinematics(name: str) -> None:
    random, n = np.random.default_rng(3), 800
    record = Record(STEP_S, {"alpha_rad": np.zeros(n)})
    rates = {k: smooth(random, 0.5, n) for k in "pqr"}
    V = AIRSPEED_MPS + smooth(random, 0.5, n)
    alpha, beta = 0.1 + smooth(random, 0.05, n), smooth(random, 0.05, n)
    through = np.stack(
        [V * np.cos(alpha) * np.cos(beta), V * np.sin(beta), V * np.sin(alpha) * np.cos(beta)]
    )
    omega = np.stack([rates[k] for k in "pqr"])
    gust = {"u": 0.3, "w": -0.2}
    over_ground = through + np.array([[gust["u"]], [0.0], [gust["w"]]])
    rising = np.stack([record.rate(x) for x in through])
    force = rising + np.cross(omega, over_ground, axis=0)
    force[2] -= GRAVITY_MPS2
    still = dict.fromkeys(("pd", "qd", "rd", "de", "da", "dr"), np.zeros(n))
    signals = rates | still | {
        "V": V, "qbar": 0.6 * V**2, "alpha": alpha, "beta": beta,
        "ax": force[0], "ay": force[1], "az": force[2],
    }  # fmt: skip
    none = np.zeros(n)
    names = (
        "mass_share", "ixx_share", "iyy_share", "izz_share", "thrust_share", "density_share",
        "cg_x_m", "cg_y_m", "cg_z_m",
    )  # fmt: skip
    rows = equations(
        standard_model(), record, signals, dict.fromkeys(names, 0.0),
        FlightHistory(none, none, none, none, none, none, none, (0.0, 0.0)),
        airframe_data(NAME), powerplant(NAME), 0.1,
    ).by_name  # fmt: skip
    block = window_transform(np.arange(n), STEP_S, Window(0.0, 1.0, name != "v"), FORCES)
    columns = gust_regressors(rates, [block])[name, 0][:, ::LEGENDRE_TERMS]
    left = rows[name].response - rows[name].response.mean()
    expected = columns @ np.array([gust[g] for _, _, g in GUST_TERMS[name]])
    np.testing.assert_allclose(
        block.cosines @ left - 1j * (block.sines @ left), expected, atol=1e-9
    )
    assert np.abs(expected).max() > 0.1


def test_fast_gusts_tell_how_strong_slow_ones_are(air: Array) -> None:
    noise = {}
    for gust, k in PLACE.items():
        rate = np.diff(air[:, k]) / STEP_S
        parts = rate[: len(rate) // 800 * 800].reshape(-1, 800)
        power = np.mean(np.abs(np.fft.rfft(parts, axis=1)) ** 2, axis=0) / 800
        hertz = np.fft.rfftfreq(800, STEP_S)
        kept = (hertz > 0.4) & (hertz < 4.5)
        noise[gust] = (hertz[kept], power[kept])
    found = gust_strength(noise, AIRSPEED_MPS, STEP_S)
    for gust, sigma in SIGMA.items():
        assert found[gust] == pytest.approx(sigma, rel=0.1), gust


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


def test_maneuvers_of_all_axes_at_one_time_meet_one_gust() -> None:
    """As multisines on three axes: the vertical gust of both is the same, and can be inverted."""
    at = np.arange(600)
    blocks = [
        window_transform(at, STEP_S, Window(0.0, 12.0, longitudinal), FORCES)
        for longitudinal in (True, False)
    ]
    known = np.linalg.inv(gust_information(blocks, SIGMA, AIRSPEED_MPS, STEP_S))
    of = [
        gust
        for block in blocks
        for name in block.equations
        if name in GUST_TERMS
        for _, _, gust in GUST_TERMS[name]
    ]
    first, last = (of.index("w"), len(of) - 1 - of[::-1].index("w"))
    assert first < last
    shapes = [slice(k * LEGENDRE_TERMS, (k + 1) * LEGENDRE_TERMS) for k in (first, last)]
    own, across = known[shapes[0], shapes[0]], known[shapes[0], shapes[1]]
    np.testing.assert_allclose(across, own, rtol=1e-3, atol=1e-3 * own.max())
