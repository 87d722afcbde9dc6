"""Does the flight contradict what the instrument's file claims? Errors found against errors stated.

An error found is drawn from what the file states, and the flight's own noise on top. Where the file
is honest, an estimate that has the file for its prior scatters by S - P, prior less posterior
covariance, so its square over that is chi-squared. Only directions count of which the flight tells
something. Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and Navigation,
sec. 5.4 (normalised innovation squared), for the same test of a filter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from host.arrays import Array
from host.sysid.compatibility.flight_path import FLOW, INERTIAL, PITOT, PLACES

# Groups that kinematics can see, by the names of the instrument's file, and their unknowns.
OBSERVABLE_GROUPS: dict[str, tuple[str, ...]] = {
    "gyro_bias_radps": INERTIAL[0:3],
    "gyro_scale": INERTIAL[3:6],
    "accel_bias_mps2": INERTIAL[6:9],
    "accel_scale": INERTIAL[9:12],
    "misalignment_rad": INERTIAL[12:15],
    "vane_scale": FLOW[0::2],
    "vane_zero_rad": FLOW[1::2],
    "pitot_scale": PITOT[:1],
    "pitot_zero_pa": PITOT[1:],
    "place_m": PLACES,
}
ALARM = 0.01  # how often an honest file may be doubted
LEAST_INFORMATION = 0.3  # of the prior's variance, that a direction counts


@dataclass(frozen=True, slots=True)
class ConsistencyTest:
    """What the flight says of one group of errors, or of all: its own word against the file's.

    Attributes
    ----------
    name : str
        Of the instrument's file; ``all`` for the whole.
    times : float
        How many times as large as stated the errors found are, rms.
    directions : int
        How many combinations of them the flight tells; 0: nothing can be said.
    probability : float
        Of errors as large as that, were the file honest.
    """

    name: str
    times: float
    directions: int
    probability: float

    @property
    def rejected(self) -> bool:
        """Whether the file claims less than the flight shows."""
        return self.probability < ALARM


def consistency_tests(
    names: Sequence[str], found: Array, covariance: Array, prior: Mapping[str, tuple[float, float]]
) -> tuple[ConsistencyTest, ...]:
    """Return the test of all visible errors together, then of each group.

    Parameters
    ----------
    names : sequence of str
        Unknowns, in the order of `found` (n,) and `covariance` (n, n), which have the prior in
        them.
    prior : mapping
        Mean and standard deviation of each, as the file states them.
    """
    place = {name: k for k, name in enumerate(names)}
    groups = {g: [place[n] for n in own if n in place] for g, own in OBSERVABLE_GROUPS.items()}
    every = sorted(k for own in groups.values() for k in own)
    mean, sd = (np.array([prior[n][i] for n in names]) for i in (0, 1))
    z = (found - mean) / sd
    P = covariance / np.outer(sd, sd)
    return tuple(
        _consistency_test(name, own, z, P) for name, own in (("all", every), *groups.items()) if own
    )


def _consistency_test(name: str, own: Sequence[int], z: Array, P: Array) -> ConsistencyTest:
    told, directions = np.linalg.eigh(np.eye(len(own)) - P[np.ix_(own, own)])
    kept = told > LEAST_INFORMATION
    count = int(kept.sum())
    if not count:
        return ConsistencyTest(name, 0.0, 0, 1.0)
    square = float(np.sum((directions[:, kept].T @ z[own]) ** 2 / told[kept]))
    return ConsistencyTest(
        name, float(np.sqrt(square / count)), count, float(special.chdtrc(count, square))
    )


def calibration_lines(found: Sequence[ConsistencyTest]) -> list[str]:
    """Return what a verdict says of a file that claims too little; nothing of an honest one."""
    if not found or not found[0].rejected:
        return []
    named = [c for c in found[1:] if c.rejected]
    worst = named or sorted(found[1:], key=lambda c: c.probability)[:1]
    parts = ", ".join(f"{c.name} {c.times:.1f} times" for c in worst)
    return [
        f"the calibration claims less than this flight shows: {parts}; intervals are too narrow:"
        " calibrate again, or state larger deviations"
    ]
