"""Estimates while flying: when they are asked for, what is said of them, what they may cost."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from host.errors import UsageError
from host.live.estimates.estimate_worker import Answered, EstimateWorker
from host.live.estimates.live_estimates import LiveEstimates, live_estimates
from host.planning.next_point import NextPoint
from host.planning.wanted_widths import WANTED_PERCENT, wanted_widths
from host.twin.testcard.cards import Segment


@dataclass
class Pretended:
    """A worker that takes a given time, on a clock that the test turns."""

    takes_s: float
    values: dict[str, tuple[float, float]]
    now_s: float = 0.0
    busy: bool = False
    next_point: NextPoint | None = None
    asked: list[tuple[float, int]] = field(default_factory=list)

    def ask(self, recording: Path) -> None:
        self.busy = True
        self.asked.append((self.now_s, recording.stat().st_size))

    def answer(self) -> Answered | None:
        if not self.busy or self.now_s < self.asked[-1][0] + self.takes_s:
            return None
        self.busy = False
        return Answered(
            self.now_s, ("3-2-1-1",), "", self.values, "", self.takes_s, self.next_point
        )

    def close(self) -> None:
        self.busy = False


def received(worker: Pretended, seconds: float, wanted: str | None = None) -> LiveEstimates:
    """Let two kilobytes a second come, looked at five times a second."""
    folder = tempfile.TemporaryDirectory()
    found = LiveEstimates(worker, wanted_widths(wanted), None, folder, lambda: worker.now_s)
    while worker.now_s < seconds:
        found.take(bytes(400))
        found.tick()
        worker.now_s += 0.2
    return found


@pytest.mark.parametrize("takes_s", [0.05, 0.4, 3.0])
def test_a_fifth_of_a_core_at_most_however_long_an_estimate_takes(takes_s: float) -> None:
    worker = Pretended(takes_s, {})
    found = received(worker, 120.0)
    assert found.as_json()["load_percent"] <= 20.0
    assert len(worker.asked) > 5
    sizes = [size for _, size in worker.asked]
    assert sizes == sorted(set(sizes))  # nothing is asked twice
    assert sizes[0] >= 20_000  # and nothing before there can be a test point
    found.close()


def test_a_derivative_is_known_well_enough_at_the_wanted_width() -> None:
    worker = Pretended(0.1, {"Cm_alpha": (-1.4, 0.139), "Cm_q": (-9.0, 2.0), "Cn_p": (0.1, 0.1)})
    found = received(worker, 30.0, "Cm_q=25")
    said = {row["name"]: row for row in found.as_json()["rows"]}
    assert list(said) == list(WANTED_PERCENT)
    assert said["Cm_alpha"]["enough"]
    assert said["Cm_alpha"]["percent"] == pytest.approx(9.93)
    assert said["Cm_q"]["enough"]
    assert not said["Cl_p"]["enough"]
    assert said["Cl_p"]["percent"] is None
    worker.values = {"Cm_alpha": (-1.4, 0.2), "Cm_q": (-9.0, 2.0)}
    while worker.now_s < 40.0:
        found.take(bytes(400))
        found.tick()
        worker.now_s += 0.2
    # A test point flown badly widens, and then it is not enough any more.
    assert found.as_json()["enough"] == 1
    found.close()


def test_what_to_fly_next_is_told_as_long_as_something_is_missing() -> None:
    worker = Pretended(0.1, {"Cm_alpha": (-1.4, 0.2)})
    doublet = Segment("doublet", axes=("aileron",), amplitudes=(6.5,), width_s=0.3)
    worker.next_point = NextPoint(doublet, ("Cl_p", "Cl_da"), 2, 11.8)
    found = received(worker, 20.0)
    assert found.as_json()["next"] == {
        "text": "aileron doublet, 6.5 deg, steps of 0.3 s", "for": ["Cl_p", "Cl_da"],
        "points": 2, "seconds": 12,
    }  # fmt: skip
    worker.next_point = None
    while worker.now_s < 30.0:
        found.take(bytes(400))
        found.tick()
        worker.now_s += 0.2
    assert found.as_json()["next"] is None
    found.close()


def test_what_failed_once_leaves_what_was_known() -> None:
    worker = Pretended(0.1, {"Cm_alpha": (-1.4, 0.1)})
    found = received(worker, 20.0)
    worker.values = {}
    while worker.now_s < 30.0:
        found.take(bytes(400))
        found.tick()
        worker.now_s += 0.2
    assert found.as_json()["rows"][1]["value"] == -1.4
    assert found.as_json()["why_not"] == ""
    found.close()


@pytest.mark.parametrize("text", ["Cm_alfa=10", "Cm_q=0", "Cm_q=", "ten", "-3", "Cm_q=nan"])
def test_wrong_widths_are_one_line(text: str) -> None:
    with pytest.raises(UsageError, match="--wanted"):
        wanted_widths(text)


def test_a_misspelt_aircraft_is_told_before_the_flight() -> None:
    with pytest.raises(UsageError, match="ultrastick"):
        live_estimates("ultrastik25e", None, None, "")


def answered(worker: EstimateWorker) -> Answered:
    """Wait for an answer of a real process."""
    while (found := worker.answer()) is None:
        time.sleep(0.02)
    return found


def test_a_process_that_dies_costs_an_answer_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "noise.radio").write_bytes(bytes(range(256)) * 100)
    worker = EstimateWorker("ultrastick25e", None)
    worker.start()
    try:
        worker.ask(tmp_path / "noise.radio")
        worker._process._process.kill()
        assert "ended" in answered(worker).why_not
        worker.ask(tmp_path / "noise.radio")
        assert answered(worker).why_not  # in one line: noise is no log
    finally:
        worker.close()
