"""The worst aircraft on the 95 % contour of an answer: reported, and required of no gains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.control.scenarios import Problem, scenarios_of
from host.control.verification import Required

CONTOUR = 0.95
TURNS = 4  # of the search; the second and later ones move a margin by less than 0.1 dB
STEP = 0.1  # of the contour's radius, for slopes


@dataclass(frozen=True)
class WorstAircraft:
    """One aircraft of the contour.

    Attributes
    ----------
    gain_db, phase_deg : float
        Least of both loops over the airspeeds.
    moved : tuple of (str, float)
        Derivatives and by which share of themselves they are off, the furthest of their interval
        first.
    """

    gain_db: float
    phase_deg: float
    moved: tuple[tuple[str, float], ...]

    @property
    def line(self) -> str:
        """A line of its margins and largest deviations."""
        named = ", ".join(f"{name} {100.0 * share:+.0f} %" for name, share in self.moved[:2])
        return (
            f"worst on the 95 % contour, not required: {self.gain_db:.1f} dB,"
            f" {self.phase_deg:.0f} deg at {named}"
        )


def worst_on_contour(problem: Problem, gains: Mapping[str, float]) -> WorstAircraft | None:
    """Return the aircraft of the joint 95 % contour with the least margins; the drive is its mean.

    On a sphere the least of a function lies along its slope: the search turns there, a few times.
    None where nothing is open.

    Parameters
    ----------
    problem : Problem
    gains : mapping of str to float
        By role.
    """
    from scipy.stats import chi2

    axis, drive = problem.axis, problem.actuator
    values, vectors = np.linalg.eigh(axis.covariance)
    open_ones = values > 1e-12 * np.max(values)
    if not np.max(values) > 0.0:
        return None
    root = vectors[:, open_ones] * np.sqrt(values[open_ones])
    count = root.shape[1]
    radius = float(np.sqrt(chi2.ppf(CONTOUR, count)))
    nominal = np.array([[drive.travel_rad, drive.bandwidth_hz, drive.delay_s]])
    asked = Required()

    def margins(units: Array) -> tuple[Array, Array]:
        """Return the least gain and phase margin of each, shape (N,)."""
        drawn = axis.mean + radius * units @ root.T
        seen = scenarios_of(problem, drawn, np.repeat(nominal, len(units), axis=0))
        judged = seen.judged(gains)
        gain, phase = (
            np.min([one.reshape(-1, len(units)) for one in both], axis=(0, 1))
            for both in ([m.gain_db for m in judged], [m.phase_deg for m in judged])
        )
        return gain, phase

    def kept(units: Array) -> Array:
        gain, phase = margins(units)
        return np.asarray(np.minimum(gain / asked.gain_db, phase / asked.phase_deg))

    around = STEP * np.concatenate([np.eye(count), -np.eye(count)])
    at, best, least = np.zeros(count), np.zeros(count), np.inf
    for _ in range(TURNS):
        found = kept(at + around)
        slope = found[:count] - found[count:]
        size = float(np.linalg.norm(slope))
        if size == 0.0:
            break
        both = np.array([-slope, slope]) / size
        found = kept(both)
        at = both[int(np.argmin(found))]
        if float(np.min(found)) < least:
            best, least = at, float(np.min(found))
    gain, phase = margins(best[None])
    shift = radius * root @ best
    far = np.abs(shift) / np.sqrt(np.maximum(np.diag(axis.covariance), 1e-300))
    order = [k for k in np.argsort(-far) if axis.mean[k] != 0.0]
    moved = tuple((axis.names[k], float(shift[k] / axis.mean[k])) for k in order)
    return WorstAircraft(float(gain[0]), float(phase[0]), moved)
