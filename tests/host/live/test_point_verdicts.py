"""Test points judged as they end: on rows as the radio sends them, some of them lost."""

from __future__ import annotations

import json
import math
import os
import re
import signal
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from host.aircraft.linear_aircraft import load
from host.live.json_lines import JsonLines
from host.live.live_sample import LIVE_UNITS, Array, LiveUpdate
from host.live.test_point.card_progress import CardProgress, card_points
from host.live.test_point.point_estimate import PointEstimate
from host.live.test_point.point_measures import PointMeasures
from host.live.test_point.point_verdict import judge_point
from host.live.test_point.point_watch import PointWatch
from host.live.test_point.point_worker import PointWorker
from host.planning.aircraft_response import STEP_S, AircraftResponse
from host.planning.point_widths import point_derivatives
from host.planning.predicted_widths import FlightWidth, PredictedWidth
from host.planning.wanted_input import RESPONSE_S, wanted_surfaces
from host.sysid.maneuvers import DetectedManeuver
from host.twin.testcard.cards import Card, Segment, parse

SPEED_MPS, START_S = 17.0, 18.0
CARD: dict[str, object] = {
    "format": 1,
    "aircraft": "ultrastick25e",
    "flight": {"airspeed_mps": SPEED_MPS},
    "segment": [
        {"kind": "trim", "duration_s": 10},
        {"kind": "doublet", "axis": "aileron", "amplitude": 4.0, "width_s": 0.6},
        {"kind": "turn", "duration_s": 14, "bank_deg": 30},
        {"kind": "3211", "axis": "elevator", "amplitude": 3.0, "width_s": 0.25},
    ],
}
FLOWN = DetectedManeuver("aileron_rad", "doublet", -5.0, -3.8, -0.8, 0.07, 3)
AXES = {"elevator": "longitudinal", "aileron": "lateral", "rudder": "lateral"}


@pytest.fixture(scope="module")
def card() -> Card:
    return parse(CARD, "card")


@pytest.fixture(scope="module")
def response() -> AircraftResponse:
    return AircraftResponse(load("ultrastick25e"), SPEED_MPS)


def flown(
    response: AircraftResponse, inputs: list[tuple[float, Segment]], *, seconds: float = 25.0,
    gusts: float = 0.3,
) -> dict[str, Array]:  # fmt: skip
    """Return rows at 20 Hz: 5 s on the ground, then the linear aircraft under these inputs."""
    rng = np.random.default_rng(5)
    t = np.arange(0.0, seconds, STEP_S)
    moved = {axis: np.zeros(len(t)) for axis in AXES}
    for at_s, segment in inputs:
        first = round(at_s / STEP_S)
        for axis, wave in wanted_surfaces(segment, response).items():
            moved[axis][first : first + len(wave)] += wave[: len(t) - first]
    motion = response.motion("longitudinal", moved) | response.motion("lateral", moved)
    every = slice(None, None, round(0.05 / STEP_S))
    deg = np.degrees
    rows = {name: np.zeros(len(t))[every] for name in LIVE_UNITS}
    noise = {name: rng.normal(0.0, 0.05, len(rows["t_s"])) for name in rows}
    gust = np.repeat(rng.normal(0.0, 0.26 * gusts / math.sqrt(2.0), 200), 5)[: len(rows["t_s"])]
    rows["t_s"] = t[every].copy()
    for side in "ab":
        rows[f"airspeed_{side}_mps"] = np.where(rows["t_s"] < 5.0, 0.0, SPEED_MPS)
        rows[f"alpha_{side}_deg"] = deg(motion["alpha"][every] + gust / SPEED_MPS)
        rows[f"beta_{side}_deg"] = deg(motion["beta"][every])
    for name in "pqr":
        rows[f"{name}_degps"] = deg(motion[name][every]) + noise[f"{name}_degps"]
    rows["elevator_pot_deg"] = deg(moved["elevator"][every]) + noise["elevator_pot_deg"] - 7.0
    rows["rudder_pot_deg"] = deg(moved["rudder"][every]) + noise["rudder_pot_deg"]
    rows["aileron_left_deg"] = deg(moved["aileron"][every]) + noise["aileron_left_deg"]
    rows["aileron_right_deg"] = -deg(moved["aileron"][every]) + noise["aileron_right_deg"]
    return rows


