"""What the last step of the joint fit says of single terms and single maneuvers."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.compiled import Array
from host.sysid.errors import IdentificationError

LOST = 1e12  # by which a variance grows where a regressor never moves, or is the same as others


def told_inverse(normal: Array, position: Mapping[str, int]) -> Array:
    """Return the inverse of a matrix with ones on its diagonal; name the terms if it has none."""
    try:
        found = np.linalg.inv(normal)
    except np.linalg.LinAlgError:
        found = np.linalg.pinv(normal, rcond=1e-13) + np.diag(np.diag(normal) < 0.5) * 2.0 * LOST
    lost = [n for n, k in position.items() if not abs(found[k, k]) < LOST]
    if lost:
        raise IdentificationError(
            f"the flight cannot tell {', '.join(lost)}: what they go with never moves, or is the"
            " same as other terms; leave them out"
        )
    return found
