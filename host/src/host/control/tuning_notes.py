"""Notes of a tuning: what was not known, and what was taken in its place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from host.constants import NORMAL_95
from host.control.autopilots.known import Autopilot
from host.control.axis_tuning import AxisTuning
from host.control.releases import called


def tuning_notes(
    axes: Sequence[AxisTuning],
    chosen: Autopilot,
    logged: Mapping[str, float],
    flown_mps: Sequence[float],
    release: str = "",
) -> Iterator[str]:
    """Yield what was not known and what was taken in its place, a sentence each.

    Parameters
    ----------
    axes : sequence of AxisTuning
    chosen : Autopilot
    logged : mapping of str to float
        Parameters by name.
    flown_mps : sequence of float
        Least and largest airspeed of the maneuvers; empty where nobody knows.
    release : str
        Whose names of parameters are printed; today's where it is empty.
    """
    for missing in {"roll", "pitch"} - {one.axis for one in axes}:
        yield f"no gains for {missing}: the answer has no model of it"
    if any(not one.problem.axis.correlated for one in axes):
        yield "a saved model has no correlations: its derivatives are drawn independently"
    settings = [s for one in axes for s in one.problem.structure.settings.values()]
    own = [s for s in settings if s.name in logged]
    assumed = tuple(dict.fromkeys(name for one in axes for name in one.problem.structure.assumed))
    if not own and chosen.words:
        yield (
            "nobody named the old gains: name the autopilot's parameters with --parameters, or a"
            " log that has them"
        )
    if assumed:
        names = (called(chosen.name, name, release) for name in assumed)
        yield f"defaults stand for {', '.join(names)}"
    if logged.get("tpa_rate", 0.0) > 0.0 and chosen.name == "inav":
        yield "tpa_rate makes gains follow the throttle, which no aircraft here does: set it to 0"
    if chosen.outer is None and chosen.words:
        yield f"paths and heights are not checked: nobody read {chosen.name}'s navigation here"
    for one in own:
        value = logged[one.name]
        if value != one.default and not one.lowest <= value <= one.highest:
            yield f"{one.name} is {value:g}, documented {one.lowest:g} to {one.highest:g}"
    speeds = sorted({v for one in axes for v in one.problem.airspeeds_mps})
    beyond = [f"{v:.1f}" for v in speeds if flown_mps and not flown_mps[0] <= v <= flown_mps[-1]]
    if beyond:
        yield (
            f"not flown at {', '.join(beyond)} m/s: derivatives of {flown_mps[0]:.1f} to"
            f" {flown_mps[-1]:.1f} m/s are scaled with the airspeed"
        )
    for one_axis in axes:
        drive = one_axis.problem.actuator
        if not drive.servo_known:
            yield (
                f"the {drive.surface}'s servo is not in the aircraft file: {drive.bandwidth_hz:.1f}"
                f" Hz +- {100.0 * NORMAL_95 * drive.bandwidth_share:.0f} % stand for it"
            )
