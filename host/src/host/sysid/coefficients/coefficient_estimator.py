"""The estimator of coefficients: from reconstructed flights to an answer, in four stages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.mass_properties import AirframeData, airframe_data
from host.aircraft.powerplant import (
    NoPropulsionError,
    Powerplant,
    powerplant,
    without_propeller,
)
from host.arrays import Array
from host.constants import NORMAL_95
from host.errors import IdentificationError
from host.instrument.deviations import SensorErrorModel, sensor_error_model
from host.instrument.error_list import by_cause
from host.sysid.aerodynamics.coefficient import Coefficient, CoefficientTable
from host.sysid.coefficients.coefficient_fit import METHOD, CoefficientFit
from host.sysid.coefficients.coefficient_intervals import (
    CoefficientIntervals,
    SearchResult,
    coefficient_fit,
    intervals,
    validation,
)
from host.sysid.coefficients.coefficient_modes import (
    LinearSystem,
    coefficient_modes,
    linear_systems,
)
from host.sysid.coefficients.coefficient_search import search_coefficients
from host.sysid.coefficients.deletion_diagnostics import CrossValidation
from host.sysid.coefficients.flight_terms import flight_terms
from host.sysid.coefficients.hidden_lag import lagging_moments
from host.sysid.coefficients.pooled_flights import pool_fits
from host.sysid.coefficients.window_spectra import SHORTEST_S, ResidualSpectra, Window
from host.sysid.flight.reconstructed_flight import (
    ReconstructedFlight,
    maneuver_name,
)
from host.sysid.maneuvers.maneuver_detection import FLYING_SHARE, REACH_BACK_S, DetectedManeuver
from host.sysid.models.coefficient_model import BODY, WIND, CoefficientModel, standard_model
from host.sysid.models.modal_analysis import Mode
from host.sysid.models.uncertainty import dominant_error_source

NAME = "coefficients"
SETTLED_S = 3.0  # after the launch
LONGITUDINAL = (*WIND, *BODY, "Cm")


@dataclass(frozen=True)
class CoefficientAnswer:
    """Coefficients estimated directly from flights, with modes and linear systems.

    Attributes
    ----------
    model : CoefficientModel
    fit : CoefficientFit
    used : tuple of Found
        Maneuvers.
    flights : tuple of int
        Flight of each maneuver, from 0.
    windows : tuple of Window
        Spans that were fitted.
    causes : dict
        Coefficient to the group of errors that widens it most, and its share of the variance.
    modes : tuple of Mode
    systems : dict
        ``longitudinal`` and ``lateral`` linear systems.
    delays : dict
        Residual delay (s) and 95 % half-width.
    remarks : tuple of str
        What was left out or assumed, because the flights lack what would tell it.
    lagging : tuple of str
        Moments that a lag of surfaces seems to move by more than an interval.
    """

    model: CoefficientModel
    fit: CoefficientFit
    used: tuple[DetectedManeuver, ...]
    flights: tuple[int, ...]
    windows: tuple[Window, ...]
    causes: dict[str, tuple[str, float]]
    modes: tuple[Mode, ...]
    systems: dict[str, LinearSystem]
    delays: dict[str, tuple[float, float]]
    remarks: tuple[str, ...] = ()
    lagging: tuple[str, ...] = ()

    @property
    def template(self) -> str:
        """Name of this answer among those of linear models."""
        return NAME

    @property
    def maneuvers(self) -> tuple[str, ...]:
        """Names of the maneuvers, with the number of the flight if there are several."""
        several = max(self.flights, default=0) > 0
        return tuple(
            maneuver_name(item) + (f" of flight {k + 1}" if several else "")
            for item, k in zip(self.used, self.flights, strict=True)
        )

    @property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """The derivatives with standard errors."""
        return tuple(
            Coefficient(d.name, d.value, d.half_width / NORMAL_95, d.half_width)
            for d in self.fit.derivatives
        )

    @property
    def tables(self) -> tuple[CoefficientTable, ...]:
        """Coefficients of the longitudinal and of the lateral maneuvers."""
        alpha = self.fit.condition.alpha_rad
        along = tuple(c for c in self.coefficients if c.name[:2] in LONGITUDINAL)
        across = tuple(c for c in self.coefficients if c.name[:2] not in LONGITUDINAL)
        return (
            CoefficientTable("longitudinal", METHOD, alpha, along),
            CoefficientTable("lateral", METHOD, alpha, across),
        )


@dataclass(frozen=True)
class CoefficientEstimate:
    """The estimate of one flight: end of the search, maneuvers and their windows."""

    search: SearchResult
    used: tuple[DetectedManeuver, ...]
    windows: tuple[Window, ...]
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class CoefficientEstimator:
    """Force and moment equations with sensor errors, in the stages of the pipeline.

    Attributes
    ----------
    airframe : AirframeData
    powerplant : Powerplant
    instrument : SensorErrorModel
        Standard deviations of the sensor errors.
    model : CoefficientModel
        The terms of every coefficient.
    known_noise : ResidualSpectra or None
        Spectra of the residuals in place of those of the flight.
    """

    airframe: AirframeData
    powerplant: Powerplant
    instrument: SensorErrorModel
    model: CoefficientModel
    known_noise: ResidualSpectra | None = None

    def estimate(self, flights: Sequence[ReconstructedFlight]) -> tuple[CoefficientEstimate, ...]:
        """Estimate coefficients and sensor errors jointly, flight by flight.

        Raises
        ------
        IdentificationError
            If a column or an axis is missing, or a term cannot be determined at all.
        """
        return tuple(self._of_one(flight) for flight in flights)

    def intervals(
        self, estimate: tuple[CoefficientEstimate, ...]
    ) -> tuple[CoefficientIntervals, ...]:
        """Return derivatives with intervals: geometric prior, scatter and every error included."""
        return tuple(intervals(one.search) for one in estimate)

    def validation(
        self,
        estimate: tuple[CoefficientEstimate, ...],
        widths: tuple[CoefficientIntervals, ...],
    ) -> tuple[CrossValidation | None, ...]:
        """Predict each maneuver by all others of its flight."""
        return tuple(validation(one.search) for one in estimate)

    def answer(
        self,
        estimate: tuple[CoefficientEstimate, ...],
        widths: tuple[CoefficientIntervals, ...],
        predicted: tuple[CrossValidation | None, ...],
    ) -> CoefficientAnswer:
        """Return the parts of all stages as one answer, with modes and main error sources."""
        fits = [
            coefficient_fit(one.search, width, prediction)
            for one, width, prediction in zip(estimate, widths, predicted, strict=True)
        ]
        fit = pool_fits(fits)
        return CoefficientAnswer(
            model=self.model,
            fit=fit,
            used=tuple(f for one in estimate for f in one.used),
            flights=tuple(k for k, one in enumerate(estimate) for _ in one.used),
            windows=tuple(w for one in estimate for w in one.windows),
            causes=_main_causes(fit),
            modes=coefficient_modes(fit, self.airframe),
            systems=linear_systems(fit, self.airframe),
            delays=_delays(fit, self.instrument),
            remarks=tuple(dict.fromkeys(r for one in estimate for r in one.remarks)),
            lagging=lagging_moments([one.search for one in estimate], fit.derivatives),
        )

    def _of_one(self, flight: ReconstructedFlight) -> CoefficientEstimate:
        columns = flight.recorded
        if "airspeed_mps" not in columns:
            raise IdentificationError("coefficients need airspeed_mps, which the data do not have")
        # Who gives a stretch has looked: it may begin with the record.
        given = any(f.given for f in flight.maneuvers)
        flying = _airborne_samples(columns, 0.0 if given else SETTLED_S)
        t = columns["t_s"][flying]
        if len(t) == 0:
            raise IdentificationError(
                f"coefficients need more than the {SETTLED_S:.0f} s after the launch, which are"
                " left out; the flight ends before"
            )
        found = [f for f in flight.maneuvers if _fits_in(f, t)]
        spans = [replace(w, first_s=max(w.first_s, float(t[0]))) for w in merged_windows(found)]
        terms = flight_terms(
            self.model, {k: v[flying] for k, v in columns.items()}, spans, self.powerplant
        )
        search = search_coefficients(
            terms.columns,
            terms.windows,
            self.airframe,
            flight.instrument or self.instrument,
            self.powerplant,
            terms.model,
            terms.assumed,
            self.known_noise,
        )
        axes = {w.longitudinal for w in terms.windows}
        used = tuple(f for f in found if (f.axis == "elevator_rad") in axes)
        remarks = (*terms.remarks, *_moving_air(search))
        return CoefficientEstimate(search, used, terms.windows, remarks)


def _fits_in(found: DetectedManeuver, t: Array) -> bool:
    """Return whether a maneuver of a surface, its trim before it, lies in a record's time."""
    first_s = found.start_s - (0.0 if found.given else REACH_BACK_S)
    long_enough = found.end_s - found.start_s + REACH_BACK_S >= SHORTEST_S
    inside = t[0] <= first_s and found.end_s <= t[-1]
    return found.axis != "throttle" and long_enough and bool(inside)


