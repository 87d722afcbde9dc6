"""A process that estimates: the loop that receives never waits for it.

It is asked with the place of the recording and answers with plain data. It dies with its parent,
and a mistake in it costs an answer, not the recording.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

from host.errors import HostError
from host.live.worker_process import WorkerEndedError, WorkerProcess

if TYPE_CHECKING:
    from host.planning.next_point import NextPoint, NextPoints


@dataclass(frozen=True, slots=True)
class Answered:
    """What the worker found.

    Attributes
    ----------
    until_s : float
        Last row that it knew, s.
    points : tuple of str
        Completed test points.
    under_way : str
    values : dict of str to (float, float)
        Estimate and half-width.
    why_not : str
        Why there is no estimate.
    used_s : float
        Processor time.
    next_point : NextPoint or None
        What to fly next; None if nothing is needed, or nothing would help.
    """

    until_s: float
    points: tuple[str, ...]
    under_way: str
    values: dict[str, tuple[float, float]]
    why_not: str
    used_s: float
    next_point: NextPoint | None = None


class EstimateWorker:
    """Starts the process, asks it, and takes its answers without waiting.

    Parameters
    ----------
    aircraft : str
        Name or file.
    calibration : Path, optional
    wanted : mapping of str to float, optional
        Half-widths in per cent; the next test point is chosen for them.
    """

    def __init__(
        self,
        aircraft: str,
        calibration: Path | None,
        wanted: Mapping[str, float] | None = None,
    ) -> None:
        given = (aircraft, calibration, dict(wanted or {}))
        self._process = WorkerProcess("estimates", _estimate_for_ever, *given)
        self.busy = False

    def start(self) -> None:
        """Start the process; it takes some seconds to know everything that it needs."""
        self._process.start()

    def ask(self, recording: Path) -> None:
        """Ask for an estimate from all that is in a file now."""
        self._process.ask(recording)
        self.busy = True

    def answer(self) -> Answered | None:
        """Return an answer if there is one; a process that died answers with that."""
        if not self.busy:
            return None
        try:
            found: Answered | None = self._process.answer()
        except WorkerEndedError:
            found = Answered(0.0, (), "", {}, "the estimating process ended; started again", 0.0)
        self.busy = found is None
        return found

    def close(self) -> None:
        """End the process."""
        self._process.close()


def _estimate_for_ever(
    asked: Connection, aircraft: str, calibration: Path | None, wanted: dict[str, float]
) -> None:
    from host.live.estimates.flight_estimate import FlightEstimator

    by = points = None
    tried = not wanted
    while True:
        if not tried and not asked.poll():  # seconds of work: nobody waits for an estimate
            points, tried = _next_points(aircraft), True
        recording = asked.recv()
        began = time.process_time()
        try:
            by = by or FlightEstimator(aircraft, calibration)
            found = by.at(recording)
            chosen = points.best(found.known, found.flown, wanted) if points else None
        except HostError as error:
            asked.send(_nothing(str(error), began))
        except Exception as error:  # of ours: reported, and the next portion is tried
            asked.send(_nothing(f"internal error: {type(error).__name__}: {error}", began))
        else:
            asked.send(
                Answered(
                    found.until_s,
                    found.points,
                    found.under_way,
                    found.values,
                    found.why_not,
                    time.process_time() - began,
                    chosen,
                )
            )


def _next_points(aircraft: str) -> NextPoints | None:
    """Return who chooses the next point; None where the file has no aerodynamics to plan by."""
    from host.aircraft.linear_aircraft import load
    from host.planning.next_point import NextPoints

    try:
        return NextPoints(load(aircraft))
    except HostError:
        return None


def _nothing(why: str, began: float) -> Answered:
    return Answered(0.0, (), "", {}, why, time.process_time() - began)
