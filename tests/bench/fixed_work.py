"""A fixed computation: seconds divided by its own compare on machines of any speed.

Small matrices are multiplied and solved, as a search does.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np

RUNS = 5


def seconds(work: Callable[[], object]) -> float:
    """Return the processor seconds of a call."""
    begin_s = time.process_time()
    work()
    return time.process_time() - begin_s


def unit_s() -> float:
    """Return the processor seconds of the fixed computation, the median of five."""
    return statistics.median(seconds(_fixed_work) for _ in range(RUNS))


def _fixed_work() -> float:
    rng = np.random.default_rng(1)
    small, wide, total = rng.standard_normal((4, 4)), rng.standard_normal((4, 2000)), 0.0
    for _ in range(20000):
        total += float(np.linalg.solve(small, small @ wide[:, :50])[0, 0] + (small @ wide)[0, 0])
    return total
