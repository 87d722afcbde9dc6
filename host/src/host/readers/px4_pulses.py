"""PX4's pulses converted back to surface demands, by PWM_MAIN_ and PWM_AUX_ parameters.

A pin whose FUNC is 200 + k carries surface k. Its pulse is linear between MIN and MAX, by way of
CENT where that is set (v1.16 on); a bit of REV turns it (src/lib/mixer_module).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.arrays import Array

GROUPS = ("PWM_MAIN", "PWM_AUX")
FIRST_SERVO, SERVOS = 201, 8
LOW_US, HIGH_US = 1000.0, 2000.0  # of a parameter that the log does not have
CENTRES_US = (800.0, 2200.0)  # others say that there is none
PLAUSIBLE_SHARE = 0.95
SLACK_US = 2.0


def controls_of_pulses(
    pulses_us: Mapping[int, Array], parameters: Mapping[str, float], group: str
) -> dict[int, Array]:
    """Return the control of each surface, -1 to 1, by its number from 0.

    Parameters
    ----------
    pulses_us : mapping of int to (n,) array
        By pin, from 1.
    parameters : mapping of str to float
    group : str
        One of `GROUPS`: which parameters name the pins.

    Returns
    -------
    dict of int to (n,) array
        NaN where no pulse of the servo's range was sent; empty where that is the rule: the pins are
        not of this group.
    """
    found: dict[int, Array] = {}
    turned = int(parameters.get(f"{group}_REV", 0.0))
    for pin, pulse in sorted(pulses_us.items()):
        surface = int(parameters.get(f"{group}_FUNC{pin}", 0.0)) - FIRST_SERVO
        if not 0 <= surface < SERVOS or surface in found:
            continue
        low = parameters.get(f"{group}_MIN{pin}", LOW_US)
        high = parameters.get(f"{group}_MAX{pin}", HIGH_US)
        centre = parameters.get(f"{group}_CENT{pin}", 0.0)
        middle = centre if CENTRES_US[0] <= centre <= CENTRES_US[1] else 0.5 * (low + high)
        if not low < middle < high:
            return {}
        sent = (pulse >= low - SLACK_US) & (pulse <= high + SLACK_US)
        if np.mean(sent) < PLAUSIBLE_SHARE:
            return {}
        share = np.interp(pulse, [low, middle, high], [-1.0, 0.0, 1.0])
        share = -share if turned & 1 << pin - 1 else share
        found[surface] = np.where(sent, share, np.nan)
    return found
