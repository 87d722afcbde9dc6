"""A pilot who takes over is told from a test input, and accuses no right model."""

import pytest
from host.arrays import Array
from host.instrument.instrument_errors import usual_errors
from host.physical.recording import FOREIGN
from host.sysid.maneuvers import detect_maneuvers
from host.sysid.maneuvers.pilot_takeover import taken_over
from studies import independent
from studies.foreign.flight import INPUTS

from tests.host.sysid.at_hand import identify

ROLLING = independent.cells()["dryden, fixed, spread, 1 m/s"]


def test_a_pilot_who_takes_over_is_told_from_a_test_input() -> None:
    """The independent simulator's pilot levels at 6.5 s after the beginning of every input."""
    columns = independent.flown(ROLLING, 901)
    begun = [start_s for _, start_s, *_ in INPUTS]
    found: dict[bool, list[bool]] = {True: [], False: []}
    for maneuver in detect_maneuvers(columns):
        commanded = min(abs(maneuver.start_s - s) for s in begun) < 0.06
        if commanded or maneuver.axis == "aileron_rad":
            found[commanded].append(taken_over(columns, maneuver, ("aileron_rad", "rudder_rad")))
    assert not any(found[True])
    assert len(found[True]) >= 8
    assert sum(found[False]) >= 0.7 * len(found[False]) >= 4


@pytest.mark.costs(
    20, "a whole flight in which only taking over shows a lag: no shorter one is known"
)
def test_what_only_his_taking_over_shows_widens_nothing() -> None:
    """A lag of the aileron was suspected, and L_p known to 36 % where 17 are due."""
    airspeed = usual_errors(FOREIGN).scaled(0.0, "pitot_scale", "pitot_zero_pa", "density_share")
    columns: dict[str, Array] = dict(independent.flown(ROLLING, 18609))
    [answer] = identify(columns, names=("lateral",), maker=FOREIGN, errors=airspeed)
    half = answer.result.half_width()[answer.result.index("L_p")]
    assert half / abs(answer.result.value("L_p")) < 0.2
