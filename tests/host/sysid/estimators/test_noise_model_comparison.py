"""Filter error asks whether sensors with a memory explain the data better than moving air."""

import numpy as np
from host.sysid import Maneuver, fit
from studies.coverage import NOISES, coloured_noise
from studies.data import TRUTH, clean, gusty, noisy
from studies.navion import navion_structured


def remembering(seed: int) -> Maneuver:
    u, y = clean(0.02)
    deviation = np.sqrt(np.mean(y**2, axis=0) / 10.0)
    noise = coloured_noise(np.random.default_rng(seed), NOISES["AR(1) 0.9"], len(u), deviation)
    return Maneuver(0.02, u, y + noise)


def test_sensor_noise_with_a_memory_is_named_and_its_intervals_hold() -> None:
    held, narrow = [], []
    for seed in range(3):
        result = fit("filter-error", navion_structured(), [remembering(seed)])
        assert "use output-error" in result.warnings[-1]
        assert result.details["bic_over_coloured_noise"] > 100.0
        miss = np.abs(result.estimate[:9] - TRUTH)
        held.append(miss <= result.half_width()[:9])
        narrow.append(miss <= 1.96 * np.sqrt(np.diag(result.covariance_white)[:9]))
    assert np.mean(held) > 0.85
    assert np.mean(narrow) < 0.75


def test_gusts_and_white_noise_leave_filter_error_as_it_is() -> None:
    for maneuver, what in ((gusty(1, 0.02), "gusts"), (noisy(5, 0.02), "white")):
        asked = fit("filter-error", navion_structured(), [maneuver])
        alone = fit("filter-error", navion_structured(), [maneuver], compare_noise=False)
        assert not any("use output-error" in w for w in asked.warnings), what
        np.testing.assert_array_equal(asked.covariance, alone.covariance)
        if what == "gusts":
            assert asked.details["bic_over_coloured_noise"] < -100.0
