"""Test points of a flight: found, graded, cut.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.maneuvers.maneuver_detection import AXES, DetectedManeuver, detect_maneuvers
    from host.sysid.maneuvers.maneuver_grade import Grade, grade
    from host.sysid.maneuvers.maneuver_selection import joined_windows, select_maneuvers

__all__ = [
    "AXES",
    "DetectedManeuver",
    "Grade",
    "detect_maneuvers",
    "grade",
    "joined_windows",
    "select_maneuvers",
]

__getattr__ = lazily(
    __name__,
    {
        "AXES": "maneuver_detection",
        "DetectedManeuver": "maneuver_detection",
        "Grade": "maneuver_grade",
        "detect_maneuvers": "maneuver_detection",
        "grade": "maneuver_grade",
        "joined_windows": "maneuver_selection",
        "select_maneuvers": "maneuver_selection",
    },
)
