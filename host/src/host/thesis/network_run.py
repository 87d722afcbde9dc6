"""How an iteration of the network went."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from host.arrays import Array


@dataclass(frozen=True, slots=True)
class NetworkRun:
    """How an iteration went.

    Attributes
    ----------
    step : Array, shape (K,)
        Iterations or sweeps done.
    history : Array, shape (K, P)
        The parameters then, start and end included.
    error_percent : Array, shape (K,)
        The figure of the original program, where it is what the iteration looks at.
    """

    step: Array
    history: Array
    error_percent: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def estimate(self) -> Array:
        """The parameters at the end."""
        return np.asarray(self.history[-1], dtype=np.float64)
