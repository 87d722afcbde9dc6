"""What reconstruction tells is taken out before the linear fits; what stays open is carried."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.aircraft.mass_properties import AirframeData, Condition, airframe_data
from host.cli import main
from host.instrument.deviations import dynamic_pressure_share
from host.instrument.instrument_errors import InstrumentErrors, standard_errors
from host.sysid import Maneuver, fit
from host.sysid.aerodynamics import (
    ShiftedEstimate,
    coefficient_parts,
    coefficients,
)
from host.sysid.answer import true_coefficients
from host.sysid.answer.estimate_lines import model_lines
from host.sysid.errors import add_systematic_covariance, systematic_error_shifts
from host.sysid.errors.sampling_error import HOLD
from host.sysid.linear import Answer, linear_answer, linear_model
from host.sysid.models import Trim, template
from host.sysid.models.residual_delays import STANDARD_DELAYS
from host.sysid.numerics import OutputProblem
from host.sysid.pipeline import flight_preparation
from host.sysid.reconstruction import (
    Compatibility,
    NoAgreementError,
    SensorErrorEstimate,
)
from host.sysid.reconstruction.sensor_corrections import (
    INSTANTANEOUS_ERRORS,
    advance_delayed,
    correct_columns,
    corrections,
    pressure_share,
    residual_deviations,
)

import host
from tests.host.sysid import recorded
from tests.host.sysid.at_hand import identify
from tests.host.sysid.recorded import NAME, Columns
from tests.host.sysid.verdicts import verdict_lines, verdict_of

WHITE = "output-error-white"  # where gusts are not asked for: a third of the default's time


@pytest.fixture(scope="module")
def flown() -> tuple[Columns, list[dict[str, Any]], Compatibility]:
    """One recorded flight in light turbulence, its maneuvers, what its sensors are wrong by."""
    flight, columns = recorded.flown(recorded.STRAIGHT_ON, 901)
    return columns, flight.maneuvers, recorded.reconstructed(recorded.STRAIGHT_ON, 901)


@pytest.fixture(scope="module")
def freed(flown: tuple[Columns, list[dict[str, Any]], Compatibility]) -> Answer:
    """The answer where what reconstruction told is taken out, and nothing is known beside it."""
    columns, _, found = flown
    # No file that knows the vanes' delay better.
    told = [replace(f, data_informed=f.data_informed or f.name == "vane_delay_s")
            for f in found.findings]  # fmt: skip
    return identify(
        columns,
        names=("longitudinal",),
        airframe=airframe_data(NAME),
        compatibility=replace(found, findings=tuple(told), instrument=None),
    )[0]


def finding(name: str, value: float, half: float, prior: float) -> SensorErrorEstimate:
    """Return a finding that is told if its interval says so."""
    return SensorErrorEstimate(name, value, half, prior, half < 0.7 * prior, "")


def motion(samples: int = 200) -> Columns:
    """Return made-up true signals."""
    t = np.arange(samples) * 0.01
    columns = {"t_s": t}
    names = ("p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2")
    for k, name in enumerate(names):
        columns[name] = (0.3 + k) * np.sin((1.0 + 0.3 * k) * t + k)
    columns |= {"alpha_rad": 0.1 * np.cos(t), "beta_rad": 0.05 * np.sin(2.0 * t)}
    columns["density_kgpm3"] = np.full(samples, 1.2)
    columns["airspeed_mps"] = 17.0 + np.sin(t)
    return columns | {"qbar_pa": 0.6 * columns["airspeed_mps"] ** 2}


def test_an_instrument_that_errs_is_put_right_to_the_digit() -> None:
    """Sensors by their own formula: turned axes, then scale and bias; V squared for the pitot."""
    true = motion()
    rng = np.random.default_rng(3)
    errors = {name: float(rng.uniform(-0.02, 0.02)) for name in INSTANTANEOUS_ERRORS}
    errors["pitot_zero_pa"] = 3.0
    measured = dict(true)
    x, y, z = (errors[f"imu_tilt_{a}_rad"] for a in "xyz")
    turned = np.linalg.inv(np.eye(3) + np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]))
    for kind, sensor, unit in (("pqr", "gyro", "radps"), (("ax", "ay", "az"), "accel", "mps2")):
        body = turned @ np.stack([true[f"{k}_{unit}"] for k in kind])
        for row, k, a in zip(body, kind, "xyz", strict=True):
            scale, bias = errors[f"{sensor}_{a}_scale"], errors[f"{sensor}_{a}_bias_{unit}"]
            measured[f"{k}_{unit}"] = (1.0 + scale) * row + bias
    for name in ("alpha", "beta"):
        angle = (1.0 + errors[f"{name}_scale"]) * true[f"{name}_rad"] + errors[f"{name}_zero_rad"]
        measured[f"{name}_rad"] = angle
    part = 0.6
    pitot, thin = 1.0 + part * errors["pitot_scale"], 1.0 + (1.0 - part) * errors["pitot_scale"]
    dense = 1.0 + errors["density_share"]
    measured["qbar_pa"] = dense * pitot * true["qbar_pa"] + errors["pitot_zero_pa"]
    measured["density_kgpm3"] = dense * true["density_kgpm3"] / thin
    measured["airspeed_mps"] = np.sqrt(2.0 * measured["qbar_pa"] / measured["density_kgpm3"])
    back = correct_columns(measured, errors, part)
    for name, values in true.items():
        tolerance = 2e-4 if name in ("airspeed_mps", "qbar_pa", "density_kgpm3") else 1e-12
        np.testing.assert_allclose(back[name], values, rtol=tolerance, atol=1e-12, err_msg=name)


def test_only_what_is_told_is_taken_out() -> None:
    found = Compatibility(
        (
            finding("gyro_x_scale", 0.01, 0.003, 0.0113),
            finding("alpha_scale", -0.02, 0.03, 0.0288),
            finding("pitot_scale", 0.01, 0.03, 0.031),
            finding("wind_north_mps", -3.0, 0.1, 19.6),
        ),
        {},
        (),
        gps=True,
    )
    assert [c.name for c in corrections(found)] == ["gyro_x_scale"]
    left = residual_deviations(found)
    assert left["gyro_x_scale"] == pytest.approx(0.003 / 1.96, rel=1e-3)
    assert left["alpha_scale"] == pytest.approx(0.0288 / 1.96, rel=1e-3)
    assert "wind_north_mps" not in left
    # 3 % of pitot, evenly, two of them, against 1 % of density.
    assert pressure_share(found) == pytest.approx(0.6, abs=0.01)


def test_sensors_that_do_not_agree_are_as_open_as_their_file_leaves_them(
    flown: tuple[Columns, list[dict[str, Any]], Compatibility], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Vanes and pots were in no interval of a flight whose check did not converge."""

    def disagree(*_: object) -> Compatibility:
        raise NoAgreementError("data compatibility: no agreement")

    monkeypatch.setattr(flight_preparation, "reconstruct", disagree)
    flight = pd.DataFrame(flown[0])
    found = host.identify(flight, aircraft=NAME, models=("short-period",))
    parts, instrument = found.linear[0].coefficient_parts, found.flights[0].instrument
    assert parts is not None
    assert instrument is not None
    sensed = dict(parts.sensed)
    share = instrument.errors["pot_scale"].of_mean("pot_elevator")
    k = parts.names.index("Cm_de")
    values = dict(zip(parts.names, parts.values, strict=True))
    assert abs(sensed["elevator_scale"][k] / values["Cm_de"]) == pytest.approx(share, rel=0.05)
    assert {"alpha_scale", "gyro_y_scale", "imu_x_m"} <= sensed.keys()
    assert np.any(sensed[HOLD] != 0.0)  # surfaces that their file measures move between samples
    assert not {"vane_delay_s", "imu_delay_s", "pitot_delay_s"} & sensed.keys()


