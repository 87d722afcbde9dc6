"""What one test point tells by itself: the widths that a verdict in flight is measured against.

A card's points are flown together with others like them, and identification uses them all. Whether
this one was worth flying is another question: here it is flown alone, some times, in gusts and
with every tolerance, and identified as a real flight of it would be.

By the estimator that flies along (`host live`, equation error with the instrument's errors): of one
point its half-widths repeat within a fifth from flight to flight, those of the default linear
method within a factor of two (`studies/point_verdicts.md`), and no verdict tells luck. Roll's
equation needs an aileron: a rudder alone informs those of side force and yaw.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import pandas as pd

from host.arrays import Array
from host.errors import UsageError
from host.planning.predicted_widths import (
    FIRST_SEED,
    FLIGHTS,
    FlightWidth,
    PredictedWidth,
    Progress,
    coefficient_widths,
    flown_columns,
    predict_widths,
)
from host.sysid.coefficients import CoefficientModel, ResidualSpectra, standard_model
from host.sysid.coefficients.coefficient_estimator import coefficient_estimator
from host.sysid.flight import reconstruct_flight
from host.sysid.maneuvers import DetectedManeuver, detect_maneuvers
from host.twin.testcard.cards import Card, Segment

# What an input on an axis is flown for: damping, stiffness and control of the mode it excites.
AXIS_DERIVATIVES = {
    "elevator": ("Cm_alpha", "Cm_q", "Cm_de"),
    "aileron": ("Cl_p", "Cl_da"),
    "rudder": ("Cn_beta", "Cn_r", "Cn_dr"),
    "throttle": (),
}
TRIM_BEFORE_S, TRIM_BEHIND_S = 9.0, 8.0  # reconstruction needs 12 s of flight


@dataclass(frozen=True, slots=True)
class PointPromise:
    """Half-widths that one test point alone will give.

    Attributes
    ----------
    kind : str
        Input, as test cards name it.
    axes : tuple of str
    amplitudes : tuple of float
        One per axis, deg.
    width_s : float
        Length of a step of the input.
    widths : tuple of PredictedWidth
        Widths of the derivatives in `AXIS_DERIVATIVES` of its axes; medians of some flights.
    failures : tuple of str
        Why a flight gave no answer.
    recorded : bool
        Flown through the recorder's own program; False where there is no compiler to build it.
    noise : ResidualSpectra
        Spectra of the residuals of each equation: geometric means of these flights.
    """

    kind: str
    axes: tuple[str, ...]
    amplitudes: tuple[float, ...]
    width_s: float
    widths: tuple[PredictedWidth, ...]
    failures: tuple[str, ...]
    recorded: bool = True
    noise: ResidualSpectra = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SinglePoint:
    """What the flight of one test point tells.

    Attributes
    ----------
    widths : dict of str to FlightWidth
        Intervals of the derivatives that it is flown for.
    noise : ResidualSpectra
        That they were weighted by.
    """

    widths: dict[str, FlightWidth]
    noise: ResidualSpectra


def test_points(card: Card) -> list[Segment]:
    """Return the segments of a card that are test points, in its order."""
    return [s for s in card.segments if s.kind not in ("trim", "turn")]


def single_point_card(card: Card, point: Segment) -> Card:
    """Return the card with one test point and rest about it."""
    rest = [Segment("trim", duration_s=s) for s in (TRIM_BEFORE_S, TRIM_BEHIND_S)]
    return replace(card, segments=(rest[0], point, rest[1]), faults=())


def point_derivatives(point: Segment) -> tuple[str, ...]:
    """Return the derivatives that a test point is flown for."""
    return tuple(name for axis in point.axes for name in AXIS_DERIVATIVES[axis])


def identify_single_point(
    point: Segment,
    table: pd.DataFrame,
    aircraft: str,
    known: DetectedManeuver | None = None,
    noise: ResidualSpectra | None = None,
) -> SinglePoint:
    """Return what the flight of one test point tells.

    Parameters
    ----------
    point : Segment
    table : DataFrame
        As `virtual_flight` returns it.
    aircraft : str
        Name or file.
    known : DetectedManeuver, optional
        When its input was flown; without, it is looked for.
    noise : ResidualSpectra, optional
        Spectra of the residuals in place of those of this flight.

    Raises
    ------
    IdentificationError
        No equation can be identified.
    """
    columns, instrument = flown_columns(table, aircraft)
    own = [known] if known else detect_maneuvers(columns)
    own = [m for m in own if m.axis.removesuffix("_rad") in point.axes]
    by = replace(
        coefficient_estimator(aircraft, model=_model_of(point), instrument=instrument),
        known_noise=noise,
    )
    estimate = by.estimate([reconstruct_flight(columns, own)])
    [found], [one] = by.intervals(estimate), estimate
    widths = coefficient_widths(found)
    return SinglePoint(
        {name: widths[name] for name in point_derivatives(point) if name in widths},
        one.search.final.noise,
    )


def _model_of(point: Segment) -> CoefficientModel:
    """Return the equations that a point informs: a rudder alone hardly rolls."""
    model = standard_model()
    if point.axes != ("rudder",):
        return model
    return replace(model, equations={k: v for k, v in model.equations.items() if k != "Cl"})


def promise_points(
    card: Card,
    gusts_mps: float | None = None,
    *,
    flights: int = FLIGHTS,
    first_seed: int = FIRST_SEED,
    progress: Progress | None = None,
) -> list[PointPromise]:
    """Fly each different test point of a card alone and say what it will tell.

    Parameters
    ----------
    card : Card
    gusts_mps : float, optional
        Standard deviation of the vertical gust; the card's, or that of a calm morning.
    flights : int
        Flights of each point.
    first_seed : int
    progress : callable, optional
        Called with the share that is done.

    Returns
    -------
    list of PointPromise
        In the order of the card; none for a point that no derivative is named for.
    """
    points = [p for p in dict.fromkeys(test_points(card)) if point_derivatives(p)]
    return [
        _promised(card, point, gusts_mps, flights, first_seed, _part(progress, k, points))
        for k, point in enumerate(points)
    ]


def _promised(
    card: Card,
    point: Segment,
    gusts_mps: float | None,
    flights: int,
    first_seed: int,
    progress: Progress | None,
) -> PointPromise:
    # Through the recorder: without it half-widths of N_r were half of those that its log gives, of
    # L_p four fifths.
    point_card = single_point_card(card, point)
    spectra: list[ResidualSpectra] = []

    def widths_of(table: pd.DataFrame, aircraft: str) -> dict[str, FlightWidth]:
        found = identify_single_point(point, table, aircraft)
        spectra.append(found.noise)
        return found.widths

    fly = partial(
        predict_widths, point_card, gusts_mps, flights=flights, first_seed=first_seed,
        widths_of=widths_of, progress=progress,
    )  # fmt: skip
    try:
        found, recorded = fly(chain="sitl"), True
    except UsageError:  # no compiler to build it
        found, recorded = fly(), False
    widths = {w.name: w for w in found.widths}
    kept = tuple(widths[name] for name in point_derivatives(point) if name in widths)
    return PointPromise(
        point.kind, point.axes, point.amplitudes, point.width_s, kept, found.failures, recorded,
        _mean_spectra(spectra),
    )  # fmt: skip


def _mean_spectra(flights: Sequence[ResidualSpectra]) -> dict[str, tuple[Array, Array]]:
    """Return the geometric mean of the residual spectra of some flights, by equation."""
    found: dict[str, list[tuple[Array, Array]]] = {}
    for spectra in flights:
        for equation, spectrum in spectra.items():
            found.setdefault(equation, []).append(spectrum)
    return {
        equation: (each[0][0], np.exp(np.mean([np.log(power) for _, power in each], axis=0)))
        for equation, each in found.items()
    }


def _part(progress: Progress | None, done: int, points: Sequence[Segment]) -> Progress | None:
    if progress is None:
        return None
    return lambda share: progress((done + share) / len(points))
