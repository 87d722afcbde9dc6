"""Data compatibility check: vanes, pitot, barometer and GPS against the inertial sensors.

Flight-path reconstruction over the kinematics of `flight_path`. Sensor errors and wind are common
to all segments of the flight, initial values belong to one. The calibration is the prior. Klein &
Morelli, Aircraft System Identification, ch. 10; Jategaonkar, Flight Vehicle System Identification,
2nd ed., ch. 10.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array
from host.constants import CERTAIN_SD, GRAVITY_MPS2, NORMAL_95, POSTERIOR_PRIOR_RATIO
from host.errors import IdentificationError
from host.instrument.deviations import SensorErrorModel
from host.people_units import people_name
from host.sysid.reconstruction.calibration_consistency import (
    ConsistencyTest,
    calibration_lines,
    consistency_tests,
)
from host.sysid.reconstruction.flight_path import AIR, DELAYS, FLOW, GPS, INERTIAL
from host.sysid.reconstruction.path_fit import fit_path
from host.sysid.reconstruction.path_preparation import (
    prepare_path_problem,
    prior,
    vane_delay_by_file,
)

VANE_MODEL_SD = 0.006  # of scale: dry friction known to 20 % of its 3 %
# Without GPS only vanes and pitot, gusts included, determine the path: on eight flights rms errors
# are up to 2.5 times the computed deviations, more for biases of the gyro.
NO_GPS_INFLATION = 2.5
GYRO_ZEROS = UNOBSERVABLE_WITHOUT_GPS = INERTIAL[0:3]
REASONS = {
    "pitot_scale": "wind and scale look alike on one heading, gusts hide it: fly full turns",
    "pitot_zero_pa": "fly slow and fast parts, or zero the pitot at rest",
}
REASONS_NO_GPS = {
    "pitot_scale": "unobservable without GPS: no other sensor knows the speed",
    "pitot_zero_pa": "unobservable without GPS: no other sensor knows the speed",
    "wind_north_mps": "unobservable without GPS",
    "wind_east_mps": "unobservable without GPS",
    "gps_delay_s": "no GPS",
}
BY_FILE = "the aircraft file is more accurate"
ONE_VANE = "it takes both vanes; the calibration stands"
NO_AGREEMENT = "the sensors did not agree; the calibration stands"
NOT_EXCITED = "the motion flown does not show it; the calibration stands"
NOT_EXCITED_NO_GPS = "attitude and gusts do not show it without GPS; the calibration stands"


class NoAgreementError(IdentificationError):
    """Error: the search for the sensors' errors did not converge, which says nothing of them."""


@dataclass(frozen=True, slots=True)
class SensorErrorEstimate:
    """One sensor error: estimate, its 95 % half-width, and the half-width of the calibration.

    `data_informed` is false if the data add little to the calibration; `reason` then says why, and
    what to fly.
    """

    name: str
    value: float
    half_width: float
    prior_half_width: float
    data_informed: bool
    reason: str

    @property
    def significant(self) -> bool:
        """Whether the data show an error that is not zero."""
        return self.data_informed and abs(self.value) > self.half_width


@dataclass(frozen=True)
class Compatibility:
    """Result of flight-path reconstruction.

    Attributes
    ----------
    findings : tuple of SensorErrorEstimate
        Sensor errors, delays behind the IMU, steady wind.
    rms : dict
        Root mean square of the residual of each output, in its unit.
    segments : tuple of (from, to), s
        Begin and end of the segments it used.
    gps, vanes : bool
        Whether they took part.
    instrument : SensorErrorModel, optional
        Errors that the calibration leaves open, if given.
    calibration_tests : tuple of ConsistencyTest
        Consistency with the file's standard deviations: all together, then by group.
    """

    findings: tuple[SensorErrorEstimate, ...]
    rms: dict[str, float]
    segments: tuple[tuple[float, float], ...]
    gps: bool
    instrument: SensorErrorModel | None = None
    calibration_tests: tuple[ConsistencyTest, ...] = ()
    vanes: bool = True

    def __getitem__(self, name: str) -> SensorErrorEstimate:
        """Return a finding by name."""
        return next(f for f in self.findings if f.name == name)