def test_two_halves_with_one_vane_know_it_no_better_than_the_whole(
    flown: tuple[Columns, list[dict[str, Any]], Compatibility],
) -> None:
    """Halves that agree say nothing of what one sensor of both may have wrong."""
    flight = pd.DataFrame(flown[0])
    flight["alpha_rad"] *= 1.1
    first = flight["t_s"] < 0.5 * flight["t_s"].iloc[-1]

    def of_sensors(flights: Sequence[pd.DataFrame]) -> dict[str, float]:
        """Return the share of each derivative that sensors leave open, one deviation."""
        how = {"models": "short-period", "methods": WHITE}
        found = host.identify(flights, **how).linear[0]  # type: ignore[arg-type]
        assert found.noise_covariance is not None
        open_variance = np.diag(found.result.covariance) - np.diag(found.noise_covariance)
        share = np.sqrt(open_variance) / np.abs(found.result.estimate)
        return dict(zip(found.result.names, share, strict=True))

    whole, halves = of_sensors([flight]), of_sensors([flight[first], flight[~first]])
    assert whole["Z_alpha"] > 0.05
    for name in ("Z_alpha", "M_alpha"):
        assert halves[name] > 0.9 * whole[name]


def test_a_late_vane_is_read_later() -> None:
    t = np.arange(0.0, 2.0, 0.01)
    columns = {"t_s": t, "alpha_rad": np.sin(3.0 * (t - 0.012)), "airspeed_mps": np.cos(t)}
    back = advance_delayed(columns, {"vane_delay_s": 0.012})
    np.testing.assert_allclose(back["alpha_rad"][:-3], np.sin(3.0 * t)[:-3], atol=2e-4)
    np.testing.assert_array_equal(back["airspeed_mps"], columns["airspeed_mps"])


