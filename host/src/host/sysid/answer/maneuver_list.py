"""The maneuvers of a flight with their grades, a line each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from host.constants import DEG_PER_RAD

if TYPE_CHECKING:
    from host.sysid.maneuvers.maneuver_detection import DetectedManeuver
    from host.sysid.maneuvers.maneuver_grade import Grade


def maneuver_lines(graded: Sequence[tuple[DetectedManeuver, Grade]]) -> list[str]:
    """Return the list of maneuvers for people."""
    lines = [f"{len(graded)} maneuvers found"]
    for number, (item, mark) in enumerate(graded, start=1):
        unit = "" if item.axis == "throttle" else " deg"
        size = item.amplitude if item.axis == "throttle" else item.amplitude * DEG_PER_RAD
        lines.append(
            f"  {number:2d}  {item.start_s:8.2f} to {item.end_s:8.2f} s"
            f"  {item.axis.split('_')[0]:8s} {item.kind:10s} {size:5.1f}{unit}"
            f"  grade {mark.score:4.2f}" + (f"  {'; '.join(mark.remarks)}" if mark.remarks else "")
        )
    return lines