def reconstruct(
    columns: Mapping[str, Array],
    airframe: AirframeData | None = None,
    instrument: SensorErrorModel | None = None,
    usual: SensorErrorModel | None = None,
) -> Compatibility:
    """Reconstruct the flight path and estimate the errors of the sensors.

    Parameters
    ----------
    columns : mapping
        Even SI columns as `tables.read_columns` gives them, not yet corrected for position.
    airframe : AirframeData, optional
        Places of the sensors and upwash; by default vanes and IMU are at the CG.
    instrument : SensorErrorModel, optional
        Errors that the calibration leaves open; standard ones by default.
    usual : SensorErrorModel, optional
        In place of the standard, where no aircraft file describes the sensors: of another maker.

    Raises
    ------
    IdentificationError
        If inertial sensors or all air data are missing, or no part of the flight is long enough.
    NoAgreementError
        If the iteration does not converge.
    """
    problem, lagged_inputs, when = prepare_path_problem(columns, airframe, instrument, usual)
    vanes = AIR[1] in problem.model.outputs
    # Vanes see the gusts that the aircraft rides with; without them least squares do, and settle
    # where instruments lose themselves (four of six flights in calm air).
    fit = fit_path(problem, lagged_inputs if vanes else [x[:, :0] for x in lagged_inputs])
    if not fit.converged:
        raise NoAgreementError(
            "data compatibility: sensors could not be compared, the search did not converge in"
            f" {fit.iterations} iterations"
        )
    gps = GPS[0] in problem.model.outputs
    count = len(problem.common)
    covariance = fit.covariance[:count, :count]
    scales = [problem.common.index(name) for name in FLOW[::2]] if vanes else []
    covariance[scales, scales] += VANE_MODEL_SD**2
    priors = prior(instrument or usual, vanes=vanes)
    tests = (
        consistency_tests(problem.common, fit.theta[:count], covariance, priors)
        if gps
        else _tests_without_gps(problem.common, fit.theta[:count], covariance, priors)
    )
    found = {
        name: (float(fit.theta[k]), float(np.sqrt(covariance[k, k])))
        for k, name in enumerate(problem.common)
        if gps or name not in UNOBSERVABLE_WITHOUT_GPS
    }
    vane_delay = None if instrument is None else vane_delay_by_file(instrument, columns)
    if not vanes:  # one alone takes no part, and is as wrong as its calibration says
        every = prior(instrument or usual)
        priors |= {n: every[n] for n in FLOW if f"{n.split('_')[0]}_rad" in columns}
    findings = [_estimate(name, found, priors, vane_delay, gps=gps) for name in priors]
    squares = np.sum(np.hstack(fit.residuals) ** 2, axis=1)
    rms = {
        name: float(np.sqrt(q / problem.counted(name)))
        for name, q in zip(problem.model.outputs, squares, strict=True)
    }
    return Compatibility(tuple(findings), rms, when, gps, instrument, tests, vanes)


def _estimate(
    name: str,
    found: Mapping[str, tuple[float, float]],
    priors: Mapping[str, tuple[float, float]],
    vane_delay: tuple[float, float] | None,
    *,
    gps: bool,
) -> SensorErrorEstimate:
    """Return what is known of a sensor's error by the flight, else beforehand.

    Parameters
    ----------
    name : str
    found, priors : mapping
        Value and deviation by the flight, and beforehand.
    vane_delay : tuple of float, optional
        The vanes' by the aircraft file.
    gps : bool
    """
    sd = priors[name][1]
    value, deviation = found.get(name, priors[name])
    if not gps:
        deviation = min(NO_GPS_INFLATION * deviation, sd)
        if name == FLOW[1] and deviation < sd:
            value, deviation = _with_imu_errors((value, deviation), sd, priors)
    data_informed = deviation < POSTERIOR_PRIOR_RATIO * sd
    reason = "" if data_informed else _reason(name, gps=gps)
    if name in FLOW and name not in found:
        reason = ONE_VANE
    if (
        name == DELAYS[0]
        and vane_delay is not None
        and _known_better((value, deviation), vane_delay)
    ):
        sd, data_informed, reason = vane_delay[1], False, BY_FILE
    return SensorErrorEstimate(
        name=name,
        value=value,
        half_width=NORMAL_95 * deviation,
        prior_half_width=NORMAL_95 * sd,
        data_informed=data_informed,
        reason=reason,
    )


def by_calibration_alone(
    instrument: SensorErrorModel, found: Compatibility | None = None
) -> Compatibility:
    """Return a check in which each error is as open as its calibration leaves it.

    It stands where sensors came to no agreement, or where no aircraft file places them.

    Parameters
    ----------
    instrument : SensorErrorModel
    found : Compatibility, optional
        Agreement of sensors at unknown places: the zeros of its gyros need none, and stand.
    """
    known = {f.name: f for f in found.findings if f.data_informed} if found is not None else {}
    findings = (
        known[name]
        if name in known and name in GYRO_ZEROS
        else SensorErrorEstimate(
            name, mean, NORMAL_95 * sd, NORMAL_95 * sd, data_informed=False, reason=NO_AGREEMENT
        )
        for name, (mean, sd) in prior(instrument).items()
    )
    return Compatibility(tuple(findings), {}, (), gps=False, instrument=instrument)


