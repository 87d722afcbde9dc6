"""What each flight draws: model errors of the aircraft, and how it was recorded.

Every range is uniform. Where the issue that asked for this world gives a range, it is that one.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

# Name of a draw: from, to.
RANGES = {
    # The aircraft. Derivatives of the trainer are scattered, so that no prior knows them.
    "scatter": (-0.2, 0.2),  # of every coefficient, one draw each
    "lift_loss": (0.10, 0.30),  # of the lift slope, 5 deg from the trim
    "moment_change": (0.20, 0.40),  # of Cm_alpha there, of either sign
    "downwash": (0.30, 0.50),  # d epsilon / d alpha: Etkin & Reid, Dynamics of Flight, B.5
    "sidewash": (0.10, 0.30),  # d sigma / d beta
    "tail_arm_chords": (2.4, 3.0),
    "wash_lag": (0.7, 1.2),  # of the time from wing to tail
    "bending_over_short_period": (2.7, 3.3),
    "bending_damping": (0.02, 0.06),
    "bending_share": (0.05, 0.20),  # of q's rms, in q
    "free_play_deg": (0.3, 1.0),
    "servo_radps": (25.0, 60.0),
    "gust_mps": (0.0, 0.6),
    # The record.
    "upwash": (0.05, 0.20),
    "sidewash_at_vane": (0.05, 0.20),
    "imu_late_s": (0.0, 0.0),
    "attitude_late_s": (0.005, 0.030),
    "vane_late_s": (0.005, 0.030),
    "airspeed_late_s": (0.005, 0.030),
    "command_early_s": (0.005, 0.030),
    "vane_ahead_m": (0.0, 0.4),
    "imu_off_m": (-0.05, 0.05),  # of the CG, each axis
    "vane_step_deg": (0.05, 0.35),  # a 10 bit encoder has 0.35
    "airspeed_step_mps": (0.05, 0.5),
    "rate_step_radps": (0.0005, 0.005),
    "force_step_mps2": (0.01, 0.1),
}
SLOW_HZ = {"airspeed_mps": (5.0, 10.0, 25.0), "theta_rad": (10.0, 25.0, 50.0),
           "alpha_rad": (25.0, 50.0, 100.0)}  # fmt: skip
SIGNED = ("moment_change",)


@dataclass(frozen=True, slots=True)
class Draw:
    """The draws of one flight; see `RANGES`."""

    values: dict[str, float]
    slow_hz: dict[str, float]

    def __getitem__(self, name: str) -> float:
        """Return one draw."""
        return self.values[name]


def draw(rng: np.random.Generator) -> Draw:
    """Return the draws of one flight."""
    values = {name: float(rng.uniform(*bounds)) for name, bounds in RANGES.items()}
    for name in SIGNED:
        values[name] *= float(rng.choice((-1.0, 1.0)))
    return Draw(values, {name: float(rng.choice(of)) for name, of in SLOW_HZ.items()})


def scattered(rng: np.random.Generator, of: object) -> dict[str, float]:
    """Return the coefficients of an aircraft, each scattered on its own; masses stay."""
    share = RANGES["scatter"]
    return {
        f.name: getattr(of, f.name) * (1.0 + float(rng.uniform(*share)))
        for f in fields(of)  # type: ignore[arg-type]
        if f.name[0] == "C" and f.name not in ("CL_0", "Cm_0")
    }
