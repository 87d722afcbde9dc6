"""Values that cannot be are named, values that can be are not."""

import numpy as np
import pytest
from host.live.doubtful_values import DoubtfulValues
from host.live.height_over_start import HeightOverStart

from tests.host.live.test_flight_state import flown


def named(gps_height_m: float = 0.0, **values: float) -> list[str]:
    doubts = DoubtfulValues()
    noise = np.random.default_rng(3).normal(0.0, 2.0, 60)
    doubts.take(flown(60, **{name: value + noise for name, value in values.items()}).rows)
    return [one["text"] for one in doubts.named(gps_height_m)]


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"airspeed_b_mps": -8.0}, "right pitot says -8 m/s"),
        ({"beta_a_deg": 140.0}, "left beta vane says 140 deg"),
        ({"altitude_m": 30_000.0}, "barometer says 30000 m above the sea"),
        ({"height_m": -113.0}, "barometer says -113 m over the start, GPS 0 m"),
    ],
)
def test_what_cannot_be_is_named(values: dict[str, float], says: str) -> None:
    (text,) = named(**values)
    assert text.startswith(says)


def test_noise_at_rest_a_high_barometer_and_a_climb_are_none() -> None:
    assert named(airspeed_a_mps=-2.0, altitude_m=-113.0) == []
    assert named(gps_height_m=110.0, height_m=100.0, airspeed_a_mps=17.0, beta_b_deg=-20.0) == []
    assert named(gps_height_m=np.nan, height_m=100.0) == []
    assert DoubtfulValues().named() == []


def test_height_counts_from_the_first_altitude_in_portions_of_any_size() -> None:
    altitude = np.array([np.nan, -113.0, -112.0, np.nan, -13.0])
    whole = HeightOverStart().of(altitude)
    np.testing.assert_array_equal(whole, [np.nan, 0.0, 1.0, np.nan, 100.0])
    one = HeightOverStart()
    parts = [one.of(altitude[at : at + 1]) for at in range(5)]
    np.testing.assert_array_equal(np.concatenate(parts), whole)
