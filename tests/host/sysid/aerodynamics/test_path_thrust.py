"""Thrust turns with the aircraft: it is in Z_alpha, and in no coefficient."""

from dataclasses import replace

import numpy as np
import pytest
from host.aircraft.mass_properties import Condition, airframe_data
from host.aircraft.powerplant import powerplant
from host.constants import GRAVITY_MPS2
from host.readers.even_grid import even_columns
from host.sysid.aerodynamics.path_thrust import USUAL_DRAG, path_thrust
from host.sysid.models import Trim
from host.twin.testcard.cards import load
from host.twin.virtual import virtual_flight

from tests.host.sysid.at_hand import identify

NAME = "ultrastick25e"
AIRFRAME, PLANT = airframe_data(NAME), powerplant(NAME)
TRIM, AT = Trim(17.0, 0.09, 0.09), Condition(17.0, 177.0)
FORCE = AT.qbar_pa * AIRFRAME.wing_area_m2


def test_what_turns_with_the_aircraft_is_the_slope_of_the_turned_force() -> None:
    thrust_n, mass = 4.0, AIRFRAME.mass_kg
    cuts = [{"thrust_n": np.full(9, thrust_n), "t_s": np.arange(9.0)}]
    found = path_thrust(cuts, PLANT, AIRFRAME, TRIM, AT).in_derivatives(mass, 17.0)

    def specific(alpha: float) -> np.ndarray:
        """Along the path and normal to it, m/s2."""
        turn = np.array([[np.cos(alpha), np.sin(alpha)], [-np.sin(alpha), np.cos(alpha)]])
        return np.asarray(turn @ (thrust_n * PLANT.axis[[0, 2]]) / mass)

    slope = (specific(0.0901) - specific(0.0899)) / 2e-4
    assert found["D_alpha"] == pytest.approx(slope[0], rel=1e-6)
    assert found["Z_alpha"] == pytest.approx(slope[1] / 17.0, rel=1e-6)


def test_without_a_known_propeller_thrust_is_what_drag_and_path_ask_for() -> None:
    drag = USUAL_DRAG * FORCE / AIRFRAME.mass_kg
    level = np.array([np.sin(0.09), -np.cos(0.09)]) * GRAVITY_MPS2
    glide = level - drag * np.array([np.cos(0.09), np.sin(0.09)])
    found = []
    for ax, az in (level, glide):
        cut = {"ax_mps2": np.full(9, ax), "az_mps2": np.full(9, az), "t_s": np.arange(9.0)}
        found.append(path_thrust([cut], None, AIRFRAME, TRIM, AT))
    assert found[0].along_n == pytest.approx(USUAL_DRAG * FORCE, rel=1e-6)
    assert found[1].along_n == pytest.approx(0.0, abs=1e-9)
    assert all(one.deviation_n > 0.3 * USUAL_DRAG * FORCE for one in found)


def test_the_lift_slope_of_a_powered_flight_is_that_of_the_aircraft() -> None:
    """With true columns it was 1.1 % large: the thrust, which is as large as drag."""
    card = load("demo")
    card = replace(
        card,
        sensors=replace(card.sensors, tolerances=False),
        air=replace(card.air, turbulence_mps=0.2),
    )
    flight = virtual_flight(card, 14320, chain="true")
    columns, _ = even_columns(flight.table)
    ideal = replace(AIRFRAME, imu_m=(0.0, 0.0, 0.0), vanes_m=(), upwash=0.0)
    [answer] = identify(
        columns, names=("longitudinal",), airframe=ideal, with_delays=False, powerplant=PLANT
    )
    slopes = [
        m["derivatives"]["CL_alpha"]  # type: ignore[index]
        for m in flight.maneuvers
        if m["axes"] == ["elevator"]
    ]
    [found] = [c for c in answer.coefficients if c.name == "CL_alpha"]
    assert found.value == pytest.approx(np.mean(slopes), rel=0.005)
