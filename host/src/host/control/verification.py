"""Gains proven on aircraft that no step of their design has seen.

None of 135 aircraft below the limits says that 95 % of all are above them, with 99.9 % confidence:
0.95^135 = 0.001 (Tempo, Bai & Dabbene, Systems & Control Letters 30, 1997). The worst margins are
those of python-control, from the loop's frequency response; its polynomials of a sampled loop of
fifteen states lose theirs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from host.arrays import Array
from host.control.control_error import ControlError
from host.control.margins import FAR_DB, FAR_DEG, Margins, Spectra
from host.control.scenarios import Problem, draw
from host.extras import install_hint

UNSEEN = 135


@dataclass(frozen=True, slots=True)
class Required:
    """Least gain margin (dB) and phase margin (degrees) of every loop."""

    gain_db: float = 6.0
    phase_deg: float = 45.0

    def missing(self, found: Margins) -> float:
        """Return what the worst loop lacks, in shares of what is asked; 0 where nothing."""
        gain = 1.0 - float(np.min(found.gain_db)) / self.gain_db
        phase = 1.0 - float(np.min(found.phase_deg)) / self.phase_deg
        return max(gain, 0.0) + max(phase, 0.0)

    def scaled(self, factor: float) -> Required:
        """Return both multiplied."""
        return Required(factor * self.gain_db, factor * self.phase_deg)

    def tightened(self, worst: tuple[float, float], least_share: float) -> Required:
        """Return margins for the next design: each by what unseen aircraft lacked of it.

        Parameters
        ----------
        worst : tuple of float
            Gain (dB) and phase margin (degrees) of the failed verification.
        least_share : float
            Least margin as a share of the limit, where one lacked at all.
        """
        limits = Required()

        def more(limit: float, found: float) -> float:
            return max(limit - found, least_share * limit) if found < limit else 0.0

        return Required(
            self.gain_db + more(limits.gain_db, worst[0]),
            self.phase_deg + more(limits.phase_deg, worst[1]),
        )


@dataclass(frozen=True, slots=True)
class LoopMargins:
    """Margins of one loop over all unseen aircraft and airspeeds, each of shape (N,)."""

    gain_db: Array
    phase_deg: Array
    disk: Array


@dataclass(frozen=True, slots=True)
class Verification:
    """What 135 unseen aircraft say of gains.

    Attributes
    ----------
    actuator, attitude : LoopMargins
        Loop broken at the actuator, and the attitude loop at its own command.
    stable : bool
        Whether every closed loop is.
    crossover_radps : tuple of float
        Least, median and largest of the loop at the actuator.
    surface_rate_radps : float
        Largest rms in gusts of 1 m/s.
    required : Required
    """

    actuator: LoopMargins
    attitude: LoopMargins
    stable: bool
    crossover_radps: tuple[float, float, float]
    surface_rate_radps: float
    required: Required

    @property
    def worst_gain_db(self) -> float:
        """Smallest gain margin of either loop."""
        return float(min(np.min(self.actuator.gain_db), np.min(self.attitude.gain_db)))

    @property
    def worst_phase_deg(self) -> float:
        """Smallest phase margin of either loop."""
        return float(min(np.min(self.actuator.phase_deg), np.min(self.attitude.phase_deg)))

    @property
    def holds(self) -> bool:
        """Whether every aircraft keeps what is required."""
        return (
            self.stable
            and self.worst_gain_db >= self.required.gain_db
            and self.worst_phase_deg >= self.required.phase_deg
        )


def verify(
    problem: Problem, gains: Mapping[str, float], *, seed: int, required: Required
) -> Verification:
    """Return what unseen aircraft say of gains.

    Raises
    ------
    ControlError
        python-control is not installed.
    """
    try:
        import control
    except ImportError as error:
        raise ControlError(
            f"python-control judges the gains and is missing: {install_hint('control')}"
        ) from error

    unseen = draw(problem, seed=seed, count=UNSEEN)
    w = unseen.frequency_radps
    own = unseen.judged(gains)
    found = []
    for loops, known in zip(unseen.loops(gains), own, strict=True):
        gain_db, phase_deg = known.gain_db.copy(), known.phase_deg.copy()
        # Its margin of one loop takes as long as ours of a hundred; both agree on all of them.
        for k in (int(np.argmin(gain_db)), int(np.argmin(phase_deg))):
            gain_db[k], phase_deg[k] = control_margins(control, loops[k], w)
        found.append(LoopMargins(gain_db, phase_deg, known.disk))
    crossover = own[0].crossover_radps
    return Verification(
        found[0],
        found[1],
        bool(unseen.stable(gains).all()),
        (float(crossover.min()), float(np.median(crossover)), float(crossover.max())),
        float(np.max(unseen.moving(gains)[0])),
        required,
    )


def control_margins(control: Any, loop: Spectra, w: Array) -> tuple[float, float]:
    """Return gain (dB) and phase margin (degrees) of one loop as python-control has them.

    Parameters
    ----------
    control : module
    loop, w : Array, shape (F,)
    """
    phase = np.rad2deg(np.unwrap(np.angle(loop)))
    gains, phases, *_ = control.stability_margins((np.abs(loop), phase, w), returnall=True)
    gain = np.min(np.abs(20.0 * np.log10(gains)), initial=FAR_DB)
    away = np.min(np.abs(phases), initial=FAR_DEG)
    return float(gain), float(away)
