"""Airspeed that moves with the surfaces, and the start that the cheap method gives."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.aircraft.mass_properties import AirframeData, Condition, airframe_data
from host.aircraft.powerplant import powerplant
from host.errors import IdentificationError
from host.instrument.deviations import unknown_sensors
from host.readers.even_grid import even_columns
from host.sysid.aerodynamics import coefficient_parts, coefficients
from host.sysid.answer import true_coefficients
from host.sysid.errors import trim_departure
from host.sysid.errors.trim_departure import correct_trim_departure, spin_of
from host.sysid.estimators import fit
from host.sysid.estimators.start_values import regression_estimates, start_values
from host.sysid.flight import flown_maneuvers, reconstruct_flight
from host.sysid.linear import gust_at_trim, linear_fit
from host.sysid.linear.linear_model import imu_place_m, without_attitude
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.models import FitResult, Maneuver, Trim, template
from host.sysid.models.residual_delays import STANDARD_DELAYS
from host.sysid.numerics import OutputProblem
from host.twin.testcard.cards import load
from host.twin.virtual import virtual_flight
from studies.foreign.flight import derivatives as foreign_derivatives
from studies.foreign.flight import fly as fly_foreign
from studies.independent import cells
from studies.judgement.judged_rows import judged_rows
from studies.judgement.trainer_flights import perfect_sensors
from studies.linear import derivatives

import host
from tests.host.sysid.at_hand import identify
from tests.host.sysid.held import assert_held
from tests.host.sysid.recorded import linear_flight

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


def windows(maneuvers: list[dict[str, Any]]) -> list[DetectedManeuver]:
    """Return the maneuvers as the finder would."""
    return [
        DetectedManeuver(
            f"{m['axes'][0]}_rad", m["kind"], m["start_s"], m["input_end_s"], m["end_s"], 0.1, 9
        )
        for m in maneuvers
    ]


def test_a_short_period_is_known_while_airspeed_and_attitude_vary() -> None:
    """Its vane says what lift did, no state why: M_alpha was 5 % off, M_q known to 27 %."""
    columns, _ = fly_foreign(cells()["calm"], 5)
    answer = host.identify(pd.DataFrame(columns), models="short-period").linear[0]
    # What the scale of the airspeed does to Z_alpha is 6 to 13 % from flight to flight.
    known = {"Z_alpha": 0.14, "M_alpha": 0.06, "M_q": 0.06, "M_de": 0.02}
    assert_held(answer.result, foreign_derivatives(answer.trim.airspeed_mps), known=known)


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

    for module in (linear_fit, gust_at_trim):
        monkeypatch.setattr(module, "correct_trim_departure", lambda *_: None)
    plain = misses()
    for name in ("Cn_p", "Cn_da"):
        assert plain[name] > 0.2, name
        assert moved[name] < 0.35 * plain[name], name
    assert moved["Cn_r"] < 0.05


def test_moments_that_follow_airspeed_and_lift_are_no_derivatives(
    calm: tuple[Columns, list[dict[str, Any]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ailerons hold against the propeller's torque, and more of it at a higher airspeed."""
    columns, maneuvers = calm
    data, cuts, trim = [], [], Trim(*_steady(columns, maneuvers))
    base = template("lateral", trim)
    for m in maneuvers:
        inside = (columns["t_s"] >= m["start_s"]) & (columns["t_s"] <= m["end_s"])
        cut = {name: values[inside] for name, values in columns.items()}
        u, y = (np.column_stack([cut[c] for c in names]) for names in (base.inputs, base.outputs))
        data.append(Maneuver(float(np.diff(cut["t_s"])[0]), u, y))
        cuts.append(cut)
    plain = fit("output-error-white", base, data, multiple_starts=False)
    spin = spin_of(powerplant(NAME), cuts)
    true = {n: np.mean([m["dimensional"][n] for m in maneuvers]) for n in base.parameter_names}

    def miss(name: str) -> float:
        found = correct_trim_departure(plain, data, cuts, bare(), trim, spin)
        assert found is not None
        return float((plain.estimate + found.step)[plain.index(name)] / true[name] - 1.0)

    moved = {name: miss(name) for name in ("L_beta", "L_r", "N_beta", "N_r", "N_dr")}
    assert all(abs(one) < 0.01 for one in moved.values()), moved
    monkeypatch.setattr(trim_departure, "_following", lambda _: {})
    assert miss("L_r") > 0.02
    assert abs(miss("N_r")) > 2.0 * abs(moved["N_r"])


def _steady(columns: Columns, maneuvers: list[dict[str, Any]]) -> list[float]:
    flown = (columns["t_s"] >= maneuvers[0]["start_s"]) & (columns["t_s"] <= maneuvers[-1]["end_s"])
    return [float(np.mean(columns[c][flown])) for c in ("airspeed_mps", "alpha_rad", "theta_rad")]


