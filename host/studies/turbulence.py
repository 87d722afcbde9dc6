"""Filter error against output error in Dryden turbulence, open loop and with a pilot correcting.

Ultra Stick 25e in the twin's gusts, linear (`gusts`) or as it is (`nonlinear_gusts`); its
coefficients are the parameters of the fit. The model of filter error has the Dryden form, with the
turning and rolling of the air that comes with it; intensity and time scale are estimated (the scale
within a factor of two or so of the one that belongs to the height). Fits start from output error,
that from its own equation error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from host.arrays import Array, BoolArray
from host.errors import IdentificationError
from host.sysid.estimators import fit
from host.sysid.estimators.filter_error import information_at
from host.sysid.estimators.gust_model import ROLL_GUST, gust_model
from host.sysid.models import LinearModel, Maneuver

from studies.gusts import AXES, NOISE, fly, gusty_aircraft, spectrum
from studies.nonlinear_gusts import fly_nonlinear, varying

SCALE_SHARE = 0.5  # how well the fit knows the length of the gusts beforehand
PROCESS = {"longitudinal": ("gust_rad", "airspeed_mps"), "lateral": ("gust_rad", ROLL_GUST)}
INTENSITIES_MPS = (0.5, 1.0)
LIMIT_RATIO = 3.0
LIMIT_BOUND = 1.3
LIMIT_MEAN = 0.03


@dataclass(frozen=True)
class GustCase:
    """Both methods over many flights of one case; arrays have one entry per coefficient.

    Attributes
    ----------
    intensity_mps, pilot, nonlinear
        Conditions of the case.
    names : tuple of str
    flights, failed : int
        Maneuvers are flown on both axes of each flight; `failed` counts fits that gave no answer.
    filter_rms, output_rms : Array
        Root mean square error over the truth.
    bound : Array
        Cramer-Rao bound of the stochastic model, turbulence and sensor noise known, over the truth;
        for the non-linear aircraft that of the linear one.
    filter_mean, output_mean, filter_scatter : Array
        Mean error over the truth, and the standard error of that mean.
    filter_covered, output_covered : float
        Share of 95 % intervals that hold the truth.
    """

    intensity_mps: float
    pilot: bool
    nonlinear: bool
    names: tuple[str, ...]
    flights: int
    failed: int
    filter_rms: Array
    output_rms: Array
    bound: Array
    filter_mean: Array
    output_mean: Array
    filter_scatter: Array
    filter_covered: float
    output_covered: float

    @property
    def close(self) -> BoolArray:
        """Whether each error is a third of output error's, or within 1.3 bounds."""
        return (LIMIT_RATIO * self.filter_rms <= self.output_rms) | (
            self.filter_rms <= LIMIT_BOUND * self.bound
        )

    @property
    def unbiased(self) -> BoolArray:
        """Whether each mean error is within 3 % and two standard errors."""
        return np.abs(self.filter_mean) <= LIMIT_MEAN + 2.0 * self.filter_scatter


@dataclass(frozen=True)
class GustSetup:
    """What one axis is fitted with: without and with the gust as a state; the second has more."""

    axis: str
    plain: LinearModel
    wide: LinearModel

    @property
    def picked(self) -> list[int]:
        """Places of the judged coefficients."""
        return [[p.name for p in self.plain.parameters].index(name) for name in AXES[self.axis]]


@dataclass(frozen=True)
class _Axis:
    filter_error: Array  # (flights, coefficients)
    output_error: Array
    filter_inside: Array
    output_inside: Array
    bound: Array
    failed: int


def fitted_model(axis: str) -> LinearModel:
    """Return the model that filter error fits: coefficients, gusts of unknown intensity and
    scale."""
    plane = gusty_aircraft()
    return gust_model(
        plane.models[axis],
        plane.airspeed_mps,
        spectrum(axis, 1.0).length_m,
        span_m=plane.airframe.span_m,
        scale_share=SCALE_SHARE,
    )


def true_vector(axis: str, intensity_mps: float) -> Array:
    """Return everything filter error estimates, at the truth: zero biases, rest, gusts, noise."""
    plane, wide, air = gusty_aircraft(), fitted_model(axis), spectrum(axis, intensity_mps)
    process = {"gust_rad": air.angle, "airspeed_mps": air.along_mps, ROLL_GUST: air.roll_radps}
    noise = [NOISE[name] for name in wide.outputs]
    return np.concatenate(
        [
            plane.truth[axis],
            [plane.airspeed_mps / air.length_m],
            np.zeros(len(wide.local_names(1))),
            np.log([process[name] for name in PROCESS[axis]]),
            np.log(noise),
        ]
    )


def linear_setup(axis: str) -> GustSetup:
    """Return the model that is fitted to the linear aircraft."""
    return GustSetup(axis, gusty_aircraft().models[axis], fitted_model(axis))


def nonlinear_setup(axis: str, airspeed_mps: float) -> GustSetup:
    """Return the model that is fitted to the non-linear one: departures from trim added.

    Parameters
    ----------
    axis : str
    airspeed_mps : float
        Mean of the flight: gusts come quicker and turn the air less when it is higher.
    """
    plane, flown = gusty_aircraft(airspeed_mps), varying(axis, airspeed_mps)
    wide = gust_model(
        flown.model,
        plane.airspeed_mps,
        spectrum(axis, 1.0).length_m,
        span_m=plane.airframe.span_m,
        scale_share=SCALE_SHARE,
    )
    return GustSetup(axis, flown.model, wide)


