"""Findings on angles that no vane measured, and on instruments of which nothing is known."""

from __future__ import annotations

from collections.abc import Collection

from host.sysid.aerodynamics.unmeasured_motion import ACCELEROMETER_OF
from host.sysid.checks.data_finding import Finding

WORDS = {"alpha_rad": "the angle of attack", "beta_rad": "the sideslip"}


def no_instrument_errors_finding(columns: Collection[str]) -> Finding:
    """Return the finding that intervals of a flight count no error of the instrument: nothing of
    it comes under "trust"."""
    names = ("p_radps", "q_radps", "r_radps", "elevator_rad", "aileron_rad", "rudder_rad")
    return Finding(
        "instrument-errors",
        tuple(name for name in names if name in columns),
        "without vanes the flight path is not reconstructed, so no interval counts errors of"
        " sensors and servos",
        ("a log without GPS velocity or airspeed", "too short a flight"),
        done="intervals count noise, gusts and errors of the model only",
    )


def no_vanes_finding(columns: Collection[str], *, reconstructed: bool = False) -> list[Finding]:
    """Return a finding where no vane measured an angle that accelerometers observe: nothing of it
    comes under "trust", except where the path is reconstructed, its errors in every interval."""
    missing = tuple(y for y, by in ACCELEROMETER_OF.items() if y not in columns and by in columns)
    if not missing or "airspeed_mps" not in columns:
        return []
    return [
        Finding(
            "flow-angles",
            () if reconstructed else missing,
            f"no vane measured {' and '.join(WORDS[y] for y in missing)}",
            ("an aircraft without vanes", "a column under another name"),
            done="estimated from rates and accelerations where they tell it"
            + ("; errors of IMU, places and servos are in the intervals" if reconstructed else ""),
        )
    ]
