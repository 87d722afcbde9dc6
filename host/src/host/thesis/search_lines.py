"""How the networks settled, and what the line search of the original program reached."""

from __future__ import annotations

import numpy as np

from host.sysid.estimators.settling import settling_lines
from host.sysid.models import FitResult

STILL = 1e-4  # of the error of the line search, lowered by less: its start but for rounding


def search_lines(result: FitResult) -> list[str]:
    """Return since when the parameters stayed near their end, and how the program's error fell."""
    error = np.asarray(result.details["history_error_percent"])
    if error[0] - error[-1] <= STILL * error[0]:
        return [
            f"  no sweep lowered the error of the original program ({error[0]:.4g} %): the answer"
            " is its start; at least squares the network stands still, start=model and start=zero"
            " (method option) let it move"
        ]
    return [
        *settling_lines(result),
        f"  error of the original program {error[0]:.4g} to {error[-1]:.4g} % in"
        f" {len(error) - 1} sweeps",
    ]
