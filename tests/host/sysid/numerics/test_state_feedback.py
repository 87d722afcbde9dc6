"""What an input follows is found where no signal tells it alone."""

import numpy as np
from host.sysid.numerics.state_feedback import feedback_law

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
