"""The elevator's drag holds its truth, whether or not the lift of pitching drags."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from host.readers.even_grid import even_columns
from host.sysid.pipeline import Identification, at_hand, identify_columns
from host.twin.testcard.cards import load
from host.twin.virtual import virtual_flight
from studies.judgement import trainer_flights

NAME, DIRECT = "ultrastick25e", "coefficients"
CALM = 207  # no gusts: what is off is no accident of them


def lift_of_pitching_drags() -> tuple[Identification, float]:
    """A trainer of another simulator, whose drag follows all lift."""
    flown = trainer_flights.with_file(CALM, DIRECT)
    return flown.identify(), flown.truth["maneuver"][0]["derivatives"]["CD_de"]


def lift_of_pitching_does_not() -> tuple[Identification, float]:
    """The twin, whose polar has alpha and elevator alone; elevator maneuvers tell no tilt."""
    card = load("multisine")
    nominal = replace(card, sensors=replace(card.sensors, tolerances=False))
    flight = virtual_flight(nominal, 8, chain="none")
    table, _ = even_columns(flight.table)
    [along] = [m for m in flight.maneuvers if m["axes"] == ["elevator"]][:1]
    return identify_columns(at_hand(table, aircraft=NAME), models=DIRECT), along["derivatives"][
        "CD_de"
    ]


@pytest.mark.parametrize("fly", [lift_of_pitching_drags, lift_of_pitching_does_not])
def test_drag_of_the_elevator(fly: Callable[[], tuple[Identification, float]]) -> None:
    found, true = fly()
    assert found.coefficients is not None
    [drag] = [d for d in found.coefficients.fit.derivatives if d.name == "CD_de"]
    assert abs(drag.value - true) < 1.1 * drag.half_width
    assert drag.half_width < 0.7 * abs(true)