def test_equation_error_gives_the_start_though_places_and_delays_are_free(
    calm: tuple[Columns, list[dict[str, Any]]],
) -> None:
    """What enters no regression keeps its own start; all else begins near the truth."""
    columns, maneuvers = calm
    truth = true_coefficients({"maneuver": maneuvers}, "lateral")
    full = template(
        "lateral",
        Trim(20.0, 0.07, 0.07),
        imu_sd_m=imu_place_m(unknown_sensors()),
        delays=STANDARD_DELAYS,
    )
    found = windows(maneuvers)
    flown = flown_maneuvers([reconstruct_flight(columns, found)], [found])
    cut = [m.cut(full) for m in flown]
    estimates = regression_estimates(full, cut)
    assert "imu_x_m" not in estimates
    airframe, qbar = bare(), float(np.mean(columns["qbar_pa"]))
    about = qbar * airframe.wing_area_m2 * airframe.span_m / airframe.ixx_kgm2 * truth["Cl_da"]
    assert estimates["L_da"] == pytest.approx(about, rel=0.15)
    problem = OutputProblem(full, cut)
    start = dict(zip(problem.names, start_values(problem), strict=True))
    assert start["L_da"] == estimates["L_da"]
    assert start["imu_x_m"] == start["delay_imu_s"] == 0.0
    without = without_attitude(full, flown)
    begun = {p.name: p.start for p in without.parameters}
    assert begun["L_da"] == estimates["L_da"]
    assert begun["N_beta"] == estimates["N_beta"]
    assert begun["imu_z_m"] == 0.0


def test_the_rotor_turns_as_fast_as_its_polynomials_say() -> None:
    """At a steady throttle the motor's torque is the propeller's; momentum is along the shaft."""
    plant = powerplant(NAME)
    still = np.ones(600)
    cut = {
        "t_s": 0.01 * np.arange(600),
        "throttle": 0.5 * still,
        "airspeed_mps": 20.0 * still,
        "density_kgpm3": 1.2 * still,
    }
    along, down = spin_of(plant, [cut, cut])
    speed = along / (plant.rotor_kgm2 * float(plant.axis[0]))
    _, load, drive = plant.step(speed, 0.5, 20.0, 1.2)
    assert drive == pytest.approx(load, rel=0.01)
    assert down == pytest.approx(along * float(plant.axis[2]) / float(plant.axis[0]))
    assert spin_of(None, [cut]) == (0.0, 0.0)
    assert spin_of(plant, [{k: v for k, v in cut.items() if k != "throttle"}]) == (0.0, 0.0)


def test_truth_in_derivatives_is_what_conversion_turns_back() -> None:
    """What the study takes for true comes back from the product's own conversion."""
    airframe = airframe_data(NAME)
    names = ("beta", "p", "r", "da", "dr")
    local = {f"{k}_{n}": 0.1 + 0.03 * j for j, n in enumerate(names) for k in ("CY", "Cl", "Cn")}
    at = {"airspeed_mps": 19.0, "qbar_pa": 220.0}
    flown = (
        airframe.mass_kg,
        airframe.ixx_kgm2,
        airframe.iyy_kgm2,
        airframe.izz_kgm2,
        airframe.ixz_kgm2,
    )
    maneuvers = [{"axes": ["rudder"], "condition": at}, {"axes": ["aileron"], "condition": at}]
    found = derivatives(local, maneuvers, "lateral", airframe, flown)
    model = template("lateral", Trim(19.0))
    estimate = np.array([found[p.name] for p in model.parameters])
    size = len(estimate)
    result = FitResult(
        "test", model, model.parameter_names, estimate, np.eye(size), np.eye(size),
        np.full(size, np.inf), (), (), "output", np.eye(1), 1, True,
    )  # fmt: skip
    table = coefficients(coefficient_parts(result, airframe, Condition(19.0, 220.0)))
    assert {c.name: c.value for c in table} == pytest.approx(local)


def test_a_fit_that_ran_away_is_one_line(
    calm: tuple[Columns, list[dict[str, Any]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One test point's search ended at M_alpha -57 000 with no covariance: a traceback then."""
    columns, maneuvers = calm

    def ran_away(*given: Any, **options: Any) -> FitResult:
        found = fit(*given, **options)
        return replace(found, covariance=np.full_like(found.covariance, np.nan))

    monkeypatch.setattr(linear_fit, "fit", ran_away)
    with pytest.raises(IdentificationError, match="the covariance is not finite; these data do no"):
        identify(columns, names=("lateral",), windows=windows(maneuvers))


def test_a_linear_record_has_no_departures() -> None:
    """Level flight guessed in place of q bent it: L_p was known to 1.4 % and inputs drove p."""
    flight = linear_flight("lateral", "none", "white", 1)
    [answer] = identify(
        flight.columns, names=("lateral",), method="output-error", windows=flight.windows
    )
    assert answer.coherence is not None and not answer.coherence.suspected
    k = answer.result.index("L_p")
    assert answer.result.half_width()[k] < 0.007 * abs(answer.result.estimate[k])


def test_drag_follows_the_lift_of_pitching_too() -> None:
    """Where the polar has all lift D_de was high by two half-widths, D_alpha by one."""
    names = ("D_alpha", "D_de")
    for row in judged_rows("perfect sensors, known", 18, perfect_sensors(18), names):
        if row["name"] in names:
            estimate, true, half = (float(str(row[k])) for k in ("estimate", "true", "half_width"))
            assert abs(estimate - true) < 0.85 * half
