"""The bifilar pendulum: an aircraft that is swung gives its inertia back, and what may be wrong."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from host.bench_calibration.bench_plan import subjects
from host.bench_calibration.bifilar_pendulum import inertia
from host.cli import main
from scipy.integrate import solve_ivp

SUBJECT = subjects()["inertia"]
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
    found = inertia(SUBJECT, MASS_KG, 0.0, [DISTANCE_M, LENGTH_M, *[period_s(truth, 0.02)] * 3])
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
        air = 1.0 + rng.normal(0.0, SUBJECT.limits["air"])
        found = inertia(SUBJECT, MASS_KG + rng.normal(0.0, 0.005), 0.005, numbers)
        ratios.append(found.inertia_kgm2 * air / truth)
        shares.append(found.sigma_share)
    assert np.mean(shares) == pytest.approx(np.std(ratios), rel=0.1)


SWUNG = [("xx", 1.20), ("xx", 1.21), ("xx", 1.19), ("yy", 1.55), ("yy", 1.56), ("yy", 1.55)]
YAW = [("zz", 1.80), ("zz", 1.81), ("zz", 1.80)]
MASS = ["--mass", "1.793", "0.005", "--by", 'bench, "J. Doe"', "--date", "2026-11-23"]


def _table(rows: Sequence[tuple[str, float]], length_m: float = LENGTH_M) -> str:
    lines = [f"{axis},{DISTANCE_M},{length_m},{period}" for axis, period in rows]
    return "axis,distance_m,length_m,period_s\n" + "\n".join(lines) + "\n"


def test_the_section_is_that_of_an_aircraft_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "swings.csv"
    path.write_text(_table([*SWUNG, *YAW]))
    assert main(["calibrate", "inertia", str(path), *MASS]) == 0
    mass = tomllib.loads(capsys.readouterr().out)["mass"]
    assert mass["ixx_kgm2"] < mass["iyy_kgm2"] < mass["izz_kgm2"]
    assert 0.06 < mass["inertia_tolerance"] < 0.08
    assert mass["source"] == 'bifilar pendulum, bench, "J. Doe", 2026-11-23'


@pytest.mark.parametrize(
    ("yaw", "words"),
    [
        (YAW[:2], "2 periods"),
        ([("zz", 1.80), ("zz", 2.10), ("zz", 1.80)], "scatter by"),
        ([("zz", -1.80), ("zz", 1.81), ("zz", 1.80)], "above zero"),
        ([("zz", 2.80), ("zz", 2.81), ("zz", 2.80)], "exceeds the sum"),
        ([], "no swings about axis zz"),
        ([("z", 1.80)], "expected xx, yy or zz"),
    ],
)
def test_swings_that_cannot_be_are_refused(
    yaw: list[tuple[str, float]], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "swings.csv"
    path.write_text(_table([*SWUNG, *yaw]))
    assert main(["calibrate", "inertia", str(path), *MASS]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert len(error.splitlines()) == 1