def coefficient_estimator(
    aircraft: str,
    *,
    model: CoefficientModel | None = None,
    airframe: AirframeData | None = None,
    instrument: SensorErrorModel | None = None,
) -> CoefficientEstimator:
    """Return the estimator of an aircraft by name or file."""
    airframe, data = airframe or airframe_data(aircraft), instrument or sensor_error_model(aircraft)
    try:
        plant = powerplant(aircraft)
    except NoPropulsionError:
        plant = without_propeller()
    return CoefficientEstimator(airframe, plant, data, model or standard_model())


def merged_windows(found: Sequence[DetectedManeuver]) -> list[Window]:
    """Return the windows of maneuvers; overlapping aileron and rudder maneuvers are one."""
    windows: list[Window] = []
    for item in sorted(found, key=lambda f: (f.axis != "elevator_rad", f.start_s)):
        along = item.axis == "elevator_rad"
        first, last = item.start_s - REACH_BACK_S, item.end_s
        if windows and not along and not windows[-1].longitudinal:
            before = windows[-1]
            if first < before.last_s - SHORTEST_S:
                windows[-1] = Window(before.first_s, max(last, before.last_s), longitudinal=False)
                continue
        windows.append(Window(first, last, along))
    return windows


def _moving_air(search: SearchResult) -> list[str]:
    """Return a remark where air pitched or rolled; it is in no equation but as noise."""
    parts = [f"{n} {100.0 * share:.0f} %" for n, share in search.least_squares_shares.items()]
    if not parts:
        return []
    return [
        f"air that pitches or rolls: least squares would find {', '.join(parts)} of these;"
        " intervals are widened, use with care"
    ]


