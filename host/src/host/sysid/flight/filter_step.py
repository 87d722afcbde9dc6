"""The step at which a filter with the gust compares lateral motion: 20 ms.

Air that rolls drives the roll rate by far more than a gyro's noise at any frequency, so a filter
reads the aircraft's dynamics from samples next to each other. Between these our log has the gyro's
low-pass and a straight line to the instant of the row: what is missing there passes for the
aircraft. On recorded flights L_p and L_da come out 15 and 14 % small at a step of 10 ms, and 9 and
6 % with perfect sensors and [1 2 1] / 4 over all columns alike; within 2 % at 20 ms. Means take the
same off inputs and outputs, which to a linear model is no error. The mean of a slow sensor is that
of the curve through its samples. Where the roll rate itself is slow, the gusts in between are in no
curve: its record stays with output error.

Columns of others are fitted as they are, with an aircraft file and without: means hide from a
filter that a pilot or an autopilot follows the roll rate (on the independent flights L_p 4 to 7 %
off without, 12 to 16 % with them). Output error misses N_r there by 24 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from host.physical.recording import FOREIGN
from host.readers.column_sampling import sampled_name
from host.sysid.estimators.gust_penetration import ROLL_STATES
from host.sysid.flight.flown_maneuver import FlownManeuver
from host.sysid.models.state_space_model import LinearModel

ROLL_RATE = "p_radps"
STEP_S = 0.02  # at 30 ms the input between samples counts: L_da 5 % large


def feels_roll(model: LinearModel) -> bool:
    """Return whether air that rolls moves the states of a model."""
    return set(model.states) >= ROLL_STATES


def sensors_known(maneuvers: Sequence[FlownManeuver]) -> bool:
    """Return whether an aircraft file says places and delays of the sensors."""
    found = [m.flight.compatibility for m in maneuvers]
    return all(c is not None and c.instrument is not None for c in found)


def others_recorded(maneuvers: Sequence[FlownManeuver]) -> bool:
    """Return whether all are from tables of others, whose columns are not those of our log."""
    return all(m.flight.maker == FOREIGN for m in maneuvers)


def rolling_gust_identifiable(maneuvers: Sequence[FlownManeuver]) -> bool:
    """Return whether a filter can separate a rolling gust from the dynamics of the sensors.

    Our own log without an aircraft file does not say where its sensors are and how slow.
    """
    return sensors_known(maneuvers) or others_recorded(maneuvers)


def no_filter_step(maneuvers: Sequence[FlownManeuver], model: LinearModel) -> str:
    """Return why a filter cannot have the step that it needs; empty where it can.

    Means over `STEP_S` would have what a slow gyro did not measure.
    """
    slow = sampled_name(ROLL_RATE)
    if not _needs_means(maneuvers, model) or not any(slow in m.inside() for m in maneuvers):
        return ""
    return f"a slow gyro has no means over {1000.0 * STEP_S:g} ms, which air that rolls needs"


def with_filter_step(maneuvers: Sequence[FlownManeuver], model: LinearModel) -> list[FlownManeuver]:
    """Return lateral maneuvers of our instrument as means over `STEP_S`, others as they are."""
    if not _needs_means(maneuvers, model) or no_filter_step(maneuvers, model):
        return list(maneuvers)
    return [replace(m, block=_rows_of_step(m)) for m in maneuvers]


def _needs_means(maneuvers: Sequence[FlownManeuver], model: LinearModel) -> bool:
    ours = sensors_known(maneuvers) and not others_recorded(maneuvers)
    return ours and feels_roll(model) and any(_rows_of_step(m) > 1 for m in maneuvers)


def _rows_of_step(maneuver: FlownManeuver) -> int:
    return max(1, round(STEP_S / maneuver.dt_s))