def _tests_without_gps(
    names: Sequence[str],
    found: Array,
    covariance: Array,
    priors: Mapping[str, tuple[float, float]],
) -> tuple[ConsistencyTest, ...]:
    """Return the tests of the file by what is estimated without GPS.

    The zero of the alpha vane comes with the IMU's, and what comes out as a gyro's bias is off by
    as much again as the file says (in calm air 2.1 mrad/s about q of 2.0, known to 0.1): as they
    come out of the fit 7 of 40 right files are doubted.
    """
    found, covariance = found.copy(), NO_GPS_INFLATION**2 * covariance
    if FLOW[1] in names:
        k, sd = names.index(FLOW[1]), priors[FLOW[1]][1]
        before = float(np.sqrt(covariance[k, k]))
        after = sd
        if before < sd:
            found[k], after = _with_imu_errors((float(found[k]), before), sd, priors)
        covariance[k] *= after / before
        covariance[:, k] *= after / before
    found[[name in UNOBSERVABLE_WITHOUT_GPS for name in names]] /= np.sqrt(2.0)
    return consistency_tests(names, found, covariance, priors)


def _with_imu_errors(
    estimate: tuple[float, float], sd: float, priors: Mapping[str, tuple[float, float]]
) -> tuple[float, float]:
    """Return the zero of the alpha vane and its deviation with errors of the IMU, rad.

    Without GPS they are no unknowns: the zero takes the tilt and the bias along x, which look like
    it. 0.003 rad of either moves it by as much, known to 0.0009, and Cn_r by 0.5 %.

    Parameters
    ----------
    estimate : tuple of float
        The zero and its deviation where the IMU has no error.
    sd : float
        Deviation of the zero by its calibration.
    priors : mapping
        Mean and deviation of every error.
    """
    bias, tilt = priors["accel_x_bias_mps2"][1] / GRAVITY_MPS2, priors["imu_tilt_y_rad"][1]
    by_data = estimate[1] ** -2 - sd**-2
    looks_alike = 1.0 + by_data * (bias**2 + tilt**2)
    left = 1.0 / (by_data / looks_alike + sd**-2)
    return estimate[0] * estimate[1] ** -2 * left / looks_alike, float(np.sqrt(left))


def _known_better(estimate: tuple[float, float], by_file: tuple[float, float]) -> bool:
    """Return whether a file knows an error better than a flight, and the flight does not object.

    Value and deviation of each. In light turbulence a flight of two minutes tells the vanes' delay
    to 1.5 ms, a file to 0.6; 1.7 ms too much makes Cm_q 3 % small.
    """
    (value, sd), (nominal, by) = estimate, by_file
    agrees = abs(value - nominal) < CERTAIN_SD * np.hypot(sd, by)
    return bool(agrees and sd > POSTERIOR_PRIOR_RATIO * by)


def _reason(name: str, *, gps: bool) -> str:
    if gps:
        return REASONS.get(name, NOT_EXCITED)
    return REASONS_NO_GPS.get(name, NOT_EXCITED_NO_GPS)


def compatibility_lines(found: Compatibility) -> list[str]:
    """Return the verdict's paragraph: errors found, then those not informed and why."""
    lines = [
        f"data compatibility over {len(found.segments)} stretches,"
        f" {'with' if found.gps else 'without'} GPS{'' if found.vanes else ', without vanes'}:"
    ]
    significant = [f for f in found.findings if f.significant]
    for f in significant:
        name, factor = people_name(f.name)
        lines.append(f"  {name:20s} {factor * f.value:11.4g}  +- {factor * f.half_width:8.2g}")
    if not significant:
        lines.append("  no sensor error stands out of its interval")
    lines += [f"  {line}" for line in calibration_lines(found.calibration_tests)]
    reasons: dict[str, list[str]] = {}
    for f in found.findings:
        if not f.data_informed:
            reasons.setdefault(f.reason, []).append(f.name)
    for why, names in reasons.items():
        text = f"  not estimated: {', '.join(names)} ({why})"
        lines += textwrap.wrap(text, 100, initial_indent="  ", subsequent_indent="    ")
    return lines


def compatibility_document(found: Compatibility) -> dict[str, object]:
    """Return the result for JSON."""
    return {
        "gps": found.gps,
        "stretches_s": [list(s) for s in found.segments],
        "residual_rms": found.rms,
        "calibration": {
            c.name: {
                "times": c.rms_ratio,
                "directions": c.degrees_of_freedom,
                "probability": c.probability,
                "doubted": c.rejected,
            }
            for c in found.calibration_tests
        },
        "findings": {
            f.name: {
                "value": f.value,
                "half_width": f.half_width,
                "calibration_half_width": f.prior_half_width,
                "told": f.data_informed,
                "reason": f.reason,
            }
            for f in found.findings
        },
    }
