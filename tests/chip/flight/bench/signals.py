"""Judge the log's samples against what was put in: the IMU's packets, steps and ramps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from devices.ardu_imu import SentSample
from flight.bench.plan import CYCLES_PER_S, Profile
from numpy.typing import NDArray

CYCLES_PER_US = CYCLES_PER_S // 1_000_000
CHANNELS = ("p", "q", "r", "ax", "ay", "az", "phi", "theta", "psi")
ROUND_US = 11 * 104  # four rounds over eleven channels: a field is spread over three of these
CODE_CENTRE = 0.5  # a converter cuts: its code stands for a voltage half a count higher


@dataclass(frozen=True, slots=True)
class Samples:
    """IMU samples in the log: how many were sent, are missing, stand there twice, are strange."""

    sent: int
    missing: int
    repeated: int
    strange: int


def find_samples(rows: NDArray[np.void], sent: Sequence[SentSample], last_cycle: int) -> Samples:
    """Look for every sample that the IMU sent, all nine values and its number.

    Parameters
    ----------
    rows : NDArray, shape (n,)
        Identification frames of the log.
    sent : sequence of SentSample
        What the IMU sent at the logged rate; those before the log's first sample do not count.
    last_cycle : int
        Samples from here on may still have been in the ring when the battery was pulled.
    """
    columns = [rows["imu_seq"], *(rows[name] for name in CHANNELS)]
    logged = Counter(zip(*(column.tolist() for column in columns), strict=True))
    keys = [
        (s.sequence, *s.sample.rates, *s.sample.specific_force, *s.sample.angles_cdeg) for s in sent
    ]
    known = set(keys)
    first = next((i for i, key in enumerate(keys) if key in logged), len(keys))
    wanted = [key for key, s in zip(keys, sent, strict=True) if s.cycle < last_cycle][first:]
    return Samples(
        sent=len(wanted),
        missing=sum(logged[key] == 0 for key in wanted),
        repeated=sum(logged[key] > 1 for key in wanted),
        strange=sum(count for key, count in logged.items() if key not in known),
    )


def _spread(profile: Profile, first: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether no corner of a profile lies between the first and the last of four conversions."""
    last = first + 3 * ROUND_US * CYCLES_PER_US
    before = np.searchsorted(profile.cycles, first - 20 * CYCLES_PER_US)
    behind = np.searchsorted(profile.cycles, last + 20 * CYCLES_PER_US)
    inside = (first > profile.cycles[0]) & (last < profile.cycles[-1])
    clear: NDArray[np.bool_] = (before == behind) & inside
    return clear


def step_errors(
    counts: NDArray[np.float64], at: NDArray[np.float64], profile: Profile
) -> NDArray[np.float64]:
    """Errors in counts of the frames whose four conversions all came behind a step.

    Parameters
    ----------
    counts : NDArray[np.float64], shape (n,)
        Field of the log.
    at : NDArray[np.float64], shape (n,)
        Mean cycle of its four conversions, by the schema's delay.
    profile : Profile
        What was put in.
    """
    clear = _spread(profile, at - 1.5 * ROUND_US * CYCLES_PER_US)
    error: NDArray[np.float64] = counts[clear] + CODE_CENTRE - profile.counts(at[clear])
    return error


def ramp_errors_us(
    counts: NDArray[np.float64], at: NDArray[np.float64], profile: Profile
) -> NDArray[np.float64]:
    """Error in time of every frame on a slope; arguments as in :func:`step_errors`."""
    clear = _spread(profile, at - 1.5 * ROUND_US * CYCLES_PER_US)
    t = at[clear]
    slope = profile.counts(t + 0.5) - profile.counts(t - 0.5)  # counts per cycle
    error: NDArray[np.float64] = (
        (counts[clear] + CODE_CENTRE - profile.counts(t)) / slope / CYCLES_PER_US
    )
    return error


def percentiles(values: Iterable[float] | NDArray[np.float64]) -> tuple[float, float, float]:
    """Median, 99th percentile and largest of the magnitudes; infinite without any."""
    magnitude = np.abs(np.asarray(list(values), np.float64))
    if len(magnitude) == 0:
        return np.inf, np.inf, np.inf
    p50, p99 = np.percentile(magnitude, (50, 99))
    return float(p50), float(p99), float(magnitude.max())