@dataclass
class Pretended:
    """Who estimates, on a clock that it turns itself: an answer takes a while."""

    found: PointEstimate
    takes_s: float = 0.2
    now_s: float = 0.0
    asked: list[tuple[Segment, bytes, DetectedManeuver]] = field(default_factory=list)
    closed: bool = False
    _asked_s: float = 0.0

    def clock(self) -> float:
        self.now_s += 0.02
        return self.now_s

    def ask(self, point: Segment, data: bytes, flown: DetectedManeuver) -> None:
        self.asked.append((point, data, flown))
        self._asked_s = self.now_s

    def answer(self, timeout_s: float = 0.0) -> PointEstimate | None:
        self.now_s += min(timeout_s, self.takes_s)
        return self.found if self.now_s >= self._asked_s + self.takes_s else None

    def close(self) -> None:
        self.closed = True


def estimate_of(point: Segment, measured: float, expected: float | None = None) -> PointEstimate:
    """Return that a point gave half-widths so many times the promised ones."""
    names = point_derivatives(point)
    promised = tuple(PredictedWidth(name, "1", 1.0, 0.1, 0.5, 11) for name in names)
    found = (
        dict.fromkeys(names, FlightWidth("1", 1.0, 0.1 * width, 0.5))
        for width in (measured, measured if expected is None else expected)
    )
    return PointEstimate(promised, *found)


def watched(
    card: Card,
    rows: dict[str, Array],
    *,
    lost: slice | None = None,
    estimates: Pretended | None = None,
) -> PointWatch:
    """Return who judged the rows, which came one by one."""
    clock = estimates.clock if estimates else float
    watch = PointWatch(card, estimates=estimates, clock=clock)
    come = np.ones(len(rows["t_s"]), bool)
    if lost is not None:
        come[lost] = False
    for at in np.flatnonzero(come):
        row = {name: column[at : at + 1] for name, column in rows.items()}
        watch.hear(LiveUpdate(row, np.ones(1, bool), 0, [], 0.0))
        watch.take(b"row %d" % at)
        watch.tick()
    return watch


def only(watch: PointWatch) -> dict[str, Any]:
    assert len(watch.verdicts) == 1, list(watch.verdicts)
    return watch.verdicts[0]


def test_a_point_as_the_card_wants_it_is_good_soon_after_its_end(
    card: Card, response: AircraftResponse
) -> None:
    wanted = card.segments[1]
    said = only(watched(card, flown(response, [(START_S, wanted)])))
    assert said["text"] == f"good {said['score']}"
    assert said["score"] >= 90
    assert said["flown"] == "aileron doublet"
    assert said["start_s"] == pytest.approx(START_S, abs=0.15)
    assert said["end_s"] == pytest.approx(START_S + 1.2 + RESPONSE_S, abs=0.3)
    assert 0.0 <= said["said_s"] - said["end_s"] <= 0.6