def short_period() -> tuple[Columns, Maneuver, Any]:
    """Return a noisy short period with its columns and its model."""
    trim = Trim(17.0, 0.08, 0.08)
    model = template("short-period", trim)
    names = [p.name for p in model.parameters]
    values = {"Z_alpha": -5.0, "Z_de": -0.6, "Z_q": -0.1, "M_alpha": -60.0, "M_q": -6.0}
    theta = np.array([values.get(n, -70.0) for n in names])
    u = np.zeros((500, 1))
    u[60:90], u[90:110], u[110:120], u[120:130] = 0.05, -0.05, 0.05, -0.05
    problem = OutputProblem(model, [Maneuver(0.01, u, np.zeros((500, len(model.outputs))))])
    response = problem.respond(np.concatenate([theta, np.zeros(len(problem.names) - len(theta))]))
    assert response is not None
    y = response[0].y.T
    y = y + 0.02 * y.std(axis=0) * np.random.default_rng(2).standard_normal(y.shape)
    columns = motion(500) | {"elevator_rad": u[:, 0]}
    columns |= dict(zip(model.outputs, y.T, strict=True))
    columns["airspeed_mps"], columns["qbar_pa"] = np.full(500, 17.0), np.full(500, 173.4)
    columns["alpha_rad"] = columns["alpha_rad"] + 0.08
    columns["theta_rad"] = np.full(500, 0.08)
    maneuver = Maneuver(0.01, u, np.column_stack([columns[c] for c in model.outputs]))
    return columns, maneuver, model


def test_one_step_foretells_the_fit_of_disturbed_data() -> None:
    """A gyro's scale, a vane's, and the pitot's that moves the trim of the model as well."""
    columns, maneuver, model = short_period()
    result = fit("output-error-white", model, [maneuver])
    trim = Trim(17.0, float(columns["alpha_rad"].mean()), 0.08)
    model = template("short-period", trim)
    result = fit("output-error-white", model, [maneuver])
    size = {"gyro_y_scale": 0.01, "alpha_scale": 0.01, "pitot_scale": 0.02}
    found = Compatibility(
        tuple(finding(n, 0.0, 1.96 * s, 1.96 * s) for n, s in size.items()), {}, (), gps=True
    )
    moved = {
        m.error: m for m in systematic_error_shifts(result, [maneuver], [columns], [found], trim)
    }
    assert set(moved) == {*size, "density_share"}
    for error, deviation in size.items():
        other = correct_columns(columns, {error: deviation}, pressure_share(found))
        bent = Trim(
            float(other["airspeed_mps"].mean()), float(other["alpha_rad"].mean()), trim.theta_rad
        )
        data = Maneuver(0.01, maneuver.inputs, np.column_stack([other[c] for c in model.outputs]))
        again = fit("output-error-white", template("short-period", bent), [data])
        expected = again.estimate[:6] - result.estimate[:6]
        step = moved[error].estimate[:6] - result.estimate[:6]
        largest = np.max(np.abs(expected / result.estimate[:6]))
        assert largest > 0.004, error
        np.testing.assert_allclose(
            step / result.estimate[:6], expected / result.estimate[:6], atol=0.1 * largest
        )
    assert moved["pitot_scale"].qbar_gain == pytest.approx(1.0 - 0.02 * pressure_share(found), 1e-3)
    wide = result.with_uncertainty(add_systematic_covariance(result, tuple(moved.values())))
    k = result.index("M_alpha")
    expected_half = np.hypot(
        result.half_width()[k],
        1.96 * np.linalg.norm([m.estimate[k] - result.estimate[k] for m in moved.values()]),
    )
    assert wide.half_width()[k] == pytest.approx(expected_half, rel=1e-3)


