"""The elevator's drag holds its truth, whether or not the lift of pitching drags."""

from collections.abc import Callable, Mapping

import pytest
from host.readers.even_grid import even_columns
from host.sysid.pipeline import Identification, at_hand, identify_columns
from studies.judgement import trainer_flights

from tests.host.sysid.recorded import NAME, nominal_multisine

DIRECT = "coefficients"
CALM = 207  # no gusts: what is off is no accident of them


def lift_of_pitching_drags() -> tuple[Identification, float]:
    """A trainer of another simulator, whose drag follows all lift."""
    flown = trainer_flights.with_file(CALM, DIRECT)
    return flown.identify(), flown.truth["maneuver"][0]["derivatives"]["CD_de"]


def lift_of_pitching_does_not() -> tuple[Identification, float]:
    """The twin, whose polar has alpha and elevator alone; elevator maneuvers tell no tilt."""
    flight = nominal_multisine()
    table, _ = even_columns(flight.table)
    [local, *_] = [m["derivatives"] for m in flight.maneuvers if m["axes"] == ["elevator"]]
    assert isinstance(local, Mapping)
    return identify_columns(at_hand(table, aircraft=NAME), models=DIRECT), local["CD_de"]


@pytest.mark.parametrize("fly", [lift_of_pitching_drags, lift_of_pitching_does_not])
def test_drag_of_the_elevator(fly: Callable[[], tuple[Identification, float]]) -> None:
    found, true = fly()
    assert found.coefficients is not None
    [drag] = [d for d in found.coefficients.fit.derivatives if d.name == "CD_de"]
    assert abs(drag.value - true) < 1.1 * drag.half_width
    assert drag.half_width < 0.7 * abs(true)
