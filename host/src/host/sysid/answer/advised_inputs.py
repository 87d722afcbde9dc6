"""Which test input informs the derivatives by a state or an input."""

from __future__ import annotations

ADVISED = {
    "alpha": "an elevator 3-2-1-1 at the short-period frequency",
    "q": "a quicker elevator 3-2-1-1",
    "de": "a larger elevator doublet",
    "V": "an elevator pulse and 20 s hands off, for the phugoid",
    "beta": "a rudder doublet at the dutch-roll frequency",
    "p": "a larger aileron doublet",
    "r": "a rudder 3-2-1-1",
    "da": "a larger aileron doublet",
    "dr": "a larger rudder doublet",
}


def advised_input(derivative: str) -> str:
    """Return what to fly to learn a derivative (`M_alpha`, `Cl_da`); empty if nothing is known."""
    return ADVISED.get(derivative.split("_")[-1], "")
