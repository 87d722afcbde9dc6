"""One channel of ours, at its own instants, and where it came from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.arrays import Array


@dataclass(frozen=True, slots=True)
class Signal:
    """A channel.

    Attributes
    ----------
    t_s : (m,) array
        When it was sampled, as far as the log says.
    values : (m,) array
        Our unit and sign; NaN where it is not valid.
    source : str
        Message, instance and field.
    late_s : float
        Nominal delay (s) by the autopilot's own filters; reported, not removed.
    """

    t_s: Array
    values: Array
    source: str
    late_s: float = 0.0

    @property
    def rate_hz(self) -> float:
        """Return the usual rate; zero of fewer than two samples."""
        steps = np.diff(self.t_s)
        steps = steps[steps > 0.0]
        return float(1.0 / np.median(steps)) if len(steps) else 0.0

    @property
    def has_values(self) -> bool:
        """Return whether there is any value."""
        return bool(np.isfinite(self.values).any())
