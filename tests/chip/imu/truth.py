"""The decoded log against what the sensor's model made: which sample, when, how often."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from simavr_bench.imu_sensors import Samples

AGE_STEP_US = 4.0


@dataclass(frozen=True, slots=True)
class Match:
    """What became of the samples between the first and the last in the log.

    Attributes
    ----------
    made : int
        Samples of the sensor in that time.
    once : int
        Those of them that are in the log exactly once.
    foreign : int
        Rows of the log whose values are not those of the sample made at their instant.
    error_us : NDArray, shape (n,)
        Logged instant of the sample, time stamp less age, minus data-ready.
    """

    made: int
    once: int
    foreign: int
    error_us: NDArray[np.float64]


def match(
    ident: NDArray[np.void], samples: Samples, samples_us: NDArray[np.float64], *, doubled: bool
) -> Match:
    """Compare identification frames with the sensor's samples.

    Parameters
    ----------
    ident : NDArray, shape (n,)
        Frames `ident`, raw, with a fresh sample each.
    samples, samples_us : NDArray, shape (m,)
        What the sensor made, and when in microseconds of the Mega's clock.
    doubled : bool
        Revision C: the firmware sends twice the counts of force.
    """
    t_us = np.unwrap(ident["t_us"].astype(np.float64), period=2.0**32)
    at_us = t_us - AGE_STEP_US * ident["imu_age"].astype(np.float64)
    after = np.clip(np.searchsorted(samples_us, at_us), 1, len(samples_us) - 1)
    nearer = at_us - samples_us[after - 1] < samples_us[after] - at_us
    index = np.where(nearer, after - 1, after)
    found = samples[index]
    turn = np.array([1, -1, -1])
    rates = np.column_stack([ident[name] for name in ("p", "q", "r")]).astype(np.int64)
    force = np.column_stack([ident[name] for name in ("ax", "ay", "az")]).astype(np.int64)
    # +32768 has no 16 bits: the firmware sends 32767.
    limit = 32767
    true_rates = np.clip(found["rates"].astype(np.int64) * turn, -limit, limit)
    true_force = np.clip(found["force"] * turn * (2 if doubled else 1), -limit, limit)
    same = np.all(rates == true_rates, axis=1) & np.all(force == true_force, axis=1)
    counts = np.bincount(index)[index.min() :]
    return Match(
        made=len(counts),
        once=int(np.sum(counts == 1)),
        foreign=int(np.sum(~same)),
        error_us=np.asarray(at_us - samples_us[index], np.float64),
    )
