"""A process that estimates a point as it ends: the loop that receives never waits for it.

Between questions it reckons what the card's points are promised to tell, which takes seconds each.
"""

from __future__ import annotations

import itertools
import tempfile
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import cast

from host.live.test_point.point_estimate import PointEstimate
from host.live.worker_process import WorkerEndedError, WorkerProcess
from host.sysid.maneuvers import DetectedManeuver
from host.twin.testcard.cards import Card, Segment


@dataclass(frozen=True, slots=True)
class _Question:
    number: int
    point: Segment
    recording: Path
    flown: DetectedManeuver


class PointWorker:
    """Starts the process and asks it.

    Parameters
    ----------
    card : Card
    calibration : str
        TOML, counts to SI.
    """

    def __init__(self, card: Card, calibration: str) -> None:
        self._process = WorkerProcess("test points", _estimate_for_ever, card, calibration)
        self._process.start()
        self._folder = tempfile.TemporaryDirectory(prefix="host-points-")
        self._numbers, self._number = itertools.count(1), 0

    def ask(self, point: Segment, data: bytes, flown: DetectedManeuver) -> None:
        """Ask what bytes say of a point; its input in seconds from their last row.

        The answer to an earlier question is forgotten. The bytes go by a file: a pipe takes 64 kB,
        and then waits for a process that may be busy.
        """
        self._number = next(self._numbers)
        recording = Path(self._folder.name) / f"{self._number}.radio"
        recording.write_bytes(data)
        self._process.ask(_Question(self._number, point, recording, flown))

    def answer(self, timeout_s: float = 0.0) -> PointEstimate | None:
        """Return the answer if it is there; that of a process that died knows nothing."""
        try:
            while (found := self._process.answer(timeout_s)) is not None:
                number, estimate = found
                if number == self._number:
                    return cast(PointEstimate, estimate)
        except WorkerEndedError:
            return PointEstimate()
        return None

    def close(self) -> None:
        """End the process."""
        self._process.close()
        self._folder.cleanup()


def _estimate_for_ever(asked: Connection, card: Card, calibration: str) -> None:
    from host.live.test_point.card_progress import card_points
    from host.live.test_point.point_estimate import PointEstimator

    by = PointEstimator(card, calibration)
    unknown = [one.segment for one in card_points(card)]
    while True:
        while unknown and not asked.poll():
            by.promise(unknown.pop(0))
        one: _Question = asked.recv()
        data = one.recording.read_bytes()
        one.recording.unlink()
        asked.send((one.number, by.estimate(one.point, data, one.flown)))
