"""Estimates from the radio while flying are those that `host identify` gives of the same data."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.errors import IdentificationError
from host.live.estimates import flight_estimate
from host.live.estimates.estimate_worker import EstimateWorker
from host.live.estimates.flight_estimate import FlightEstimator
from host.live.test_point.point_estimate import PointEstimate, PointEstimator
from host.planning.point_widths import PointPromise, point_derivatives
from host.planning.predicted_widths import PredictedWidth
from host.planning.wanted_widths import WANTED_PERCENT
from host.sysid.flight import ReconstructedFlight
from host.sysid.maneuvers import DetectedManeuver, detect_maneuvers
from host.twin.testcard.cards import Card, load
from studies.radio_flights import RadioFlight, after_each_point, lost_in_bursts, radio_flight

import host

AIRCRAFT = "ultrastick25e"
SEED = 9000


@pytest.fixture(scope="module")
def flight() -> RadioFlight:
    demo = load("demo")
    first = [s for s in demo.segments if s.kind != "turn"][:3]  # trim and two 3-2-1-1s
    return radio_flight(replace(demo, segments=(*first, demo.segments[-1])), SEED)


def test_the_page_says_what_identify_says_later(flight: RadioFlight, tmp_path: Path) -> None:
    recording, calibration = tmp_path / "live.radio", tmp_path / "calibration.toml"
    calibration.write_text(flight.calibration, encoding="utf-8")
    by = FlightEstimator(AIRCRAFT, calibration)
    recording.write_bytes(b"".join(s.data for s in flight.sent if s.t_s < 11.0))
    before = by.at(recording)
    assert (before.values, before.why_not) == ({}, "no test point yet")
    first, second = after_each_point(flight.sent, flight.truth, 3.8)
    recording.write_bytes(first)
    one = by.at(recording)
    assert [name[:19] for name in one.points] == ["3-2-1-1 on elevator"]
    recording.write_bytes(second)
    both = by.at(recording)
    assert len(both.points) == 2
    assert both.values["Cm_alpha"][1] < one.values["Cm_alpha"][1]
    # What the next point is chosen by: what was flown, and what of a width more of it takes away.
    [point] = one.flown
    assert (point.kind, point.axes) == ("3211", ("elevator",))
    assert point.amplitudes[0] == pytest.approx(3.0, abs=0.8)
    width, half = one.known["Cm_alpha"], one.values["Cm_alpha"]
    assert width.percent == pytest.approx(abs(100.0 * half[1] / half[0]))
    assert 0.3 * width.percent < width.tolerance_percent < width.percent
    assert both.known["Cm_alpha"].noise_percent < 0.9 * width.noise_percent
    found = host.identify(
        recording, aircraft=AIRCRAFT, calibration=calibration, models="coefficients"
    )
    later = [c for t in found.coefficient_tables for c in t.coefficients]
    assert list(both.values) == [c.name for c in later]
    for c in later:
        assert both.values[c.name] == pytest.approx((c.value, c.half_width))


def test_the_process_that_estimates_names_the_next_point(
    flight: RadioFlight, tmp_path: Path
) -> None:
    recording, calibration = tmp_path / "live.radio", tmp_path / "calibration.toml"
    calibration.write_text(flight.calibration, encoding="utf-8")
    first, _ = after_each_point(flight.sent, flight.truth, 3.8)
    recording.write_bytes(first)
    worker = EstimateWorker(AIRCRAFT, calibration, WANTED_PERCENT)
    worker.start()
    try:
        while True:  # it knows what to choose from after some seconds, and estimates before
            worker.ask(recording)
            while (found := worker.answer()) is None:
                time.sleep(0.02)
            if found.next_point is not None:
                break
    finally:
        worker.close()
    assert found.next_point.segment.axes == ("aileron",)
    assert {"Cl_p", "Cn_dr"} <= set(found.next_point.wanting)


def test_a_point_alone_is_estimated_with_its_own_residuals_and_with_promised_ones(
    flight: RadioFlight,
) -> None:
    card = load("demo")
    point = card.segments[1]
    first, second = after_each_point(flight.sent, flight.truth, 3.8)
    truth = flight.truth[1]
    start_s = truth["start_s"] - truth["input_end_s"] - 3.8
    flown = DetectedManeuver("elevator_rad", "3-2-1-1", start_s, -3.8, -0.8, 0.05, 5)
    by = PointEstimator(card, flight.calibration)
    one = by.estimate(point, second, flown)
    assert (one.promised, one.expected) == ((), {})  # not reckoned yet
    assert set(one.measured) == {"Cm_alpha", "Cm_q", "Cm_de"}
    assert by.estimate(point, b"noise", flown) == PointEstimate()
    assert by.estimate(point, first[:3000], flown).measured == {}
    another = replace(flown, axis="rudder_rad")
    assert by.estimate(point, second, another).measured == {}
    quiet, loud = (_with_noise(card, flight, second, flown, times) for times in (1.0, 16.0))
    assert quiet.promised == loud.promised
    for name, width in quiet.expected.items():
        assert loud.measured[name] == quiet.measured[name] == one.measured[name]
        noise = [w.noise_share * w.half_width**2 for w in (width, loud.expected[name])]
        assert noise[1] == pytest.approx(16.0 * noise[0], rel=0.5)


def _with_noise(
    card: Card, flight: RadioFlight, data: bytes, flown: DetectedManeuver, times: float
) -> PointEstimate:
    """Return the estimate of a point whose promise has residuals of so many times a power."""
    point, grid = card.segments[1], np.linspace(0.1, 4.5, 12)
    power = {"CL": 1e-4, "CD": 1e-5, "Cm": 1e-6, "Cl": 1e-7, "w": 1e-2, "u": 1e-2}
    noise = {name: (grid, np.full(12, times * value)) for name, value in power.items()}
    widths = tuple(
        PredictedWidth(name, "1", 1.0, 0.1, 0.5, 11) for name in point_derivatives(point)
    )
    promise = PointPromise("3211", point.axes, point.amplitudes, 0.2, widths, (), noise=noise)
    return PointEstimator(card, flight.calibration, {point: promise}).estimate(point, data, flown)


def test_a_test_point_under_way_is_in_the_estimate_and_named(
    flight: RadioFlight, tmp_path: Path
) -> None:
    recording, calibration = tmp_path / "live.radio", tmp_path / "calibration.toml"
    calibration.write_text(flight.calibration, encoding="utf-8")
    end_s = flight.truth[1]["input_end_s"]
    recording.write_bytes(b"".join(s.data for s in flight.sent if s.t_s < end_s))
    found = FlightEstimator(AIRCRAFT, calibration).at(recording)
    assert len(found.points) == 1
    assert "on elevator" in found.under_way
    assert found.values


def test_a_share_of_the_envelopes_is_lost_in_bursts(flight: RadioFlight) -> None:
    whole = sum(len(s.data) for s in flight.sent)
    lost = [
        1.0 - sum(len(s.data) for s in lost_in_bursts(flight.sent, 0.05, seed)) / whole
        for seed in range(20)
    ]
    assert 0.03 < sum(lost) / len(lost) < 0.07


def test_pieces_of_one_axis_do_not_take_the_other_with_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, flight: RadioFlight
) -> None:
    recording, calibration = tmp_path / "live.radio", tmp_path / "calibration.toml"
    calibration.write_text(flight.calibration, encoding="utf-8")
    recording.write_bytes(b"".join(s.data for s in flight.sent))
    by = FlightEstimator(AIRCRAFT, calibration)
    whole, estimate = by.at(recording), by._by.estimate

    def found(columns: object) -> list[DetectedManeuver]:
        one, two = detect_maneuvers(columns)  # type: ignore[arg-type]
        return [one, replace(two, axis="aileron_rad")]

    def refused(flights: list[ReconstructedFlight]) -> object:
        if any(m.axis == "aileron_rad" for m in flights[0].maneuvers):
            raise IdentificationError("the coefficients found so far make an unstable aircraft")
        return estimate(flights)

    monkeypatch.setattr(flight_estimate, "detect_maneuvers", found)
    monkeypatch.setattr(type(by._by), "estimate", lambda _, flights: refused(flights))
    some = by.at(recording)
    assert set(some.values) == set(whole.values)
    assert "unstable" in some.why_not


def test_a_test_point_divided_by_a_gap_is_one(flight: RadioFlight, tmp_path: Path) -> None:
    recording, calibration = tmp_path / "live.radio", tmp_path / "calibration.toml"
    calibration.write_text(flight.calibration, encoding="utf-8")
    cut_s = flight.truth[0]["input_end_s"] + 0.2
    kept = [s for s in flight.sent if not cut_s < s.t_s < cut_s + 0.6]
    recording.write_bytes(b"".join(s.data for s in kept))
    assert len(FlightEstimator(AIRCRAFT, calibration).at(recording).points) == 2
