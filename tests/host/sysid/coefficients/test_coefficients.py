"""Coefficients straight from flight: the truth is found, and a wrong sensor model is noticed."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from host.aircraft.mass_properties import AirframeData, airframe_data
from host.aircraft.powerplant import powerplant
from host.arrays import Array
from host.constants import NORMAL_95
from host.errors import IdentificationError
from host.instrument.deviations import SensorErrorModel, deviations, sensor_error_model
from host.sysid.coefficients import CoefficientFit, Window, window_transform
from host.sysid.coefficients.coefficient_search import fit_coefficients, search_coefficients
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.reconstruction.inverse_sensor_model import (
    Record,
    apply_sensor_errors,
    usable_length,
)
from host.twin.virtual import VirtualFlight, virtual_flight
from studies.flights import PRINCIPAL, Tally

from tests.host.sysid.at_hand import identify_coefficients
from tests.host.sysid.recorded import NAME, aloft, nominal_multisine

# What an instrument without drawn errors leaves; arms and tilts of the real one are not in it.
WITHIN = {
    "CL_alpha": 0.03, "CL_de": 0.12, "Cm_alpha": 0.04, "Cm_q": 0.03, "Cm_de": 0.04,
    "CY_beta": 0.12, "CY_dr": 0.05, "Cl_beta": 0.08, "Cl_p": 0.05, "Cl_r": 0.15, "Cl_da": 0.05,
    "Cn_beta": 0.08, "Cn_r": 0.07, "Cn_dr": 0.03,
}  # fmt: skip


@pytest.fixture(scope="module")
def flight() -> VirtualFlight:
    """Sensors with their dynamics, friction, noise and gusts; nothing drawn."""
    return nominal_multisine()


def fitted(
    flight: VirtualFlight,
    data: SensorErrorModel,
    airframe: AirframeData | None = None,
    gains: Mapping[str, float] | None = None,
) -> CoefficientFit:
    columns, windows = aloft(flight)
    kept = {k: v * (gains or {}).get(k, 1.0) for k, v in columns.items()}
    frame = airframe or airframe_data(NAME)
    return fit_coefficients(kept, windows, frame, data, powerplant(NAME))


@pytest.fixture(scope="module")
def still(flight: VirtualFlight) -> CoefficientFit:
    """Return the fit of that flight as it is."""
    return fitted(flight, sensor_error_model(NAME))


def misses(flight: VirtualFlight, fit: CoefficientFit) -> dict[str, float]:
    result = {}
    for d in fit.derivatives:
        if d.name not in WITHIN:
            continue
        along = d.name[:2] in ("CL", "CD", "Cm")
        truths = [
            local[d.name]
            for m in flight.maneuvers
            if (m["axes"] == ["elevator"]) == along
            and isinstance(local := m["derivatives"], Mapping)
        ]
        result[d.name] = d.value / float(np.mean(truths)) - 1.0
    return result


def test_finds_the_truth_and_covers_it(flight: VirtualFlight, still: CoefficientFit) -> None:
    fit, miss = still, misses(flight, still)
    assert {k: v for k, v in miss.items() if k in WITHIN and abs(v) > WITHIN[k]} == {}
    for d in fit.derivatives:
        if d.name in WITHIN:
            assert abs(miss[d.name]) * abs(d.value) <= 1.2 * d.half_width, d.name
    flagged = {d.name for d in fit.derivatives if d.flagged} & set(PRINCIPAL)
    assert {"Cn_p"} <= flagged <= {"Cn_p", "CD_0"}


def test_known_residuals_know_the_air_too(flight: VirtualFlight) -> None:
    """Noise in the roll rate moves Cl_p as rolling air does: where the air is known, by no air."""
    columns, windows = aloft(flight)
    noise = np.random.default_rng(3).normal(0.0, 1.0, len(columns["t_s"]))
    noisy = {**columns, "p_radps": columns["p_radps"] + noise}
    given = noisy, windows, airframe_data(NAME), sensor_error_model(NAME), powerplant(NAME)
    alone = search_coefficients(*given)
    known = search_coefficients(*given, known_noise=alone.final.noise)
    assert "Cl_p" in alone.least_squares_shares
    assert known.least_squares_shares == {}
    k = alone.problem.position["Cl_p"]
    assert known.covariance[k, k] < 0.5 * alone.covariance[k, k]


def test_roll_under_the_elevator_tells_a_cg_beside_the_plane_of_symmetry() -> None:
    beside = virtual_flight("multisine", 700, chain="none")
    true_m = float(beside.record.draws.values["cg_m"][1])
    value, left = fitted(beside, sensor_error_model(NAME)).errors["cg_y_m"]
    assert abs(true_m) > 0.007
    assert left < 0.001
    assert abs(value - true_m) < 3.0 * left


def test_a_vane_taken_for_frictionless_shows_in_damping(flight: VirtualFlight) -> None:
    smooth = replace(sensor_error_model(NAME), vane_friction_rad=0.0)
    miss = misses(flight, fitted(flight, smooth))
    assert abs(miss["Cm_q"]) > 0.06


def test_the_drawing_tells_the_arm_of_the_accelerometers_from_lift(
    flight: VirtualFlight, still: CoefficientFit
) -> None:
    data, frame = sensor_error_model(NAME), airframe_data(NAME)
    unknown = replace(frame, elevator_arm_m=0.0, rudder_arm_m=0.0)
    wrong = replace(frame, elevator_arm_m=0.7 * frame.elevator_arm_m, arm_share=0.01)
    lift = {}
    fits = {"told": still, "unknown": fitted(flight, data, unknown)}
    for name, fit in (fits | {"wrong": fitted(flight, data, wrong)}).items():
        lift[name] = next(d for d in fit.derivatives if d.name == "CL_de")
        assert np.all(np.linalg.eigvalsh(fit.covariance) > -1e-9)
    assert lift["unknown"].half_width > 0.18 * lift["unknown"].value
    assert lift["told"].half_width < 0.11 * lift["told"].value
    assert lift["wrong"].value > 1.15 * lift["told"].value


@pytest.mark.parametrize(
    ("column", "error"),
    [("alpha_rad", "alpha_scale"), ("beta_rad", "beta_scale"), ("p_radps", "gyro_x_scale")],
)
def test_an_error_shifts_the_derivatives_as_the_fit_says(
    flight: VirtualFlight, still: CoefficientFit, column: str, error: str
) -> None:
    size = next(e.deviation for e in still.error_sources if e.name == error)
    moved = fitted(flight, sensor_error_model(NAME), gains={column: 1.0 + size})
    said = still.error_shifts[error]
    found = [b.value - a.value for a, b in zip(still.derivatives, moved.derivatives, strict=True)]
    own = np.array([d.half_width for d in still.derivatives]) / NORMAL_95
    # Drag goes with the square of the lift, and so with the square of an angle's error.
    linear = np.array([not d.name.startswith("CD") for d in still.derivatives])
    assert float(np.max(np.abs(said / own)[linear])) > 0.05  # of a deviation: no small thing
    assert ((np.array(found) - said) / own)[linear] == pytest.approx(0.0, abs=0.06)


def test_undoes_vane_inertia_upwash_and_places() -> None:
    data = replace(sensor_error_model(NAME), vane_friction_rad=0.0)
    t = np.arange(2000) * 0.01
    alpha = 0.1 + 0.03 * np.sin(2.0 * np.pi * 2.0 * t)
    q = 0.4 * np.sin(2.0 * np.pi * 1.5 * t)
    local = np.arctan(
        (1.0 + data.upwash) * (np.tan(alpha) - q * data.vanes_m[0] / (17 * np.cos(alpha)))
    )
    jw = 2j * np.pi * np.fft.rfftfreq(2000, 0.01)
    omega = 2.0 * np.pi * data.vane_hz_per_mps * 17.0
    vane = np.fft.irfft(
        np.fft.rfft(local) / (1.0 + 2.0 * data.vane_damping * jw / omega + (jw / omega) ** 2), 2000
    )
    still = np.zeros(2000)
    columns: dict[str, Array] = dict.fromkeys(
        ("beta_rad", "p_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2",
         "elevator_rad", "aileron_rad", "rudder_rad"), still,
    )  # fmt: skip
    pole = jw / (2.0 * np.pi * data.imu_bandwidth_hz)
    columns |= {
        "alpha_rad": vane,
        "q_radps": np.fft.irfft(np.fft.rfft(q) * np.exp(pole) / (1.0 + pole), 2000),
        "qbar_pa": np.full(2000, 0.5 * 1.2 * 17.0**2),
        "density_kgpm3": np.full(2000, 1.2),
    }
    zero = dict.fromkeys(deviations(data, airframe_data(NAME)), 0.0)
    found = apply_sensor_errors(Record(0.01, columns), zero, data, 17.0)
    middle = slice(300, -300)
    assert np.max(np.abs(found["alpha"] - alpha)[middle]) < 5e-4
    assert np.max(np.abs(found["q"] - q)[middle]) < 2e-3
    # The bound fails where the vane's inertia is left in.
    fast = replace(data, vane_hz_per_mps=10.0)
    left_in = apply_sensor_errors(Record(0.01, columns), zero, fast, 17.0)["alpha"]
    assert np.max(np.abs(left_in - alpha)[middle]) > 2e-3


def test_lengths_that_transform_fast() -> None:
    assert [usable_length(n) for n in (1, 7, 17449, 20000)] == [1, 6, 17280, 20000]


def test_what_is_missing_is_named() -> None:
    empty: dict[str, np.ndarray] = {"t_s": np.arange(10.0)}
    with pytest.raises(IdentificationError, match="alpha_rad"):
        fit_coefficients(empty, [], airframe_data(NAME), sensor_error_model(NAME), powerplant(NAME))


def test_a_window_of_two_seconds_may_miss_a_sample_on_the_grid_of_the_fit() -> None:
    """A maneuver at the end of a record, 2.0 s long, ended the work: "2 s needed"."""
    step_s = 2.0 / 66.4
    window = Window(98.0, 100.0, longitudinal=False)
    assert len(window_transform(np.arange(66), step_s, window, ("CL", "CD")).frequency_hz) > 5
    with pytest.raises(IdentificationError, match="2 s needed"):
        window_transform(np.arange(65), step_s, window, ("CL", "CD"))


def test_a_flight_of_two_seconds_is_refused_in_one_line() -> None:
    t = np.arange(200) * 0.01
    moved = DetectedManeuver("elevator_rad", "window", 0.5, 1.0, 1.9, 0.1, 0)
    with pytest.raises(IdentificationError, match="more than the 3 s after the launch"):
        identify_coefficients({"t_s": t, "airspeed_mps": np.full(200, 17.0)}, NAME, windows=[moved])


def test_a_table_counts_wild_cases_without_a_flag() -> None:
    tally = Tally()
    for value, flagged in ((1.0, False), (1.2, False), (1.3, True)):
        tally.add("Cm_q", 1.0, value, 0.25, flagged=flagged)
    assert "1 beyond 15 %" in tally.lines()[-1]
    assert "66.7 % covered" in tally.lines()[-1]
