"""What all that was received so far says of the derivatives: one call, no state of the page.

The estimator is that of `host identify --model coefficients`: equation error in the frequency
domain, residual spectra and every tolerance of the instrument in the intervals. So what the page
says is what the same command says later of the same data.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from host.arrays import Array
from host.errors import IdentificationError
from host.instrument.deviations import SensorErrorModel
from host.log import read_log
from host.planning.next_point import INPUT_NAMES, KnownWidth
from host.planning.predicted_widths import FlightWidth, coefficient_widths
from host.sysid.coefficients import CoefficientAnswer
from host.sysid.coefficients.coefficient_estimator import (
    CoefficientEstimator,
    coefficient_estimator,
)
from host.sysid.flight import FlightColumns, maneuver_name, read_flight_columns, reconstruct_flight
from host.sysid.maneuvers import DetectedManeuver, detect_maneuvers
from host.sysid.pipeline import AircraftData, aircraft_data
from host.sysid.pipeline.surface_travel import with_surface_angles
from host.sysid.reconstruction.servo_response import surface_positions
from host.twin.testcard.cards import Segment
from host.twin.testcard.input_shapes import STEPS

# What a surface does is known once it was flown: from a stick that was only held its interval held
# the truth in 3 of 11.
_AXIS_OF = {"de": "elevator_rad", "da": "aileron_rad", "dr": "rudder_rad"}
_INPUT_S = 0.3  # shorter: a rest of one that a gap cut off
_SETTLED_S = 0.2  # behind the end of a test point: its last rows have arrived


@dataclass(frozen=True, slots=True)
class FlightEstimate:
    """Derivatives as far as the flight tells them.

    Attributes
    ----------
    until_s : float
        Last row, s.
    points : tuple of str
        Test points that are completed.
    under_way : str
        The one being flown; empty if none.
    values : dict of str to (float, float)
        Estimate and half-width of its 95 % interval.
    known : dict of str to KnownWidth
        The same in per cent, and what of it no test point makes smaller.
    flown : tuple of Segment
        The completed test points as they were flown.
    answer : CoefficientAnswer or None
        All of it; None before anything can be estimated.
    why_not : str
        Why there is none, or none of one axis.
    """

    until_s: float
    points: tuple[str, ...]
    under_way: str
    values: dict[str, tuple[float, float]]
    answer: CoefficientAnswer | None = None
    why_not: str = ""
    known: dict[str, KnownWidth] = field(default_factory=dict)
    flown: tuple[Segment, ...] = ()


class FlightEstimator:
    """Estimates from a recording that still grows.

    Parameters
    ----------
    aircraft : str
        Name or file.
    calibration : Path, optional
        Counts to SI; that of the recording's head without.

    Raises
    ------
    HostError
        If one of the two cannot be read.
    """

    def __init__(self, aircraft: str, calibration: Path | None = None) -> None:
        self._calibration = calibration
        self._known: AircraftData = aircraft_data(aircraft, calibration)
        self._by: CoefficientEstimator = coefficient_estimator(
            self._known.source, instrument=self._known.instrument
        )

    def at(self, recording: Path) -> FlightEstimate:
        """Estimate from all that the recording holds now.

        Parameters
        ----------
        recording : Path
            Ground capture, or a log.

        Raises
        ------
        HostError
            If nothing can be read.
        """
        read = read_flight_columns(read_log(recording, calibration=self._calibration))
        return self.of(read)

    def of(self, read: FlightColumns) -> FlightEstimate:
        """Estimate from columns as `read_flight_columns` returns them."""
        columns, _ = with_surface_angles(read.columns, read.shares, self._known)
        instrument = self._known.flown(read)
        columns = surface_positions(columns, instrument)
        until_s = float(columns["t_s"][-1])
        found = [m for m in detect_maneuvers(columns) if m.axis != "throttle"]
        done, under_way = _points(found, until_s - _SETTLED_S)
        answers, why_not = self._answers(columns, found, read, instrument)
        widths = {
            name: width
            for answer in answers
            for name, width in coefficient_widths(answer.fit).items()
            if _AXIS_OF.get(name.rpartition("_")[2], "") in _moved(answer)
        }
        return FlightEstimate(
            until_s,
            tuple(maneuver_name(one) for one in done),
            under_way,
            {name: (float(w.value), float(w.half_width)) for name, w in widths.items()},
            answers[0] if answers else None,
            why_not,
            {name: _known(w) for name, w in widths.items() if w.value},
            tuple(_as_flown(one) for one in done),
        )

    def _answers(
        self,
        columns: Mapping[str, Array],
        found: list[DetectedManeuver],
        read: FlightColumns,
        instrument: SensorErrorModel,
    ) -> tuple[list[CoefficientAnswer], str]:
        """Return one answer of all; where there is none, those of the axes that have one.

        A first aileron doublet that losses cut to pieces shall not take the pitch axis with it.
        """
        along = [m for m in found if m.axis == "elevator_rad"]
        across = [m for m in found if m.axis != "elevator_rad"]
        answers, failed = [], ""
        for chosen in (found, along, across):
            if chosen is not found and len(chosen) in (0, len(found)):
                continue
            try:
                answers.append(self._answer(columns, chosen, read, instrument))
            except IdentificationError as error:
                failed = failed or str(error)
            if chosen is found and answers:
                break
        return answers, failed

    def _answer(
        self,
        columns: Mapping[str, Array],
        found: list[DetectedManeuver],
        read: FlightColumns,
        instrument: SensorErrorModel,
    ) -> CoefficientAnswer:
        """Run the stages of the estimator but its validation, which changes no number of these."""
        if not found:
            raise IdentificationError("no test point yet")
        flight = reconstruct_flight(
            columns,
            found,
            instrument=instrument,
            findings=read.findings,
            resolution=read.resolution,
        )
        estimate = self._by.estimate([flight])
        widths = self._by.intervals(estimate)
        return self._by.answer(estimate, widths, tuple(None for _ in estimate))


def _moved(answer: CoefficientAnswer) -> set[str]:
    """Return the surfaces whose input is in the estimate, and the empty word for what needs none.

    An input that a gap took may have left the response alone.
    """
    return {"", *(m.axis for m in answer.used if m.input_end_s - m.start_s > _INPUT_S)}


def _known(width: FlightWidth) -> KnownWidth:
    percent = 100.0 * abs(width.half_width / width.value)
    return KnownWidth(percent, percent * math.sqrt(max(1.0 - width.noise_share, 0.0)))


def _as_flown(one: DetectedManeuver) -> Segment:
    """Return a test point that was found as a card would have it."""
    kind = next((k for k in STEPS if INPUT_NAMES.get(k, k) == one.kind), "doublet")
    units = sum(length for _, length in STEPS[kind])
    return Segment(
        kind,
        axes=(one.axis.removesuffix("_rad"),),
        amplitudes=(round(math.degrees(one.amplitude), 1),),
        width_s=round((one.input_end_s - one.start_s) / units, 2),
    )


def _points(found: list[DetectedManeuver], until_s: float) -> tuple[list[DetectedManeuver], str]:
    """Return completed test points and the name of the one being flown, if any.

    A test point that a gap divided is one: its parts have the amplitude of the whole.
    """
    parts: dict[tuple[str, float], list[DetectedManeuver]] = {}
    for one in found:
        parts.setdefault((one.axis, one.amplitude), []).append(one)
    done = [p for p in parts.values() if p[-1].end_s < until_s]
    open_ones = [p for p in parts.values() if p[-1].end_s >= until_s]
    return [p[0] for p in done], maneuver_name(open_ones[-1][0]) if open_ones else ""
