"""Test whether the flight is consistent with the standard deviations of the instrument's file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from host.arrays import Array
from host.instrument.deviations import SensorErrorModel
from host.sysid.reconstruction.flight_path import FLOW, INERTIAL, PITOT, PLACES

# Groups of errors that kinematics can observe, by their names in the file, and their unknowns.
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
ALL = "all"  # name of the test of all groups together
SIGNIFICANCE = 0.01  # of the test: how often a correct file may be rejected
# Reduction of the prior variance from which a direction counts. Below a half an estimate rests on
# the prior, and noise larger than reckoned shows: the vanes' height from the IMU, known to 0.4, is
# off by 2.0 times what file and noise allow (55 flights), all others by 1.0 to 1.2.
LEAST_INFORMATION = 0.5


@dataclass(frozen=True, slots=True)
class ConsistencyTest:
    """Consistency of one group of errors, or of all, with the file's standard deviations.

    Attributes
    ----------
    name : str
        Group in the instrument's file; ``all`` for all groups together.
    rms_ratio : float
        Root mean square of the errors found over that stated.
    degrees_of_freedom : int
        Number of combinations of them that the flight informs; 0: no test is possible.
    probability : float
        Probability of errors as large as these if the file is correct.
    """

    name: str
    rms_ratio: float
    degrees_of_freedom: int
    probability: float

    @property
    def rejected(self) -> bool:
        """Whether the file states less than the flight shows."""
        return self.probability < SIGNIFICANCE


def consistency_tests(
    names: Sequence[str], found: Array, covariance: Array, prior: Mapping[str, tuple[float, float]]
) -> tuple[ConsistencyTest, ...]:
    """Test all observable errors together, then each group.

    If the file is correct, an estimate with the file as prior has the covariance S - P, prior less
    posterior, and its normalised square z' (S - P)^-1 z is chi-square distributed (the test of
    normalised estimation errors of a filter: Bar-Shalom, Li & Kirubarajan, Estimation with
    Applications to Tracking and Navigation, sec. 5.4). Only directions that the flight informs
    count.

    Parameters
    ----------
    names : sequence of str
        Unknowns, in the order of the estimates `found` (n,) and their `covariance` (n, n), both
        with the prior.
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
        _consistency_test(name, own, z, P) for name, own in ((ALL, every), *groups.items()) if own
    )


def _consistency_test(name: str, own: Sequence[int], z: Array, P: Array) -> ConsistencyTest:
    information, directions = np.linalg.eigh(np.eye(len(own)) - P[np.ix_(own, own)])
    observable = information > LEAST_INFORMATION
    count = int(observable.sum())
    if not count:
        return ConsistencyTest(name, 0.0, 0, 1.0)
    statistic = float(np.sum((directions[:, observable].T @ z[own]) ** 2 / information[observable]))
    return ConsistencyTest(
        name, float(np.sqrt(statistic / count)), count, float(special.chdtrc(count, statistic))
    )


def inconsistent_groups(found: Sequence[ConsistencyTest]) -> list[ConsistencyTest]:
    """Return the groups of a file that states too little; none if it is consistent.

    Where no group alone is too large, all together stand for them: it may be any.
    """
    if not found or not found[0].rejected:
        return []
    return [c for c in found[1:] if c.rejected] or list(found[:1])


def widened_to_flight(
    instrument: SensorErrorModel, found: Sequence[ConsistencyTest]
) -> SensorErrorModel:
    """Return an instrument whose errors are as large as a flight shows, where that is more.

    The ratio of Birge (Phys. Rev. 40, 1932, p. 207): deviations times what the residuals ask for.
    """
    for group in inconsistent_groups(found):
        names = OBSERVABLE_GROUPS if group.name == ALL else (group.name,)
        instrument = instrument.scaled(group.rms_ratio, *names)
    return instrument


def calibration_lines(found: Sequence[ConsistencyTest]) -> list[str]:
    """Return the verdict's lines on a file that states too little; none if it is consistent."""
    worst = inconsistent_groups(found)
    if not worst:
        return []
    parts = ", ".join(f"{_in_words(c.name)} {c.rms_ratio:.1f} times" for c in worst)
    return [
        f"the calibration claims less than this flight shows: {parts}; calibrate again, or state"
        " larger deviations"
    ]


def _in_words(group: str) -> str:
    return "all errors together" if group == ALL else group
