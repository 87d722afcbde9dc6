"""One list of errors: each is paid by whom it says, and changes what it says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.mass_properties import airframe_data
from host.arrays import Array
from host.instrument.deviations import SensorErrorModel, sensor_error_model
from host.instrument.error_list import by_cause, error_kinds
from host.instrument.error_sources import (
    AIRCRAFT_FILE,
    FLIGHT,
    INSTRUMENT,
    ErrorSource,
    error_sources,
    errors_by_file,
)
from host.physical.calibration import load_calibration
from host.physical.recording import SURFACES, Recording
from host.resources import resource
from host.sysid.reconstruction import INSTANTANEOUS_ERRORS, Record, apply_sensor_errors
from host.sysid.reconstruction.sensor_dynamics import DELAYED_COLUMNS, PLACES, POTS, SERVOS

NAME = "ultrastick25e"
AIRSPEED_MPS = 20.0
BY_DRAWING = {
    "elevator_arm_share", "rudder_arm_share", "sidewash_share", "pitching_drag_share",
}  # fmt: skip


def instrument(*, commanded: bool) -> SensorErrorModel:
    """Return an instrument whose surfaces pots measured, or nothing did, without GPS."""
    recording = Recording(commanded=SURFACES if commanded else (), clock_share=None)
    return replace(sensor_error_model(NAME), recording=recording)


def by_file(*, commanded: bool) -> tuple[ErrorSource, ...]:
    return errors_by_file(instrument(commanded=commanded), airframe_data(NAME))


def record() -> Record:
    """Return a record in which every column moves."""
    rng = np.random.default_rng(11)
    angles = ("alpha", "beta", "phi", "theta", *SURFACES)
    columns: dict[str, Array] = {f"{name}_rad": 0.1 * rng.standard_normal(200) for name in angles}
    columns |= {f"{a}_radps": rng.standard_normal(200) for a in "pqr"}
    columns |= {f"a{a}_mps2": 3.0 * rng.standard_normal(200) for a in "xyz"}
    columns["qbar_pa"] = 250.0 + 5.0 * rng.standard_normal(200)
    columns["density_kgpm3"] = np.full(200, 1.2)
    return Record(0.03, columns)


@pytest.mark.parametrize("commanded", [False, True])
def test_an_error_moves_corrected_signals_if_it_says_so(commanded: bool) -> None:
    flown, sensors = record(), instrument(commanded=commanded)
    sources = by_file(commanded=commanded)
    zero = {source.name: 0.0 for source in sources}
    still = apply_sensor_errors(flown, zero, sensors, AIRSPEED_MPS)
    for source in sources:
        errors = zero | {source.name: source.deviation}
        on_clock = flown.on_clock(errors["clock_share"])
        moved = apply_sensor_errors(on_clock, errors, sensors, AIRSPEED_MPS)
        same = all(np.array_equal(moved[name], still[name]) for name in still)
        assert same != source.kind.changes_data, source.name


def test_every_error_that_an_estimator_meets_is_in_the_list_and_paid() -> None:
    kinds = error_kinds()
    of_linear = {*INSTANTANEOUS_ERRORS, *DELAYED_COLUMNS, *POTS, *SERVOS, "friction_share"}
    of_linear |= {
        *(n for n in PLACES if n != "vane_y_m"),
        "clock_share",
        "servo_delay_s",
        "airspeed_share",
    }
    assert {n for n, k in kinds.items() if k.linear == "considered"} == of_linear
    met = {s.name for commanded in (False, True) for s in by_file(commanded=commanded)}
    met |= BY_DRAWING
    assert {n for n, k in kinds.items() if k.coefficients in ("considered", "estimated")} == met
    assert not [n for n, k in kinds.items() if k.linear == k.coefficients == "not paid"]
    with pytest.raises(KeyError, match="wing_wetness"):
        error_sources({"wing_wetness": 0.1}, instrument(commanded=False))


def test_an_error_belongs_to_what_stated_it() -> None:
    owner = {source.name: source.belongs_to for source in by_file(commanded=False)}
    assert {owner[n] for n in ("mass_share", "cg_x_m", "imu_x_m")} == {AIRCRAFT_FILE}
    assert owner["pitot_scale"] == INSTRUMENT
    assert owner["pitot_zero_pa"] == FLIGHT


def test_every_deviation_says_where_it_comes_from(tmp_path: Path) -> None:
    """One vane was calibrated, the other was not; a table states the thrust."""
    text = resource("default.toml").read_text(encoding="utf-8")
    measured = text.replace("[channel.alpha_a]", "[channel.alpha_a]\ndefault = false")
    thrust = '\n[error.thrust_share]\nsigma = 0.01\nsource = "thrust stand"\n'
    path = tmp_path / "own.toml"
    path.write_text(measured + thrust, encoding="utf-8")
    sensors = sensor_error_model(NAME, load_calibration(path))
    found_errors = errors_by_file(sensors, airframe_data(NAME), {"pitot_scale": 0.5})
    origin = {source.name: source.origin for source in found_errors}
    assert origin["thrust_share"] == "calibration file"
    assert origin["mass_share"] == origin["cg_x_m"] == origin["upwash_share"] == "aircraft file"
    assert origin["gyro_x_scale"].startswith("default: left after hw/calibration")
    assert origin["alpha_scale"].startswith("calibration file, default: ")
    assert origin["beta_scale"].startswith("default: encoder linearity")
    assert origin["pitot_scale"] == "assumed of this flight"
    assert origin["density_share"].startswith("default: barometer")


def test_a_larger_assumption_replaces_the_size_of_the_file_and_a_smaller_does_not() -> None:
    sensors, airframe = instrument(commanded=False), airframe_data(NAME)
    found = errors_by_file(sensors, airframe, {"thrust_share": 0.5, "pitot_scale": 1e-9})
    sizes = {source.name: source.deviation for source in found}
    own = {source.name: source.deviation for source in errors_by_file(sensors, airframe)}
    assert sizes == own | {"thrust_share": 0.5}


def test_errors_that_no_flight_tells_apart_have_one_cause() -> None:
    found = by_cause(["imu_tilt_y_rad", "alpha_zero_rad", "imu_x_m", "cg_x_m", "gyro_x_scale"])
    assert found == {
        "place of CG and IMU along x": ("cg_x_m", "imu_x_m"),
        "IMU tilt and vane zero about y": ("imu_tilt_y_rad", "alpha_zero_rad"),
    }
