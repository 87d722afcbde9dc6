"""What no derivative shows: slope and lag of surfaces, and how changes of all kinds are named."""

import numpy as np
import pytest
from host.arrays import Array
from host.fleet.statistics.change_causes import cause_patterns, size_text
from host.fleet.statistics.changes import BASELINE, ChangeTest
from host.fleet.statistics.loaded_flight import LoadedFlight
from host.fleet.statistics.watched_quantities import flight_spread, with_watched
from host.fleet.tasks.surface_response import surface_quantities, surface_response
from host.sysid.reconstruction.servo_response import servo_response
from studies.fleet_changes import Watched


def sticks(seed: int, count: int = 3000) -> tuple[Array, Array]:
    """Return times and a pulse that a hand moves."""
    rng = np.random.default_rng(seed)
    t = 0.01 * np.arange(count)
    held: Array = np.repeat(rng.uniform(-60.0, 60.0, count // 40 + 1), 40)[:count]
    return t, 1500.0 + np.convolve(held, np.ones(10) / 10.0, mode="same")


@pytest.mark.parametrize(("slope", "lag_s"), [(1.1e-3, 0.012), (-0.9e-3, 0.046)])
def test_slope_and_lag_of_a_surface_are_found(slope: float, lag_s: float) -> None:
    t, pulse = sticks(1)
    noise = 0.002 * np.random.default_rng(2).standard_normal(len(t))
    position = 0.03 + slope * (np.interp(t - lag_s, t, pulse) - 1500.0) + noise
    found = surface_response(t, pulse, position)
    assert found is not None
    assert abs(found.slope - slope) < 4.0 * found.slope_sd < 0.05 * abs(slope)
    assert abs(found.lag_s - lag_s) < 4.0 * found.lag_sd_s + 0.0005


def test_a_slower_servo_is_later_and_its_throw_the_same() -> None:
    t, pulse = sticks(3)
    fast, slow = (
        surface_response(t, pulse, servo_response(1e-3 * (pulse - 1500.0), 0.01, hz, 5.0))
        for hz in (8.0, 4.0)
    )
    assert fast is not None
    assert slow is not None
    # A first order is late by 1 / (2 pi f): 20 and 40 ms.
    assert slow.lag_s - fast.lag_s == pytest.approx(0.020, abs=0.005)
    assert slow.slope == pytest.approx(fast.slope, rel=0.03)


def test_ailerons_are_half_the_difference_and_still_sticks_tell_nothing() -> None:
    t, pulse = sticks(4)
    angle, none = 1e-3 * (pulse - 1500.0), np.full(len(t), np.nan)
    table = {
        "t_s": t, "aileron_left_rad": angle, "aileron_right_rad": -angle, "rc_aileron_us": pulse,
        "servo_aileron_us": none, "mega_drives": np.zeros(len(t)), "elevator_pot_rad": angle,
        "rc_elevator_us": np.full(len(t), 1500.0), "servo_elevator_us": pulse,
    }  # fmt: skip
    found = surface_quantities(table)
    assert found["aileron_slope"][0] == pytest.approx(1e-3)
    assert set(found) == {"aileron_slope", "aileron_lag_s"}
    # Where the Mega drives, its own pulses are the command.
    driven = surface_quantities({**table, "mega_drives": np.ones(len(t))})
    assert set(driven) == {"elevator_slope", "elevator_lag_s"}


def test_a_throw_shows_in_the_slope_where_a_pot_measures_and_in_derivatives_where_none() -> None:
    names, usual = ("Cm_de", "elevator_slope"), {"Cm_de": -1.3, "elevator_slope": 1e-3}
    pots = cause_patterns(names, usual, 0.2)
    assert pots["throw of the elevator"].tolist() == [0.0, 1e-3]
    assert pots["pot of the elevator"].tolist() == [1.3, 1e-3]
    plain = cause_patterns(names[:1], usual, 0.2)
    assert plain["throw of the elevator"].tolist() == [-1.3]
    assert "pot of the elevator" not in plain


@pytest.mark.parametrize(
    ("cause", "size", "said"),
    [
        ("zero of the alpha vane", 0.0175, "+1.00 deg"),
        ("lag of the rudder", -0.01, "-10.0 ms"),
        ("throw of the elevator", 0.15, "+15.0 %"),
        ("place of the CG", 0.05, "+5.0 % of the chord"),
    ],
)
def test_changes_of_every_kind_are_named(cause: str, size: float, said: str) -> None:
    kind = Watched()
    rng = np.random.default_rng(22_950)
    values = kind.random_estimates(rng, BASELINE + 3)
    values[BASELINE:] += size * kind.patterns()[cause]
    test = ChangeTest(kind.patterns(), np.zeros(len(kind.usual)))
    last = test.alarms(list(values), [kind.full] * len(values))[-1]
    assert last.cause == cause
    assert last.size == pytest.approx(size, rel=0.5)
    moved = [list(kind.usual)[k] for k in last.moved]
    assert any(kind.patterns()[cause][list(kind.usual).index(name)] for name in moved[:2])
    assert size_text(cause, size) == said


def test_the_spread_between_flights_is_told_by_the_first_flights() -> None:
    rng, names = np.random.default_rng(5), ("Cm_q",)
    flights = [
        LoadedFlight(
            f"N{k % 20}", names, -10.0 + 0.5 * rng.standard_normal(1), np.array([[0.09]]), (),
            np.zeros((0, 1)),
            watched={"rudder_lag_s": (0.02 + 0.001 * rng.standard_normal(), 0.0005)},
        )
        for k in range(160)
    ]  # fmt: skip
    assert flight_spread(flights, "Cm_q") == pytest.approx(0.4, abs=0.06)
    both = [with_watched(f) for f in flights]
    assert flight_spread(both, "rudder_lag_s") == pytest.approx(8.7e-4, rel=0.15)
    assert flight_spread(both[:1], "rudder_lag_s") == 0.0
