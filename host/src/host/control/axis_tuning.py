"""One axis of an answer to `host tune`: what was asked, what was found, what was before."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from host.control.autopilots.structure import Setting
from host.control.lateral_pair import PairProblem
from host.control.loop_design import Design
from host.control.parameter_file import Change
from host.control.scenarios import Problem
from host.control.worst_aircraft import WorstAircraft
from host.control.yaw_design import YawDesign


@dataclass(frozen=True)
class AxisTuning:
    """One axis: what was asked, what was found, what was before."""

    problem: Problem
    design: Design
    before: Mapping[str, float]
    costs: tuple[tuple[str, float], ...] = ()
    worst: WorstAircraft | None = None

    @property
    def axis(self) -> str:
        """``roll`` or ``pitch``."""
        return self.problem.axis.axis

    @property
    def settings(self) -> Mapping[str, Setting]:
        """Parameters by their role."""
        return self.problem.structure.settings


@dataclass(frozen=True)
class YawTuning:
    """The rudder: what was asked, what was found, what was before."""

    problem: PairProblem
    design: YawDesign
    before: Mapping[str, float]

    @property
    def settings(self) -> Mapping[str, Setting]:
        """Parameters by their role."""
        return self.problem.yaw.settings


def changes_of(one: AxisTuning | YawTuning) -> Iterator[Change]:
    """Yield parameters whose value is another than before; none where no gains hold."""
    for role, value in (one.design.gains or {}).items():
        known = one.settings[role]
        old = one.before.get(known.name)
        if old is None or abs(old - value) > 0.5 * known.step:
            yield Change(known.name, round(value, 6), old, known.unit)
