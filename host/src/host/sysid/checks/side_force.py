"""How large side forces are compared with lift: in which unit a side force is likely.

Over the airspeed a side force turns sideslip by little, and delays of right sensors hide whether it
is in g. CY_beta over CL_alpha is 0.02 of the Zagi and 0.28 of the Aerosonde (Beard & McLain, Small
Unmanned Aircraft, app. E), 0.03 of the Ultra Stick 25e (UASLab), 0.19 of a Boeing 747 on its
approach (Roskam): a tenth in the middle. A unit is a factor of 9.8 or 3.3 away.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from host.arrays import Array
from host.sysid.checks.identity_factors import correlation

USUAL_SHARE = 0.1  # of lift
SPREAD = 1.2  # of its logarithm: root mean square of the four aircraft above about a tenth
LEAST_CORRELATION = 0.5  # of a force with its angle: with less the angle is not what makes it


def unlikely_factors(means: Mapping[str, Array], tried: Iterable[float]) -> dict[float, float]:
    """Return how many deviations squared a side force, so many times, is from what is usual.

    Parameters
    ----------
    means : mapping
        SI columns, means of short blocks.
    tried : iterable of float
        Factors of the side force. Where a force does not follow its angle none is unlikely.
    """
    side, lift = _slope(means, "ay_mps2", "beta_rad"), _slope(means, "az_mps2", "alpha_rad")
    if side is None or lift is None:
        return {}
    share = side / lift / USUAL_SHARE
    return {f: (float(np.log(f * share)) / SPREAD) ** 2 for f in tried}


def _slope(means: Mapping[str, Array], force: str, angle: str) -> float | None:
    """Return the size of a force over its angle, m/s2; None where they are not related."""
    if force not in means or angle not in means:
        return None
    close = abs(correlation(means[angle], means[force]))
    if close < LEAST_CORRELATION:
        return None
    return close * float(np.std(means[force]) / np.std(means[angle]))
