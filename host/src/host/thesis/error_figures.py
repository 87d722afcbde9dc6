"""The error figures of the thesis: that of its text, and that of its program."""

from __future__ import annotations

import numpy as np

from host.arrays import Array


def thesis_sum_of_mean_errors(measured: Array, simulated: Array) -> float:
    """Return the thesis's equation 5.3: sum over states of mean |error|, units mixed."""
    return float(np.sum(np.mean(np.abs(measured - simulated), axis=0)))


def thesis_program_error_percent(measured: Array, simulated: Array) -> float:
    """Return the figure that the thesis's program prints, in percent.

    It is the relative L1 error divided once more by the number of samples. Times that number it is
    the sum over states of the relative errors.
    """
    shares = np.sum(np.abs(measured - simulated), axis=0) / np.sum(np.abs(measured), axis=0)
    return float(np.sum(shares) * 100.0 / len(measured))
