"""How long the steps of a test input are: by the mode that it excites.

The energy of a 3-2-1-1 lies about a mode whose period is 3.3 of its units, that of a doublet about
one of two halves (Jategaonkar, Flight Vehicle System Identification, 2nd ed., ch. 2).
"""

from __future__ import annotations

HAND_S = 0.2  # a thumb is no faster
ROLL_UNIT_S = 0.3  # of a 3-2-1-1 on the aileron: long against the roll mode of models
ROLL_HALF_S = 0.6  # of a doublet there


def unit_of_3211_s(period_s: float) -> float:
    """Return the shortest step of a 3-2-1-1 for a mode of this period."""
    return max(0.3 * period_s, HAND_S)


def half_of_doublet_s(period_s: float) -> float:
    """Return one side of a doublet for a mode of this period."""
    return max(0.5 * period_s, HAND_S)