def _airborne_samples(columns: Mapping[str, Array], settled_s: float) -> slice:
    """Return the samples from some seconds after the launch to the end of the flight."""
    t, speed = columns["t_s"], columns["airspeed_mps"]
    up = np.flatnonzero(speed > FLYING_SHARE * float(np.median(speed)))
    first = int(np.searchsorted(t, t[up[0]] + settled_s, side="right"))
    return slice(first, int(up[-1]) + 1)


def _main_causes(fit: CoefficientFit) -> dict[str, tuple[str, float]]:
    """Return for each coefficient the group of errors that contributes most to its variance."""
    count, names = len(fit.derivatives), list(fit.errors)
    result, causes = {}, by_cause(names)
    for k, d in enumerate(fit.derivatives):
        shares = {}
        for cause, members in causes.items():
            at = [count + names.index(m) for m in members]
            with_them = fit.covariance[k, at]
            narrowed = with_them @ np.linalg.solve(fit.covariance[np.ix_(at, at)], with_them)
            shares[cause] = float(narrowed / max(fit.covariance[k, k], 1e-300))
        if cause := dominant_error_source(shares, 1.0):
            result[d.name] = (cause, shares[cause])
    return result


def _delays(fit: CoefficientFit, sensors: SensorErrorModel) -> dict[str, tuple[float, float]]:
    """Return residual delays (s) of IMU and vanes with 95 % half-widths."""
    omega = 2.0 * np.pi * sensors.vane_hz_per_mps * sensors.friction_speed_mps
    vane_s = 2.0 * sensors.vane_damping / omega  # delay of a second-order vane
    table = {"delay_imu_s": ("imu_delay_s", 1.0)}
    table |= {f"delay_{k}_s": (f"{k}_lag_share", -vane_s) for k in ("alpha", "beta")}
    return {
        name: (scale * fit.errors[key][0], NORMAL_95 * abs(scale) * fit.errors[key][1])
        for name, (key, scale) in table.items()
    }
