"""The record of columns says what was done to each column that a model was fitted to, no more."""

from dataclasses import replace
from functools import cache

import pytest
from host.physical.recording import FOREIGN, OWN, Recording
from host.sysid.flight import FlownManeuver, changed_columns
from host.sysid.linear import LinearEstimate, LinearEstimator
from host.sysid.pipeline import at_hand, prepare

from tests.host.sysid.recorded import linear_flight


@cache
def estimate_of(recording: Recording) -> LinearEstimate:
    flown = linear_flight("short-period", "none", "white", 1)
    given = at_hand(flown.columns, recording=recording, windows=flown.windows)
    return LinearEstimator("short-period").estimate([prepare(given).flight])


def fitted_otherwise(estimate: LinearEstimate) -> set[str]:
    """Return the columns of the model that the fit did not see as they were recorded."""
    columns, found, other = estimate.columns, estimate.found, set()
    model = columns.chosen.model
    names = (*model.inputs, *model.outputs)
    for prepared, fitted in zip(columns.used, found.at_trim or found.maneuvers, strict=True):
        flight = prepared.flight
        raw = {name: flight.commands.get(name, x) for name, x in flight.recorded.items()}
        plain = FlownManeuver(prepared.found, replace(flight, corrected=raw), prepared.label)
        before = plain.cut(model)
        was = dict(zip(names, [*before.inputs.T, *before.outputs.T], strict=True))
        now = dict(zip(names, [*fitted.inputs.T, *fitted.outputs.T], strict=True))
        other |= set(changed_columns(was, now))
    return other


@pytest.mark.parametrize(
    ("recording", "first"),
    [
        (Recording(maker=FOREIGN), ""),
        (Recording(maker=OWN), ""),
        (Recording(maker=FOREIGN, commanded=("elevator",)), "commands brought behind usual servos"),
    ],
)
def test_each_changed_column_has_its_reason_in_the_record(recording: Recording, first: str) -> None:
    estimate = estimate_of(recording)
    model = estimate.columns.chosen.model
    named = {name for change in estimate.record for name in change.columns}
    assert fitted_otherwise(estimate) == named & {*model.inputs, *model.outputs}
    assert all(change.what and change.why for change in estimate.record)
    assert estimate.record[0].what == first if first else True
    servo = [c for c in estimate.record if c.what == "commands brought behind their servos"]
    assert bool(servo) == bool(recording.commanded)
    assert all(c.columns == ("elevator_rad",) for c in servo)


def test_what_the_data_say_of_surfaces_is_said_once_by_the_record() -> None:
    estimate = estimate_of(Recording(maker=FOREIGN))
    said = [c.remark for c in estimate.record if c.remark]
    assert [line for line in estimate.warnings if line in said] == said
    held = estimate.columns.chosen.model.hold == "zoh"
    assert held == any(c.what == "held between samples" for c in estimate.record)
