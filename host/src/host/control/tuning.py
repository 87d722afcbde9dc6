"""From an answer to gains of a named autopilot: one call, and what it returns."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from host.aircraft.file import load_measured
from host.control.actuator import Actuator, actuator_of
from host.control.asked import check_asked
from host.control.autopilots.known import AUTOPILOTS, Autopilot, Rudder
from host.control.axis_tuning import AxisTuning, YawTuning, changes_of
from host.control.bandwidth_costs import bandwidth_costs
from host.control.control_error import ControlError
from host.control.disturbances import gyro_noise_radps
from host.control.lateral_pair import PairProblem
from host.control.loop_design import STEP_SHARE, design
from host.control.outer_loops import OuterCheck, check
from host.control.parameter_file import Change, taken_back
from host.control.plant import RATES
from host.control.releases import release_note
from host.control.scenarios import Problem
from host.control.tuning_notes import tuning_notes
from host.control.uncertain_axis import UncertainAxis, axes_of, axes_of_models
from host.control.verification import UNSEEN, Required
from host.control.worst_aircraft import worst_on_contour
from host.control.yaw_design import PairMargins, design_yaw
from host.export.pictures import Pictures

if TYPE_CHECKING:
    from host.sysid.pipeline import Identification


@dataclass(frozen=True)
class Tuning:
    """Gains for an autopilot with what was proven of them.

    Attributes
    ----------
    autopilot : Autopilot
    aircraft : str
    axes : tuple of AxisTuning
    yaw : YawTuning or None
        Tuning of the rudder, where the autopilot flies a damper and the answer has a model for it.
    outer : tuple of OuterCheck
        Path and height loops around, as far as the autopilot's were read.
    dated : str
        Day of the covariance that the gains hold over.
    notes : tuple of str
        What was not known, and what was taken in its place.
    release : str
        Release of the autopilot, as its log or the caller names it; empty where nobody does.
    """

    autopilot: Autopilot
    aircraft: str
    axes: tuple[AxisTuning, ...]
    notes: tuple[str, ...]
    dated: str = ""
    yaw: YawTuning | None = None
    outer: tuple[OuterCheck, ...] = ()
    release: str = ""

    @property
    def named(self) -> str:
        """Autopilot and its release."""
        return f"{self.autopilot.name} {self.release}".rstrip()

    @property
    def tuned(self) -> tuple[AxisTuning | YawTuning, ...]:
        """Axes, and the rudder behind them."""
        return (*self.axes, *([self.yaw] if self.yaw else []))

    @property
    def gains(self) -> dict[str, float]:
        """Every gain by the autopilot's own name; axes without gains have none."""
        return {
            one.settings[role].name: round(value, 6)
            for one in self.tuned
            for role, value in (one.design.gains or {}).items()
        }

    @property
    def changes(self) -> tuple[Change, ...]:
        """Parameters that change."""
        return tuple(change for one in self.tuned for change in changes_of(one))

    @property
    def margins(self) -> dict[str, dict[str, float]]:
        """Worst margins of each axis over the unseen aircraft."""
        found = {one.axis: dict(_worst(one)) for one in self.axes}
        if self.yaw is not None:
            found["yaw"] = dict(_worst_of_pair(self.yaw.design.margins))
        return found

    def to_param(self) -> str:
        """Return the changed parameters as the file that the ground station loads."""
        heading = {"aircraft": self.aircraft, "covariance_date": self.dated}
        heading |= {"for": self.named} if self.release else {}
        return self.autopilot.text(self.changes, {**heading, **dict(self._proven())})

    def _proven(self) -> Iterator[tuple[str, str | float]]:
        """Return what the heading of a file says of each axis with gains."""
        yield "first_flight", "half of the gains"
        for one in self.axes:
            if one.design.gains is None:
                continue
            speeds = ", ".join(f"{v:.1f}" for v in one.problem.airspeeds_mps)
            found = one.design.verification
            yield (
                f"{one.axis}_holds",
                f"{found.worst_gain_db:.1f} dB, {found.worst_phase_deg:.0f} deg at least in"
                f" {UNSEEN} aircraft at {speeds} m/s",
            )
            if not self.autopilot.words:
                # Gains are positive; this turns them into the aircraft file's sign of the surface.
                yield f"{one.problem.actuator.surface}_sense", one.problem.axis.sense

    def to_restore(self) -> str:
        """Return the file that takes them back."""
        defaults = {
            setting.name: setting.default for one in self.tuned for setting in one.settings.values()
        }
        heading: dict[str, str | float] = {
            "aircraft": self.aircraft, "back_to": "the values before host tune"
        }  # fmt: skip
        if any(one.old is None for one in self.changes):
            heading["default"] = "nobody named the old values: these are the autopilot's own"
        return self.autopilot.text(taken_back(self.changes, defaults), heading)

    def document(self) -> dict[str, Any]:
        """Return everything as plain numbers and strings."""
        return {
            "autopilot": self.autopilot.name,
            "release": self.release,
            "aircraft": self.aircraft,
            "covariance_date": self.dated,
            "gains": self.gains,
            "changes": [
                {"name": c.name, "new": c.new, "old": c.old, "unit": c.unit} for c in self.changes
            ],
            "margins": self.margins,
            "bandwidth_costs": {one.axis: dict(one.costs) for one in self.axes},
            "outer_loops": {
                one.title: {
                    "gain_db": one.gain_db,
                    "phase_deg": one.phase_deg,
                    "stable": one.stable,
                    "parameters": dict(one.parameters),
                }
                for one in self.outer
            },
            "refused": [one.axis for one in self.axes if one.design.gains is None],
            "notes": list(self.notes),
        }

    def plot(self) -> Pictures:
        """Return a picture of each axis with gains: steps, margins, poles and loop with bands.

        Raises
        ------
        ControlError
            matplotlib is missing.
        """
        from host.control.tuning_pictures import axis_figure

        drawn = (one for one in self.axes if one.design.gains is not None)
        return Pictures({one.axis: axis_figure(one) for one in drawn})

    def to_text(self) -> str:
        """Return what people read."""
        from host.control.tuning_text import tuning_lines

        return "\n".join(tuning_lines(self))

    def __str__(self) -> str:
        """Return the text that `host tune` prints."""
        return self.to_text()

    def __repr__(self) -> str:
        """Return in a line what gains there are."""
        named = ", ".join(f"{name} {value:g}" for name, value in self.gains.items())
        return f"<Tuning of {self.aircraft} for {self.autopilot.name}: {named or 'no gains'}>"

    def _repr_html_(self) -> str:
        """Show what is printed; the name of an aircraft is a stranger's."""
        return f"<pre>{html.escape(self.to_text())}</pre>"