TONES = [["elevator", 8, 0.6, 0.1], ["elevator", 14, 0.6, 0.4], ["rudder", 11, 0.9, 0.0]]
SINES: dict[str, object] = {
    "kind": "multisine", "axis": ["elevator", "rudder"], "amplitude": [3.0, 3.0],
    "duration_s": 8.0, "tones": TONES,
}  # fmt: skip


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_tones_that_the_card_names_are_what_it_wants(response: AircraftResponse) -> None:
    """As `host plan --optimal` writes them; flown at half of the amplitude it says so."""
    card = parse({**CARD, "segment": [{"kind": "trim", "duration_s": 10}, SINES]}, "sines")
    wanted = card.segments[1]
    whole = only(watched(card, flown(response, [(START_S, wanted)], seconds=40.0)))
    assert (whole["good"], whole["flown"]) == (True, "elevator multisine"), whole
    half = replace(wanted, amplitudes=(1.5, 1.5))
    said = only(watched(card, flown(response, [(START_S, half)], seconds=40.0)))
    assert re.search("amplitude (4[5-9]|5[0-5]) % of what is wanted", said["text"]), said


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"amplitudes": (1.6,)}, "amplitude 4[0-4] % of what is wanted"),
        ({"amplitudes": (0.5,)}, "amplitude 1[0-9] % of what is wanted"),
        ({"axes": ("rudder",)}, "rudder moved, aileron is wanted"),
        ({"kind": "pulse", "width_s": 0.4}, "broken off|hold longer"),
    ],
)
def test_what_is_wrong_is_said(
    card: Card, response: AircraftResponse, change: dict[str, Any], words: str
) -> None:
    wanted = card.segments[1]
    said = only(watched(card, flown(response, [(START_S, replace(wanted, **change))])))
    assert not said["good"]
    assert said["text"].startswith("repeat: ")
    assert re.search(words, said["text"]), said


def test_slow_steps_keep_the_promise(card: Card, response: AircraftResponse) -> None:
    """By identification of points flown 1.8 to 3 times too slowly: `studies/point_verdicts.md`."""
    slow = replace(card.segments[1], width_s=1.5)
    assert only(watched(card, flown(response, [(START_S, slow)])))["good"]


def test_what_nobody_finds_afterwards_is_not_good(card: Card) -> None:
    """A rudder moved by 1.5 deg: by its movement 1.2 times the promise, found by nobody."""
    wanted = Segment("doublet", axes=("rudder",), amplitudes=(3.0,), width_s=0.5)
    flown = PointMeasures(
        axis="rudder", axis_wanted=True, amplitude=0.51, edge=1.05, length=1.0, unquiet=0.0,
        others=0.0, deviations=np.array([2.0, 2.0, 2.0]), corrected=0.0, airspeed=0.0,
        airspeed_change=0.0, gusts=1.0, lost=0.0,
    )  # fmt: skip
    assert judge_point(flown, wanted).text == "repeat: amplitude 51 % of what is wanted"
    assert judge_point(replace(flown, edge=1.2), wanted).good


def test_a_point_that_only_moved_too_softly_is_told_so(card: Card) -> None:
    flown = PointMeasures(
        axis="aileron", axis_wanted=True, amplitude=0.9, edge=2.5, length=0.9, unquiet=0.0,
        others=0.0, deviations=np.array([2.0, 1.9]), corrected=0.0, airspeed=0.0,
        airspeed_change=0.0, gusts=1.0, lost=0.0,
    )  # fmt: skip
    said = judge_point(flown, card.segments[1])
    assert said.text == "repeat: its steps are rounder or shorter than the card's"
    assert judge_point(replace(flown, deviations=np.array([1.1, 1.0])), card.segments[1]).good
    late = judge_point(replace(flown, length=2.5), card.segments[1])
    assert late.text == "repeat: 150 % too long: shorter steps"


def test_a_point_is_estimated_from_the_last_seconds_and_judged_by_both(
    card: Card, response: AircraftResponse
) -> None:
    wanted = card.segments[1]
    rows = flown(response, [(START_S, wanted)])
    by = Pretended(estimate_of(wanted, 1.75))
    watch = watched(card, rows, estimates=by)
    said = only(watch)
    assert (said["good"], said["estimated"]) == (False, True)
    assert re.fullmatch(r"repeat: half-widths 1\.[34] times the promised ones", said["text"])
    [(point, data, asked)] = by.asked
    assert point == wanted
    assert -asked.start_s == pytest.approx(1.2 + RESPONSE_S, abs=0.7)
    assert asked.input_end_s - asked.start_s == pytest.approx(1.2, abs=0.2)
    assert data.startswith(b"row 0")
    assert data.endswith(b"row %d" % round(20.0 * (START_S - asked.start_s)))
    assert said["said_s"] - said["end_s"] <= 2.0
    assert only(watched(card, rows, estimates=Pretended(estimate_of(wanted, 1.2))))["good"]
    watch.close()
    assert by.closed