def fit_both(
    setup: GustSetup, maneuver: Maneuver, truth: Array
) -> tuple[Array, Array, Array, Array]:
    """Return errors over truth and half-widths over truth: filter error's two, output error's two.

    Parameters
    ----------
    setup : GustSetup
    maneuver : Maneuver
    truth : Array
        Truth of the judged coefficients.

    Raises
    ------
    IdentificationError
        If either method gives no answer, or filter error has not converged.
    """
    count = len(setup.plain.parameters)
    # The start values of the model are the truth: the fits must not see them.
    plain = setup.plain.with_start(np.zeros(count))
    first = fit("output-error-white", plain, [maneuver])
    more = [p.start for p in setup.wide.parameters[count:]]
    start = np.concatenate([first.estimate[:count], more, first.estimate[count:]])
    process = PROCESS[setup.axis]
    ours = fit(
        "filter-error", setup.wide, [maneuver], process=process, start=start, compare_noise=False,
        hac=True,
    )  # fmt: skip
    if not ours.converged:
        raise IdentificationError(f"{maneuver.name}: {ours.warnings[0]}")
    size, picked = np.abs(truth), setup.picked
    return (
        (ours.estimate[picked] - truth) / size,
        ours.half_width()[picked] / size,
        (first.estimate[picked] - truth) / size,
        first.half_width()[picked] / size,
    )


def _run_axis(
    axis: str, intensity_mps: float, flights: int, *, pilot: bool, nonlinear: bool
) -> _Axis:
    seeds = range(flights)
    linear = fly(axis, intensity_mps, seeds, with_pilot=pilot)
    if nonlinear:
        flown = fly_nonlinear(axis, intensity_mps, seeds, with_pilot=pilot)
        data = [
            (
                nonlinear_setup(axis, f.airspeed_mps),
                f.maneuver,
                np.array([f.truth[name] for name in AXES[axis]]),
            )
            for f in flown
        ]
    else:
        setup = linear_setup(axis)
        data = [(setup, m, gusty_aircraft().truth[axis][setup.picked]) for m in linear]
    rows: list[tuple[Array, Array, Array, Array]] = []
    failed = 0
    for setup, maneuver, truth in data:
        try:
            rows.append(fit_both(setup, maneuver, truth))
        except IdentificationError:
            failed += 1
    ours, half, plain, plain_half = (np.array(column) for column in zip(*rows, strict=True))
    return _Axis(
        ours,
        plain,
        np.abs(ours) <= half,
        np.abs(plain) <= plain_half,
        _bounds(axis, intensity_mps, linear),
        failed,
    )


def _bounds(axis: str, intensity_mps: float, linear: Sequence[Maneuver]) -> Array:
    """Return the bounds of the axis's coefficients over the truth; the gusts' scale is known."""
    wide, plane = fitted_model(axis), gusty_aircraft()
    truth = true_vector(axis, intensity_mps)
    known = len(truth) - len(PROCESS[axis]) - len(wide.outputs)
    parts = [information_at(wide, [m], PROCESS[axis], truth)[:known, :known] for m in linear]
    information = np.sum(parts, axis=0) / len(parts)
    names = [p.name for p in wide.parameters]
    keep = np.array([k for k in range(known) if k != names.index("gust_rate")])
    covariance = np.linalg.pinv(information[np.ix_(keep, keep)], hermitian=True)
    picked = [names.index(name) for name in AXES[axis]]  # before gust_rate: places hold
    return np.asarray(np.sqrt(np.diag(covariance)[picked]) / np.abs(plane.truth[axis][picked]))


def run_case(
    intensity_mps: float, flights: int, *, pilot: bool, nonlinear: bool = False
) -> GustCase:
    """Fly and fit one case on both axes."""
    runs = {
        axis: _run_axis(axis, intensity_mps, flights, pilot=pilot, nonlinear=nonlinear)
        for axis in AXES
    }

    def joined(pick: str, how: str) -> Array:
        parts = [getattr(run, pick) for run in runs.values()]
        if how == "rms":
            return np.concatenate([np.sqrt(np.mean(p**2, axis=0)) for p in parts])
        if how == "mean":
            return np.concatenate([np.mean(p, axis=0) for p in parts])
        return np.concatenate([np.std(p, axis=0, ddof=1) / np.sqrt(len(p)) for p in parts])

    def share(pick: str) -> float:
        return float(np.mean(np.concatenate([getattr(r, pick).ravel() for r in runs.values()])))

    return GustCase(
        intensity_mps=intensity_mps,
        pilot=pilot,
        nonlinear=nonlinear,
        names=tuple(name for axis in AXES for name in AXES[axis]),
        flights=flights,
        failed=sum(run.failed for run in runs.values()),
        filter_rms=joined("filter_error", "rms"),
        output_rms=joined("output_error", "rms"),
        bound=np.concatenate([run.bound for run in runs.values()]),
        filter_mean=joined("filter_error", "mean"),
        output_mean=joined("output_error", "mean"),
        filter_scatter=joined("filter_error", "scatter"),
        filter_covered=share("filter_inside"),
        output_covered=share("output_inside"),
    )