def tune(
    source: Identification | Sequence[str | Path],
    *,
    aircraft: str,
    autopilot: str = "ardupilot",
    parameters: Mapping[str, float] | None = None,
    airspeeds_mps: Sequence[float] = (),
    release: str = "",
    seed: int = 0,
) -> Tuning:
    """Return the fastest gains that keep 6 dB and 45 degrees over all that the data leave open.

    Parameters
    ----------
    source : Identification or sequence of path
        An answer, or models of `host identify --save-model`.
    aircraft : str
        Name or file: travel of the surfaces, servo, span, speed range.
    autopilot : str
        ``ardupilot``, ``px4``, ``inav``, or ``mega``, the logger's hold.
    parameters : mapping of str to float, optional
        Parameters of the autopilot, as a log or a parameter file has them; its defaults without.
    airspeeds_mps : sequence of float
        Speeds that the gains hold at; least, trim and largest of the aircraft file without.
    release : str
        Release of the autopilot, such as ``4.5``; today's names of parameters without.
    seed : int
        Seed of the aircraft drawn.

    Raises
    ------
    ControlError
        Nothing can be tuned: no model of an axis, no travel, an unknown autopilot, or a release
        whose law was not read.
    host.errors.HostError
        A file cannot be read.
    """
    check_asked(autopilot, release, airspeeds_mps)
    chosen = AUTOPILOTS[autopilot]
    newer = release_note(autopilot, release) if release else ""
    if isinstance(source, Sequence):
        paths = [Path(one) for one in source]
        axes, noise = axes_of_models(paths), dict[str, float]()
        # The oldest: a model's file is as old as its answer.
        dated = date.fromtimestamp(min(path.stat().st_mtime for path in paths))
    else:
        axes, dated = axes_of(source), date.today()
        noise = {name: _noise(source, name) for name in axes}
    loaded = load_measured(aircraft)
    logged = dict(parameters or {})
    found = []
    for name, axis in axes.items():
        speeds = tuple(airspeeds_mps) or _speeds(loaded.scalars, axis)
        problem = Problem(
            axis,
            actuator_of(aircraft, name, chosen.travel_rad),
            chosen.structure(name, logged, axis.trim.airspeed_mps),
            speeds,
            loaded.scalars.get("geometry.span_m", 0.0),
            noise.get(name, 0.0),
        )
        usual = {one.name: one.default for one in problem.structure.settings.values()}
        # Where no log has the gains, none was before.
        before = logged if chosen.words else usual
        found.append(AxisTuning(problem, design(problem, seed=seed), before))
    flown = () if isinstance(source, Sequence) else _airspeeds_mps(source)
    notes = [*([newer] if newer else []), *tuning_notes(found, chosen, logged, flown, release)]
    yaw = None
    try:
        found, yaw = with_rudder(chosen, aircraft, found, seed)
    except ControlError as error:
        notes.append(f"no yaw damper: {error}")
    notes += unchecked(chosen, found)
    found = [_explained(one) for one in found]
    outer = tuple(_around(chosen, found, logged, seed))
    return Tuning(
        chosen, loaded.name, tuple(found), tuple(notes), dated.isoformat(), yaw, outer, release
    )


def _explained(one: AxisTuning) -> AxisTuning:
    """Return an axis with what its derivatives cost, and its worst aircraft."""
    problem, gains = one.problem, one.design.gains
    if gains is None:
        return one
    costs = tuple(bandwidth_costs(problem, gains))
    return replace(one, costs=costs, worst=worst_on_contour(problem, gains))


