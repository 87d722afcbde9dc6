"""Pulses behind the printed surfaces, against the thesis's maps forwards."""

import numpy as np
import pytest
from host.original.printed_pulses import (
    RANGE_US,
    printed_of_servo,
    servo_of_stick_us,
    servo_us_of_printed,
    stick_us_of_servo,
)


@pytest.mark.parametrize("surface", RANGE_US)
def test_a_pulse_comes_back_from_what_is_printed(surface: str) -> None:
    stick_us = np.arange(1000.0, 2001.0)
    servo_us = servo_of_stick_us(stick_us, surface)
    printed = np.round(printed_of_servo(servo_us, surface), 2)
    found = servo_us_of_printed(printed, surface)
    known = np.isfinite(found)
    np.testing.assert_allclose(found[known], servo_us[known], atol=0.2)
    np.testing.assert_allclose(stick_us_of_servo(found[known], surface), stick_us[known], atol=1.2)
    if surface == "rudder":  # its lines overlap: printed for two pulses
        assert np.all(np.diff(servo_us[~known]) < 62.0)
        assert 0.02 < np.mean(~known) < 0.1
    else:
        assert known.all()


def test_what_no_pulse_gives_is_none() -> None:
    assert np.isnan(servo_us_of_printed(np.array([500.0, -150.0, np.nan]), "elevator")).all()
    assert np.isnan(servo_us_of_printed(np.array([-2297.0]), "throttle")).all()
