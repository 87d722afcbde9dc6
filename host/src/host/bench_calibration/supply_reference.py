"""The chip's voltage reference, from pairs of voltmeter and status line."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.bench_calibration.bench_plan import Subject, meter_share
from host.errors import UsageError

NOMINAL_MV = 1100.0  # reference that the status line assumes until one is stored


@dataclass(frozen=True, slots=True)
class SupplyReference:
    """The reference of one chip and its deviation (mV), with the mean voltages behind it (V)."""

    reference_mv: float
    sigma_mv: float
    meter_v: float
    shown_v: float
    doubt: str | None


def supply_reference(
    subject: Subject, shown_v: Sequence[float], meter_v: Sequence[float], was_mv: float = NOMINAL_MV
) -> SupplyReference:
    """Return the reference that makes the status line agree with the meter.

    Raises
    ------
    UsageError
        If a voltage is missing or none.
    """
    shown, meter = np.array(shown_v, dtype=float), np.array(meter_v, dtype=float)
    if not len(shown) or not (np.isfinite(shown + meter).all() and (shown > 0).all()):
        raise UsageError("supply: needs pairs of shown_v and meter_v, in V, above 0")
    ratio = meter / shown
    reference = was_mv * float(ratio.mean())
    scatter = float(ratio.std(ddof=1) / math.sqrt(len(ratio))) if len(ratio) > 1 else 0.0
    sigma = math.hypot(was_mv * scatter, reference * meter_share())
    least, most = subject.limits["reference"]
    apart = float(np.ptp(meter - shown))
    doubt = None
    if not least <= reference * 1e-3 <= most:
        doubt = (
            f"a reference of {reference:.0f} mV, expected {1e3 * least:.0f} to {1e3 * most:.0f}:"
            " measure again, at the board's 5V pin"
        )
    elif apart > subject.limits["agree"]:
        doubt = (
            f"the pairs disagree by {1e3 * apart:.0f} mV, limit"
            f" {1e3 * subject.limits['agree']:.0f}: the supply is not quiet, read both at once"
        )
    return SupplyReference(reference, sigma, float(meter.mean()), float(shown.mean()), doubt)