def _around(
    chosen: Autopilot, axes: Sequence[AxisTuning], logged: Mapping[str, float], seed: int
) -> Iterator[OuterCheck]:
    """Yield what the loops around do on aircraft of a drawing of their own."""
    for outer in chosen.outer(logged) if chosen.outer else ():
        for one in axes:
            if one.axis == outer.axis and one.design.gains and _is_whole(one):
                yield check(outer, one.problem, one.design.gains, 1000 * seed + 900)


def _is_whole(one: AxisTuning) -> bool:
    """Return whether the model of an axis has the motion of path and height too."""
    return one.problem.axis.template in ("lateral", "longitudinal")


def unchecked(chosen: Autopilot, axes: Sequence[AxisTuning]) -> Iterator[str]:
    """Yield a sentence for each loop around gains whose motion their model lacks."""
    for outer in chosen.outer({}) if chosen.outer else ():
        for one in axes:
            if one.axis == outer.axis and one.design.gains and not _is_whole(one):
                template = one.problem.axis.template
                yield f"{outer.title} is not checked: the model '{template}' lacks its motion"


def with_rudder(
    chosen: Autopilot, aircraft: str, axes: Sequence[AxisTuning], seed: int
) -> tuple[list[AxisTuning], YawTuning | None]:
    """Return axes and rudder; None where the autopilot flies no damper.

    The fastest roll gains stand at their limit: where no damper keeps its limit with them, those of
    a step more may leave it room.
    """
    found = list(axes)
    if chosen.yaw is None:
        return found, None
    roll = next((one for one in found if one.axis == "roll" and one.design.gains), None)
    if roll is None:
        raise ControlError("roll has no gains to tune it around")
    rudder = partial(_rudder, chosen.yaw, actuator_of(aircraft, "yaw"), seed=seed)
    yaw = rudder(roll)
    if yaw.design.gains is None:
        more = Required().scaled(1.0 + STEP_SHARE)
        softer = replace(roll, design=design(roll.problem, seed=seed, asked=more))
        other = rudder(softer) if softer.design.gains else yaw
        if other.design.gains is not None:
            found[found.index(roll)], yaw = softer, other
    return found, yaw


def _rudder(law: Rudder, drive: Actuator, roll: AxisTuning, *, seed: int) -> YawTuning:
    """Return the rudder around roll gains."""
    axis = roll.problem.axis
    if "N_dr" not in axis.names:
        raise ControlError(f"model '{axis.template}' has no rudder, expected lateral with N_dr")
    structure = law(roll.before, axis.trim.airspeed_mps)
    problem = PairProblem(roll.problem, roll.design.gains or {}, drive, structure)
    return YawTuning(problem, design_yaw(problem, seed=seed), roll.before)


def _speeds(scalars: Mapping[str, float], axis: UncertainAxis) -> tuple[float, ...]:
    least = scalars.get("trim.minimum_airspeed_mps", 0.0)
    largest = scalars.get("trim.maximum_airspeed_mps", 0.0)
    trim = axis.trim.airspeed_mps
    return tuple(sorted({v for v in (least, trim, largest) if v > 0.0}))


def _noise(identified: Identification, axis: str) -> float:
    columns = [flight.recorded.get(RATES[axis]) for flight in identified.flights]
    return gyro_noise_radps([one for one in columns if one is not None])


def _airspeeds_mps(identified: Identification) -> tuple[float, ...]:
    """Return the least and largest airspeed of the maneuvers."""
    flown: list[float] = []
    for flight in identified.flights:
        columns = flight.recorded
        airspeed = columns.get("airspeed_mps")
        if airspeed is None:
            continue
        for one in flight.maneuvers:
            inside = (columns["t_s"] >= one.start_s) & (columns["t_s"] <= one.end_s)
            flown += airspeed[inside & np.isfinite(airspeed)].tolist()
    return (min(flown), max(flown)) if flown else ()


def _worst_of_pair(found: PairMargins) -> Iterator[tuple[str, float]]:
    for name, (gain_db, phase_deg) in (("aileron", found.aileron), ("rudder", found.rudder)):
        yield f"{name}_gain_db", gain_db
        yield f"{name}_phase_deg", phase_deg
    yield "both_disk", found.joint_disk
    yield "yaw_in_gusts_radps", found.yaw_radps
    yield "sideslip_per_bank", found.sideslip


def _worst(one: AxisTuning) -> Iterator[tuple[str, float]]:
    found = one.design.verification
    for name, loop in (("actuator", found.actuator), ("attitude", found.attitude)):
        yield f"{name}_gain_db", float(loop.gain_db.min())
        yield f"{name}_phase_deg", float(loop.phase_deg.min())
        yield f"{name}_disk", float(loop.disk.min())
    if one.worst is not None:
        yield "contour_gain_db", one.worst.gain_db
        yield "contour_phase_deg", one.worst.phase_deg
    yield "crossover_least_radps", found.crossover_radps[0]
    yield "crossover_median_radps", found.crossover_radps[1]
    yield "surface_rate_radps", found.surface_rate_radps
