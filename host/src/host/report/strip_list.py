"""Which channels stand in one strip, and which strips are shown first."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

# name, channels, shown first
_STRIPS = (
    ("airspeed", ("airspeed_mps",), True),
    ("angle of attack", ("alpha_a_deg", "alpha_b_deg"), True),
    ("angle of attack", ("alpha_deg",), True),
    ("vanes of alpha, difference", ("alpha_pair_deg",), False),
    ("sideslip", ("beta_a_deg", "beta_b_deg"), True),
    ("sideslip", ("beta_deg",), True),
    ("vanes of beta, difference", ("beta_pair_deg",), False),
    ("pitots", ("differential_a_pa", "differential_b_pa"), False),
    ("pitots, difference", ("pitot_pair_pa",), False),
    ("rates", ("p_degps", "q_degps", "r_degps"), True),
    ("bank and pitch", ("phi_deg", "theta_deg"), True),
    ("heading", ("psi_deg",), False),
    ("specific force", ("ax_mps2", "ay_mps2", "az_mps2"), False),
    ("surfaces", ("elevator_deg", "aileron_deg", "rudder_deg"), True),
    ("surfaces, share of travel", ("elevator_share", "aileron_share", "rudder_share"), True),
    ("aileron, left and right", ("aileron_left_deg", "aileron_right_deg"), False),
    ("throttle", ("throttle",), False),
    ("elevator, stick and servo", ("rc_elevator_us", "servo_elevator_us"), True),
    ("aileron, stick and servo", ("rc_aileron_us", "servo_aileron_us"), False),
    ("rudder, stick and servo", ("rc_rudder_us", "servo_rudder_us"), False),
    ("throttle, stick and servo", ("rc_throttle_us", "servo_throttle_us"), False),
    ("altitude", ("altitude_m",), True),
)


@dataclass(frozen=True, slots=True)
class Strip:
    """Channels over one axis; `on` where it is shown without asking."""

    name: str
    channels: tuple[str, ...]
    on: bool


def strips_of(names: Collection[str]) -> list[Strip]:
    """Return the strips a flight has: those of whose channels at least one was measured.

    The first of two strips of one name that is whole stands.
    """
    found: dict[str, Strip] = {}
    for name, wanted, on in _STRIPS:
        there = tuple(one for one in wanted if one in names)
        whole = len(there) == len(wanted)
        if there and (name not in found or (whole and len(found[name].channels) < 2)):
            single = len(there) < len(wanted) and ("pair" in name or wanted[0].endswith("_a_deg"))
            if name not in found and not single:
                found[name] = Strip(name, there, on)
    if not any(strip.on for strip in found.values()):
        for name in list(names)[:4]:
            found[name] = Strip(name, (name,), True)
    return list(found.values())
