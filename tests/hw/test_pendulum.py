"""The bifilar pendulum: an aircraft that is swung gives its inertia back, and what may be wrong."""

from __future__ import annotations

import math
import tomllib

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.hw.test_pin_map import load_module

PENDULUM = load_module("calibration/pendulum")
MASS_KG, DISTANCE_M, LENGTH_M = 1.793, 0.62, 1.20


def period_s(inertia_kgm2: float, amplitude_rad: float) -> float:
    """Swing it: exact geometry of two threads, the height given by the twist."""
    half = 0.5 * DISTANCE_M

    def slopes(_: float, state: np.ndarray) -> list[float]:
        angle, rate = state
        height = math.sqrt(LENGTH_M**2 - (2.0 * half * math.sin(0.5 * angle)) ** 2)
        rise = half**2 * math.sin(angle) / height  # of the CG with the angle, per rad
        return [rate, -MASS_KG * 9.80665 * rise / inertia_kgm2]

    def through_zero(_: float, state: np.ndarray) -> float:
        return float(state[0])

    run = solve_ivp(
        slopes, (0.0, 30.0), [amplitude_rad, 0.0], events=through_zero, rtol=1e-9, atol=1e-12
    )
    assert run.t_events is not None
    return float(np.mean(np.diff(run.t_events[0]))) * 2.0


def test_an_inertia_comes_back_from_its_swings() -> None:
    truth = 0.119344
    found = PENDULUM.inertia(MASS_KG, 0.0, [DISTANCE_M, LENGTH_M, *[period_s(truth, 0.02)] * 3])
    assert found.inertia_kgm2 == pytest.approx(truth, rel=1e-4)
    wide = period_s(truth, math.radians(10.0)) / period_s(truth, 0.02) - 1.0
    assert 0.0 < wide < 0.0025


def test_its_tolerance_is_what_the_readings_scatter() -> None:
    rng = np.random.default_rng(5)
    truth, exact = 0.119344, period_s(0.119344, 0.02)
    ratios, shares = [], []
    for _ in range(500):
        numbers = [
            DISTANCE_M + rng.normal(0.0, 0.001),
            LENGTH_M + rng.normal(0.0, 0.001),
            *exact * (1.0 + rng.normal(0.0, 0.01, 4)),
        ]
        air = 1.0 + rng.normal(0.0, PENDULUM.AIR_SHARE)
        found = PENDULUM.inertia(MASS_KG + rng.normal(0.0, 0.005), 0.005, numbers)
        ratios.append(found.inertia_kgm2 * air / truth)
        shares.append(found.sigma_share)
    assert np.mean(shares) == pytest.approx(np.std(ratios), rel=0.1)


SWUNG = [
    "--xx",
    "0.62",
    "1.2",
    "1.20",
    "1.21",
    "1.19",
    "--yy",
    "0.62",
    "1.2",
    "1.55",
    "1.56",
    "1.55",
]
YAW = ["--zz", "0.62", "1.2", "1.80", "1.81", "1.80"]
REST = ["--mass", "1.793", "0.005", "--source", 'bench, "J. Doe"']


def test_the_section_is_that_of_an_aircraft_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert PENDULUM.main([*REST, *SWUNG, *YAW]) == 0
    mass = tomllib.loads(capsys.readouterr().out)["mass"]
    assert mass["ixx_kgm2"] < mass["iyy_kgm2"] < mass["izz_kgm2"]
    assert 0.06 < mass["inertia_tolerance"] < 0.08
    assert mass["source"] == "bench, 'J. Doe'"


@pytest.mark.parametrize(
    ("yaw", "words"),
    [
        (["0.62", "1.2", "1.80", "1.81"], "2 periods"),
        (["0.62", "1.2", "1.80", "2.10", "1.80"], "scatter by"),
        (["0.62", "-1.2", "1.80", "1.81", "1.80"], "above zero"),
        (["0.62", "1.2", "nan", "1.81", "1.80"], "above zero"),
        (["0.62", "1.2", "2.80", "2.81", "2.80"], "exceeds the sum"),
        (["0.62"], "0 periods"),
    ],
)
def test_swings_that_cannot_be_are_refused(
    yaw: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert PENDULUM.main([*REST, *SWUNG, "--zz", *yaw]) == 2
    assert words in capsys.readouterr().err