def test_an_estimate_that_does_not_come_holds_nobody_up(
    card: Card, response: AircraftResponse
) -> None:
    rows = flown(response, [(START_S, card.segments[1])], seconds=50.0)
    by = Pretended(estimate_of(card.segments[1], 9.0), takes_s=1e9)
    said = only(watched(card, rows, estimates=by))
    assert (said["good"], said["estimated"]) == (True, False)


def test_the_promise_tells_the_noise_of_calm_air_and_the_rows_that_of_gusts(card: Card) -> None:
    """By its own residuals 1.5 times the promise, by the promised ones 1.0 times."""
    wanted = card.segments[1]
    flown = PointMeasures(
        axis="aileron", axis_wanted=True, amplitude=1.0, edge=2.5, length=1.0, unquiet=0.0,
        others=0.0, deviations=np.array([1.5, 1.5]), corrected=0.0, airspeed=0.0,
        airspeed_change=0.0, gusts=1.0, lost=0.0,
    )  # fmt: skip

    def score(found: PointEstimate, gusts: float = 1.0) -> int:
        return judge_point(replace(flown, gusts=gusts), wanted, found).score

    both = estimate_of(wanted, 1.5, 1.0)
    neither = replace(both, measured={}, expected={})
    assert score(both) == score(estimate_of(wanted, 9.0, 1.0))
    assert score(both, 2.0) == score(estimate_of(wanted, 1.5, 9.0), 2.0)
    # A fit that ran away gave a twentieth of the promised half-width.
    assert score(neither) == score(estimate_of(wanted, 1.5, 0.05))
    # The movement counts with each, and alone where rows were too few for it.
    assert score(neither) < score(both) < 100
    assert score(neither) == score(replace(both, expected={}))
    assert score(neither, 2.0) == score(replace(both, measured={}), 2.0) < score(neither)


def test_bytes_that_came_before_the_schema_are_estimated_too(
    card: Card, response: AircraftResponse
) -> None:
    """The hash of the schema comes every 5 s: until then no row tells the time."""
    wanted = card.segments[1]
    rows = flown(response, [(START_S, wanted)])
    by = Pretended(estimate_of(wanted, 1.0))
    watch = PointWatch(card, estimates=by, clock=by.clock)
    for late in range(3):
        watch.take(b"early %d " % late)
    for at in range(len(rows["t_s"])):
        row = {name: column[at : at + 1] for name, column in rows.items()}
        watch.hear(LiveUpdate(row, np.ones(1, bool), 0, [], 0.0))
        watch.take(b"row %d" % at)
    [(_, data, _)] = by.asked
    assert data.startswith(b"early 0 early 1 early 2 row 0")


def test_nobody_waits_for_the_process_that_estimates_points_and_it_may_die(card: Card) -> None:
    worker = PointWorker(card, "")
    try:
        os.kill(worker._process._process.pid, signal.SIGSTOP)
        worker.ask(card.segments[1], bytes(1 << 20), FLOWN)  # more than a pipe holds
        assert worker.answer() is None
        worker._process._process.kill()
        while (found := worker.answer(1.0)) is None:
            pass
        assert found == PointEstimate()
        worker.ask(card.segments[1], b"noise", FLOWN)  # another process
        while (found := worker.answer(1.0)) is None:
            pass
        assert found.measured == found.expected == {}
    finally:
        worker.close()


def test_gusts_of_the_card_are_no_matter_and_others_are(
    card: Card, response: AircraftResponse
) -> None:
    wanted = card.segments[1]
    said = only(watched(card, flown(response, [(START_S, wanted)], gusts=2.0)))
    assert not said["good"]
    assert "gusts" in said["text"]
    windy = replace(card, air=replace(card.air, turbulence_mps=2.0))
    assert only(watched(windy, flown(response, [(START_S, wanted)], gusts=2.0)))["good"]


def test_the_response_to_the_point_before_is_no_gust(
    card: Card, response: AircraftResponse
) -> None:
    _, aileron, _, elevator = card.segments
    two = replace(card, segments=(card.segments[0], elevator, aileron))
    rows = flown(response, [(12.0, elevator), (19.0, aileron)])
    assert [v["good"] for v in watched(two, rows).verdicts] == [True, True]


