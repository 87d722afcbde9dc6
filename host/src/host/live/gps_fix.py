"""Where GPS says the aircraft is: of a frame, or of a row of text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from host.wire.schema import Schema


@dataclass(frozen=True, slots=True)
class GpsFix:
    """One navigation solution.

    Parameters
    ----------
    t_s : float
        On the clock of the rows.
    word : str
        Word of the schema's `gps_fix`, such as ``fix_3d``.
    satellites : int
    place : (float, float, float) or None
        Latitude, longitude (deg), height above mean sea level (m); None without a fix.
    velocity_mps : (float, float, float)
        North, east, down.
    ground_speed_mps : float
    course_deg : float
    """

    t_s: float
    word: str
    satellites: int
    place: tuple[float, float, float] | None
    velocity_mps: tuple[float, float, float]
    ground_speed_mps: float
    course_deg: float


def fix_of_frame(schema: Schema, row: Any, t_s: float) -> GpsFix:
    """Return what a frame `gps` says."""
    layout = schema.by_name["gps"]

    def value(name: str) -> float:
        return float(row[name]) * layout.field(name).scale

    word = schema.word("gps_fix", int(row["fix"]))
    known = word in ("fix_2d", "fix_3d")
    return GpsFix(
        t_s,
        word,
        int(row["satellites"]),
        (value("latitude"), value("longitude"), value("height")) if known else None,
        (value("v_north"), value("v_east"), value("v_down")),
        value("ground_speed"),
        value("course"),
    )
