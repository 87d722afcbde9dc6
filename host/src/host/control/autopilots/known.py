"""The autopilots that gains can be made for: law, words and file of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from host.control.autopilots import (
    ardupilot,
    ardupilot_yaw,
    inav,
    mega,
    parameter_table,
    px4,
    px4_yaw,
)
from host.control.autopilots.structure import Structure, YawStructure
from host.control.outer_loops import OuterLoop, arduplane_loops, px4_loops
from host.control.parameter_file import (
    Writer,
    cli_text,
    mission_planner_text,
    qgroundcontrol_text,
    toml_text,
)

Rudder = Callable[[Mapping[str, float], float], YawStructure]


@dataclass(frozen=True)
class Autopilot:
    """One autopilot.

    Attributes
    ----------
    name : str
    structure : callable
        From an axis, parameters by name and the airspeed of the model.
    text : callable
        From changes and a heading to the file that its ground station loads.
    yaw : callable or None
        From parameters by name and the airspeed of the model; None where no damper is flown.
    outer : callable or None
        From parameters by name to the loops around, which are checked alone.
    travel_rad : float or None
        Angle of the surface at full output; None where that is the aircraft file's limit.
    """

    name: str
    structure: Callable[[str, Mapping[str, float], float], Structure]
    text: Writer
    yaw: Rudder | None = None
    outer: Callable[[Mapping[str, float]], tuple[OuterLoop, ...]] | None = None
    travel_rad: float | None = None

    @property
    def words(self) -> Mapping[str, str]:
        """What the first flight's page calls its modes and gains; none where none flies yet."""
        return parameter_table.words(self.name)


AUTOPILOTS = {
    one.name: one
    for one in (
        Autopilot(
            "ardupilot",
            ardupilot.structure,
            mission_planner_text,
            ardupilot_yaw.structure,
            arduplane_loops,
        ),
        Autopilot("px4", px4.structure, qgroundcontrol_text, px4_yaw.structure, px4_loops),
        Autopilot("inav", inav.structure, cli_text),
        Autopilot("mega", mega.structure, toml_text, travel_rad=mega.FULL_RAD),
    )
}
