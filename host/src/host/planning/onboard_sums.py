"""Running Fourier transforms as the logger forms them: 32-bit integers, 50 samples a second.

Bit for bit the arithmetic of `firmware/core/learning/fourier_sums.h`, or the same in double
precision, which is what the integers are judged by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

SAMPLE_HZ = 50
TURN_STEPS = 512
ONE_Q12 = 4096
MOST_SAMPLES = 60 * SAMPLE_HZ
MOST_SUMS = 30  # complex
LEAST_INT16, MOST_INT16 = -(2**15), 2**15 - 1
PITCH, ROLL, YAW = "pitch", "roll", "yaw"
# Signals of an axis, in the order of the logger.
SIGNALS = {
    PITCH: ("alpha", "q", "de"),
    ROLL: ("beta", "p", "r", "da", "dr"),
    YAW: ("beta", "p", "r", "da", "dr"),
}
_SINE = np.rint(ONE_Q12 * np.sin(2.0 * np.pi * np.arange(TURN_STEPS // 4 + 1) / TURN_STEPS))


@dataclass(frozen=True, slots=True)
class AxisCard:
    """What the flight card tells the learning of one axis.

    Attributes
    ----------
    axis : str
        ``pitch``, ``roll`` or ``yaw``.
    harmonics : tuple of int
        Times 50/512 Hz.
    advance_s, curvature_s2 : tuple of float
        Sampling of the angle and the surfaces: a signal x is x + advance x' + curvature x''.
    lever : float
        Counts of the angle at the CG per count of the rate that turns with it.
    product : float
        Share of the other rate's acceleration: Ixz/Ixx of roll, Ixz/Izz of yaw, 0 of pitch.
    gain : tuple of float
        Derivative of the moment coefficient per ratio of counts, a signal each.
    tolerance : tuple of float
        Half-widths that the instrument leaves, in the derivatives' units.
    wanted_percent : tuple of int
        Half-width that is enough, per cent of the estimate; 0: this one is not sent.
    """

    axis: str
    harmonics: tuple[int, ...]
    advance_s: tuple[float, ...]
    curvature_s2: tuple[float, ...]
    lever: float
    product: float
    gain: tuple[float, ...]
    tolerance: tuple[float, ...]
    wanted_percent: tuple[int, ...]

    @property
    def signals(self) -> int:
        """Number of signals."""
        return len(SIGNALS[self.axis])


def rotation(step: int) -> tuple[int, int]:
    """Return 4096 exp(-2j pi step / 512) from the logger's table: cosine and minus sine."""
    return _sine_q12(step + TURN_STEPS // 4), -_sine_q12(step)


def _sine_q12(step: int) -> int:
    inside = step % (TURN_STEPS // 2)
    size = int(_SINE[min(inside, TURN_STEPS // 2 - inside)])
    return -size if step % TURN_STEPS >= TURN_STEPS // 2 else size


class FourierSums:
    """Sums of one axis while its input is flown.

    Parameters
    ----------
    card : AxisCard
    exact : bool
        In double precision: no table, nothing rounded down.
    """

    def __init__(self, card: AxisCard, *, exact: bool = False) -> None:
        self.card, self.exact = card, exact
        self.count = 0
        kind = np.float64 if exact else np.int64
        self.sums: NDArray[Any] = np.zeros((len(card.harmonics), card.signals, 2), dtype=kind)
        self._origin = np.zeros(card.signals, dtype=np.int64)
        self.last = np.zeros(card.signals, dtype=np.int64)

    def take(self, values: Sequence[int] | NDArray[np.int64]) -> bool:
        """Add a sample of raw counts; False when 60 s are full."""
        if self.count >= MOST_SAMPLES:
            return False
        given = np.asarray(values, dtype=np.int64)
        if self.count == 0:
            self._origin = given
        self.last = np.clip(given - self._origin, LEAST_INT16, MOST_INT16)
        self.count += 1
        for k in range(len(self.card.harmonics)):
            self.sums[k] += self.share(k)
        return True

    def turned(self, harmonic: int) -> tuple[float, float]:
        """Return 4096 exp(-j w t) of the harmonic in this place, at the newest sample."""
        step = self.card.harmonics[harmonic] * (self.count - 1)
        if not self.exact:
            return rotation(step)
        angle = 2.0 * np.pi * step / TURN_STEPS
        return ONE_Q12 * float(np.cos(angle)), -ONE_Q12 * float(np.sin(angle))

    def halved(self, share: NDArray[Any]) -> NDArray[Any]:
        """Return half a share: what the trapezoidal rule takes off the newest sample."""
        return np.asarray(share / 2.0 if self.exact else share >> 1)

    def share(self, harmonic: int) -> NDArray[Any]:
        """Return the increment of each signal's Fourier sum by the newest sample, (signals, 2)."""
        products = np.outer(self.last, self.turned(harmonic))
        return np.asarray(
            products / 256.0 if self.exact else (products.astype(np.int64) + 128) >> 8
        )
