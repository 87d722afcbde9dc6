"""What an input follows is found where no signal tells it alone."""

import numpy as np
import pytest
from host.sysid.numerics.state_feedback import feedback_law
from scipy import signal

DT_S, SAMPLES = 0.02, 1500


def test_signals_that_only_tell_together_are_found() -> None:
    """Heading, bank and roll rate of an autopilot: a yaw rate that looks alike stood for them."""
    rng = np.random.default_rng(17000)
    noise = np.convolve(rng.standard_normal(SAMPLES + 9), np.full(10, 0.1), mode="valid")
    slow = 5.0 * np.sin(0.4 * np.arange(SAMPLES) * DT_S)
    wanted = np.convolve(rng.standard_normal(SAMPLES + 9), np.full(10, 0.1), mode="valid")
    signals = {"alike": wanted + 0.25 * noise, "both": slow + wanted, "slow": slow}
    law = feedback_law(DT_S, 0.5 * wanted, signals, [np.arange(100, SAMPLES)])
    assert law is not None
    assert set(law.signals) == {"both", "slow"}
    gains = dict(zip(law.signals, law.gains, strict=True))
    np.testing.assert_allclose([gains["both"], gains["slow"]], [0.5, -0.5], rtol=1e-3)
    assert law.r2 > 0.999


@pytest.mark.parametrize(("lag_s", "washout_s"), [(0.3, 2.0), (0.2, 1.4)])
@pytest.mark.parametrize("dt_s", [0.01, 0.02, 0.03])
def test_a_lag_and_a_wash_out_behind_each_other_are_found(
    dt_s: float, lag_s: float, washout_s: float
) -> None:
    """A yaw damper with both, as scipy filters it; the first pair is one of the grid."""
    rng = np.random.default_rng(17001)
    count = round(30.0 / dt_s)
    q = signal.lfilter([1.0], [1.0, -np.exp(-dt_s / 0.3)], rng.standard_normal(count))
    law_of_s = [washout_s, 0.0], np.polymul([lag_s, 1.0], [washout_s, 1.0])
    numerator, denominator = signal.bilinear(*law_of_s, fs=1.0 / dt_s)
    late = round(0.06 / dt_s)
    u = 0.7 * np.concatenate([np.zeros(late), signal.lfilter(numerator, denominator, q)[:-late]])
    other = rng.standard_normal(count)
    law = feedback_law(dt_s, u, {"other": other, "q": q}, [np.arange(count)])
    assert law is not None
    assert law.signals == ("q",)
    found = (law.gains[0], law.delay_s, law.lag_s, law.washout_s)
    np.testing.assert_allclose(found, (0.7, 0.06, lag_s, washout_s), rtol=0.02)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_that_is_in_no_input_hides_no_law_and_shared_noise_makes_none(seed: int) -> None:
    """Half as large as the signal it makes R2 0.8 and the gain 0.8 of itself; both are mended."""
    rng = np.random.default_rng(seed)
    q = signal.lfilter([1.0], [1.0, -np.exp(-DT_S / 0.3)], rng.standard_normal(SAMPLES))
    q /= np.std(q)
    noise = 0.5 * rng.standard_normal(SAMPLES)
    u = 0.7 * np.concatenate([np.zeros(3), q[:-3]]) + 0.02 * rng.standard_normal(SAMPLES)
    windows = [np.arange(SAMPLES)]
    assert feedback_law(DT_S, u, {"q": q + noise}, windows) is None
    law = feedback_law(DT_S, u, {"q": q + noise}, windows, (0.02, 0.5))
    assert law is not None
    np.testing.assert_allclose((law.gains[0], law.delay_s), (0.7, 0.06), atol=0.02)
    # A law that acts on what is logged has its noise in the input.
    u = 0.7 * np.concatenate([np.zeros(3), (q + noise)[:-3]])
    law = feedback_law(DT_S, u, {"q": q + noise}, windows, (0.35, 0.5))
    assert law is not None
    np.testing.assert_allclose((law.gains[0], law.delay_s), (0.7, 0.06), atol=0.02)