def test_a_better_pitot_narrows_a_coefficient() -> None:
    columns, maneuver, model = short_period()
    result = fit("output-error-white", model, [maneuver])
    airframe = AirframeData("a", 2.0, 0.04, 0.08, 0.12, 0.0, 0.3, 1.2, 0.25)
    condition = Condition(17.0, float(columns["qbar_pa"].mean()))
    standard = standard_errors()

    def half(*moved: ShiftedEstimate, errors: InstrumentErrors | None = None) -> float:
        table = coefficients(coefficient_parts(result, airframe, condition, moved, errors))
        return next(c.half_width / abs(c.value) for c in table if c.name == "Cm_alpha")

    def pitot(share: float) -> ShiftedEstimate:
        return ShiftedEstimate("pitot_scale", result.estimate, 1.0, 1.0 + share)

    turned = result.estimate.copy()
    turned[result.index("M_alpha")] *= 1.03
    # Where reconstruction says nothing of the pitots, their own file does.
    plain = half()
    share = dynamic_pressure_share(standard, condition.qbar_pa)
    assert 0.01 < share < 0.03
    none = half(errors=standard.scaled(0.0, "pitot_scale", "pitot_zero_pa"))
    assert plain == pytest.approx(np.hypot(none, 1.96 * share), rel=1e-3)
    # Where it does, that alone counts, larger or smaller.
    for moved in (0.001, 0.01, 0.05):
        expected = np.hypot(none, 1.96 * (1.0 - 1.0 / (1.0 + moved)))
        assert half(pitot(moved)) == pytest.approx(expected, rel=1e-3)
    assert half(ShiftedEstimate("imu_tilt_y_rad", turned, 1.0, 1.0)) == pytest.approx(
        np.hypot(plain, 1.96 * 0.03), rel=1e-3
    )


def test_equation_error_no_longer_takes_late_vanes_for_damping(
    flown: tuple[Columns, list[dict[str, Any]], Compatibility],
) -> None:
    columns, maneuvers, found = flown
    airframe = airframe_data(NAME)
    for axis, name in (("longitudinal", "Cm_q"), ("lateral", "Cn_r")):
        truth = true_coefficients({"maneuver": maneuvers}, axis)[name]
        errors = []
        for known in (None, found):
            answer = identify(
                columns,
                names=(axis,),
                method="equation-error",
                airframe=airframe,
                compatibility=known,
            )[0]
            value = next(c.value for c in answer.coefficients if c.name == name)
            errors.append(abs(value / truth - 1.0))
        assert errors[0] > 0.2
        assert errors[1] < 0.5 * errors[0]


def test_told_errors_are_not_taken_out_twice(
    flown: tuple[Columns, list[dict[str, Any]], Compatibility], freed: Answer
) -> None:
    """Free, the fit finds what is left of the vanes' delay; both together are as before."""
    columns, after = flown[0], freed
    [before] = identify(columns, names=("longitudinal",), airframe=airframe_data(NAME))
    taken = {c.name: c.value for c in after.corrections}
    assert not before.corrections
    assert taken["vane_delay_s"] > 0.003
    (value, half), (left, left_half) = (a.delays["delay_vanes_s"] for a in (before, after))
    # The other corrections move it too: 18.4 and 20.0 ms, each known to 1.4.
    assert left + taken["vane_delay_s"] == pytest.approx(
        value, abs=float(np.hypot(half, left_half))
    )


