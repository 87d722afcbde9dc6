"""A law whose command jumps is found leg by leg."""

import numpy as np
import pytest
from host.sysid.numerics.feedback_legs import SETTLING_S, feedback_legs
from host.sysid.numerics.state_feedback import feedback_law

DT_S, SAMPLES = 0.02, 3000
TURNS_S = (12.0, 33.0, 47.0)
GAINS = {"p": -0.06, "phi": -0.5, "psi": -0.6}


def noise(rng: np.random.Generator, width: int) -> np.ndarray:
    return np.convolve(
        rng.standard_normal(SAMPLES + width - 1), np.full(width, 1.0 / width), "valid"
    )


def tracked(seed: int, limited_s: float) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Ailerons and signals; after each turn bank is at its limit and heading not followed."""
    rng = np.random.default_rng(seed)
    t = DT_S * np.arange(SAMPLES)
    signals = {"p": noise(rng, 10), "phi": noise(rng, 20), "psi": noise(rng, 100)}
    command, followed = np.zeros(SAMPLES), np.ones(SAMPLES)
    for turn_s, jump in zip(TURNS_S, (0.5, -0.8, 0.9), strict=True):
        command[t >= turn_s] += jump
        limited = (t >= turn_s) & (t < turn_s + limited_s)
        followed[limited] = 0.0
        command[limited] += jump
    moved = sum(GAINS[n] * signals[n] * (followed if n == "psi" else 1.0) for n in GAINS)
    return np.roll(moved + command, 2) + 0.002 * rng.standard_normal(SAMPLES), signals


@pytest.mark.parametrize(("seed", "limited_s"), [(17718, 3.0), (17719, 3.0), (17718, 1.2)])
def test_the_law_is_found_within_legs_and_not_without(seed: int, limited_s: float) -> None:
    """Whether bank is at its limit for longer than the shortest leg or not."""
    moved, signals = tracked(seed, limited_s)
    window = [np.arange(50, SAMPLES)]
    assert feedback_law(DT_S, moved, signals, window) is None
    inner = np.column_stack([signals["p"], signals["phi"]])
    legs, resting = feedback_legs(DT_S, moved, inner, signals["psi"], window)
    assert resting is not None
    for turn_s in TURNS_S:
        jump = round(turn_s / DT_S) + 2
        assert not any(leg[0] < jump <= leg[-1] for leg in legs)
        inside = slice(jump + round(SETTLING_S / DT_S), jump + round((limited_s - 0.2) / DT_S))
        assert np.ptp(resting[inside]) == 0.0
    law = feedback_law(DT_S, moved, signals | {"psi": resting}, legs)
    assert law is not None
    assert law.r2 > 0.95
    assert dict(zip(law.signals, law.gains, strict=True)) == pytest.approx(GAINS, rel=0.1)


def test_windows_too_short_or_without_values_have_no_legs() -> None:
    moved, signals = tracked(17720, 3.0)
    inner = np.column_stack([signals["p"], signals["phi"]])
    inner[490:510] = np.nan
    windows = [np.arange(50, 80), np.arange(500, 700)]
    assert feedback_legs(DT_S, moved, inner, None, windows) == ([], None)
