"""Airspeed that moves with the surfaces, and the start that the cheap method gives."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from host.sysid.aircraft.aircraft_file import airframe_data
from host.sysid.aircraft.airframe import AirframeData, Moved
from host.sysid.answer.truth import true_coefficients
from host.sysid.estimators.start import regressed, start_values
from host.sysid.flight import linear
from host.sysid.flight.finder import Found
from host.sysid.flight.linear import DELAYS, IMU_SD_M, identify
from host.sysid.flight.tables import even_columns
from host.sysid.models.templates import Trim, template
from host.sysid.numerics.problem import OutputProblem
from host.twin.testcard.cards import load
from host.twin.virtual import virtual_flight

NAME = "ultrastick25e"
Columns = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def calm() -> tuple[Columns, list[dict[str, Any]]]:
    """One multisine on aileron and one on rudder in calm air, as perfect sensors see them."""
    card = load("survey")
    rest = replace(card.segments[0], duration_s=4.0)
    across = [s for s in card.segments if tuple(s.axes) == ("aileron", "rudder")]
    short = [rest, across[0], rest, across[-1], rest]
    flight = virtual_flight(
        replace(card, air=replace(card.air, turbulence_mps=0.0), segments=tuple(short)),
        3,
        chain="true",
    )
    columns, _ = even_columns(flight.table)
    return columns, flight.maneuvers


def bare() -> AirframeData:
    """Return the aircraft with sensors at its CG."""
    return replace(airframe_data(NAME), imu_m=(0.0, 0.0, 0.0), vanes_m=(), upwash=0.0)


def windows(maneuvers: list[dict[str, Any]]) -> list[Found]:
    """Return the maneuvers as the finder would."""
    return [
        Found(f"{m['axes'][0]}_rad", m["kind"], m["start_s"], m["input_end_s"], m["end_s"], 0.1, 9)
        for m in maneuvers
    ]


def test_airspeed_that_falls_with_the_rudder_is_not_taken_for_a_derivative(
    calm: tuple[Columns, list[dict[str, Any]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    columns, maneuvers = calm
    truth = true_coefficients({"maneuver": maneuvers}, "lateral")

    def misses() -> Mapping[str, float]:
        answer = identify(
            columns,
            names=("lateral",),
            airframe=bare(),
            windows=windows(maneuvers),
            with_delays=False,
        )[0]
        return {
            c.name: abs(c.value / truth[c.name] - 1.0)
            for c in answer.coefficients
            if abs(truth[c.name]) > 1e-6
        }

    moved = misses()

    def stay(result: Any, *_: object) -> tuple[Any, tuple[Moved, ...]]:
        return result, ()

    monkeypatch.setattr(linear, "departed", stay)
    plain = misses()
    for name in ("Cn_p", "Cn_da"):
        assert plain[name] > 0.2, name
        assert moved[name] < 0.35 * plain[name], name
    assert moved["Cn_r"] < 0.05


def test_equation_error_gives_the_start_though_places_and_delays_are_free(
    calm: tuple[Columns, list[dict[str, Any]]],
) -> None:
    """What enters no regression keeps its own start; all else begins near the truth."""
    columns, maneuvers = calm
    truth = true_coefficients({"maneuver": maneuvers}, "lateral")
    full = template("lateral", Trim(20.0, 0.07, 0.07), imu_sd_m=IMU_SD_M, delays=DELAYS)
    cut = [linear._cut(columns, full, f) for f in windows(maneuvers)]
    told = regressed(full, cut)
    assert "imu_x_m" not in told
    airframe, qbar = bare(), float(np.mean(columns["qbar_pa"]))
    about = qbar * airframe.wing_area_m2 * airframe.span_m / airframe.ixx_kgm2 * truth["Cl_da"]
    assert told["L_da"] == pytest.approx(about, rel=0.15)
    problem = OutputProblem(full, cut)
    start = dict(zip(problem.names, start_values(problem), strict=True))
    assert start["L_da"] == told["L_da"]
    assert start["imu_x_m"] == start["delay_imu_s"] == 0.0
    led = linear._without_attitude(columns, full, windows(maneuvers))
    begun = {p.name: p.start for p in led.parameters}
    assert begun["L_da"] == told["L_da"]
    assert begun["N_beta"] == told["N_beta"]
    assert begun["imu_z_m"] == 0.0