def test_with_the_instrument_known_places_and_delays_are_carried_not_freed(
    flown: tuple[Columns, list[dict[str, Any]], Compatibility], freed: Answer
) -> None:
    """In gusts no fit tells the IMU's place from lift of the elevator: to free it is to err."""
    columns, maneuvers, found = flown
    [answer] = identify(
        columns, names=("longitudinal",), airframe=airframe_data(NAME), compatibility=found
    )
    assert "imu_x_m" in freed.result.names
    assert "imu_x_m" not in answer.result.names
    assert not any(n.startswith("delay_") for n in answer.result.names)
    assert "imu_z_m" in answer.result.names  # drag tells it: a pitch rate makes none
    # Errors of one flight come together, lift by pitch rate and by elevator in this one.
    flight, others = recorded.flown(recorded.STRAIGHT_ON, 902)
    known = recorded.reconstructed(recorded.STRAIGHT_ON, 902)
    [other] = identify(
        others, names=("longitudinal",), airframe=airframe_data(NAME), compatibility=known
    )
    off = []
    for one, flown_as in ((answer, maneuvers), (other, flight.maneuvers)):
        truth = true_coefficients({"maneuver": flown_as}, "longitudinal")
        off += [abs(c.value - truth[c.name]) / c.half_width for c in one.coefficients]
    assert len(off) == 16
    assert max(off) < 1.5
    assert sum(x < 1.0 for x in off) >= 14
    # A centimetre of arm: the half-width of CL_de is at least what it makes.
    place = next(c for c in answer.coefficients if c.name == "CL_de")
    assert place.half_width > 0.15 * abs(place.value)


def test_a_delay_at_its_bound_is_called_so(
    flown: tuple[Columns, list[dict[str, Any]], Compatibility], monkeypatch: pytest.MonkeyPatch
) -> None:
    columns, _, _ = flown
    tight = tuple(
        replace(d, limit_s=0.001) if d.name == "delay_vanes_s" else d for d in STANDARD_DELAYS
    )
    for module in (linear_answer, linear_model):
        monkeypatch.setattr(module, "STANDARD_DELAYS", tight)
    known = airframe_data(NAME)
    [answer] = identify(columns, names=("longitudinal",), method=WHITE, airframe=known)
    assert "delay_vanes_s" in answer.at_bound
    assert any("delay_vanes_s is at its bound" in line for line in verdict_lines([answer], []))
    shown = model_lines(answer, verdict_of(answer))
    assert any("delay_vanes_s" in line and "at its bound" in line for line in shown)


def test_the_verb_says_what_it_corrected_and_can_leave_it(
    flown: tuple[Columns, list[dict[str, Any]], Compatibility],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    columns, _, _ = flown
    source = tmp_path / "flight.csv"
    pd.DataFrame(columns).to_csv(source, index=False)
    options = ["identify", str(source), "--model", "short-period", "--aircraft", NAME]
    options += ["--method", "equation-error"]
    assert main([*options, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)["answers"][0]
    assert answer["corrections"]["gyro_x_bias_radps"]["half_width"] > 0.0
    origin = {error["name"]: error["origin"] for error in answer["errors"]}
    assert origin["gyro_x_bias_radps"] == "reconstruction of this flight"
    assert origin["mass_share"] == "aircraft file"
    assert origin["elevator_scale"].startswith("default: two angles on a protractor")
    assert min(error["deviation"] for error in answer["errors"]) > 0.0
    assert any("sensor errors corrected" in line for line in answer["verdict"])
    assert main([*options, "--json", "--no-corrections"]) == 0
    plain = json.loads(capsys.readouterr().out)["answers"][0]
    assert plain["corrections"] == {}
    assert not any("corrected in the columns" in line for line in plain["verdict"])
    alone = pd.DataFrame({k: v for k, v in columns.items() if not k.startswith("v_")})
    alone.to_csv(source, index=False)
    assert main([*options, "--full"]) == 0
    text = capsys.readouterr().out
    assert "unobservable without GPS" in text
    assert "pitot_scale" not in text.split("short-period")[0]