def test_a_launch_is_no_gust(card: Card, response: AircraftResponse) -> None:
    rows = flown(response, [(START_S, card.segments[1])])
    ground = rows["t_s"] < START_S - 4.0
    for side in "ab":
        rows[f"airspeed_{side}_mps"][ground] = 0.5
        rows[f"alpha_{side}_deg"][~ground] += 6.0
    assert only(watched(card, rows))["good"]


def test_rows_that_did_not_arrive_change_no_verdict_of_a_burst(
    card: Card, response: AircraftResponse
) -> None:
    rows = flown(response, [(START_S, card.segments[1])])
    first = round((START_S + 0.35) / 0.05)
    assert only(watched(card, rows, lost=slice(first, first + 6)))["good"]
    behind = round((START_S + 1.5) / 0.05)
    response_lost = only(watched(card, rows, lost=slice(behind, behind + 30)))
    assert "not received" in " ".join(response_lost["remarks"])
    assert not watched(card, rows, lost=slice(first - 10, first + 30)).verdicts


def test_a_point_whose_first_edge_did_not_arrive_is_found(
    card: Card, response: AircraftResponse
) -> None:
    """A line over the burst is too slow for an edge of 3 deg."""
    wanted = Segment("doublet", axes=("rudder",), amplitudes=(3.0,), width_s=0.5)
    rudder = replace(card, segments=(card.segments[0], wanted))
    rows = flown(response, [(START_S, wanted)])
    for at_s in (START_S, START_S + 1.0):
        first = round((at_s - 0.15) / 0.05)
        said = only(watched(rudder, rows, lost=slice(first, first + 8)))
        assert said["flown"] == "rudder doublet"


def test_nothing_is_said_of_handling_of_the_ground_and_of_a_second_look(
    card: Card, response: AircraftResponse
) -> None:
    small = Segment("doublet", axes=("elevator",), amplitudes=(1.0,), width_s=0.4)
    assert not watched(card, flown(response, [(10.0, small), (22.0, small)])).verdicts
    assert not watched(card, flown(response, [(1.0, card.segments[1])])).verdicts


def test_the_card_goes_on_when_a_point_is_good_and_stays_when_it_is_not(card: Card) -> None:
    points = card_points(card)
    assert [p.text for p in points] == [
        "aileron doublet, 4 deg, steps of 0.6 s",
        "elevator 3-2-1-1, 3 deg, steps of 0.25 s",
    ]
    progress = CardProgress(card)
    assert progress.as_json(3.0) == {
        "number": 1, "of": 2, "text": points[0].text, "before": "", "in_s": None,
    }  # fmt: skip
    progress.airborne(5.0)
    assert progress.as_json(8.0) == progress.as_json(3.0) | {"in_s": 10.0}  # type: ignore[operator]
    progress.judged(22.0, good=False)
    again = progress.as_json(22.0)
    assert again is not None
    assert (again["number"], again["in_s"]) == (1, 6.0)
    progress.judged(32.0, good=True)
    after = progress.as_json(33.0)
    assert after is not None
    assert (after["number"], after["before"]) == (2, "turn of 14 s")
    assert after["in_s"] == pytest.approx(14.0 + 3.0 - 0.5 - 1.0)
    progress.judged(60.0, good=True)
    assert progress.as_json(61.0) is None


def test_a_verdict_is_a_line_of_json_once(card: Card, response: AircraftResponse) -> None:
    watch = watched(card, flown(response, [(START_S, card.segments[1])]))
    lines: list[str] = []
    shown = JsonLines(lines.append)
    for _ in range(3):
        shown.state(json.dumps({"type": "state", "test_point": watch.as_json()}))
    assert [json.loads(line)["type"] for line in lines] == ["verdict", "state"]
    assert json.loads(lines[0])["text"].startswith("good ")
    assert json.loads(lines[1])["test_point"]["next"]["number"] == 2
