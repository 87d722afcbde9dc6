"""The magnetometer's hard iron: the centre of its readings in all attitudes.

The readings are fitted by an ellipsoid along the sensor's axes. The IMU stores the three counts
itself (`imu iron`); a calibration file does not have them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from host.bench_calibration.bench_plan import Subject
from host.errors import UsageError

Array = NDArray[np.float64]
_LEAST = 30  # readings
_COVERS = 0.5  # share of the radius that readings must reach on both sides of each axis


@dataclass(frozen=True, slots=True)
class HardIron:
    """Centre, radius and residual of the magnetometer's readings, counts.

    Attributes
    ----------
    centre, centre_sigma, radius : (3,) array
    residual : float
        rms distance from the ellipsoid.
    doubt : str or None
    """

    centre: Array
    centre_sigma: Array
    radius: Array
    residual: float
    doubt: str | None


def hard_iron(subject: Subject, field: Array) -> HardIron:
    """Return the hard iron of readings (n, 3), in counts.

    Raises
    ------
    UsageError
        If there are too few, or they lie in too few attitudes.
    """
    if len(field) < _LEAST:
        raise UsageError(f"magnetometer: {len(field)} readings, expected {_LEAST} or more")
    scale = float(np.abs(field).max()) or 1.0
    x = field / scale
    # |(x - c) / r|^2 = 1, of which the first axis's curvature is the unit.
    design = np.column_stack([x, -(x[:, 1] ** 2), -(x[:, 2] ** 2), np.ones(len(x))])
    right = x[:, 0] ** 2
    answer, *_ = np.linalg.lstsq(design, right, rcond=None)
    weights = np.array([1.0, answer[3], answer[4]])
    if (weights <= 0.0).any():
        raise UsageError(_ATTITUDES)
    centre = answer[:3] / (2.0 * weights)
    size = answer[5] + float(weights @ centre**2)
    if size <= 0.0:
        raise UsageError(_ATTITUDES)
    radius = np.sqrt(size / weights)
    about = (x - centre) / radius
    if (about.max(axis=0) < _COVERS).any() or (about.min(axis=0) > -_COVERS).any():
        raise UsageError(_ATTITUDES)
    left = right - design @ answer
    inverse = np.linalg.inv(design.T @ design)
    sigma = np.sqrt(float(left @ left) / (len(x) - 6) * np.diag(inverse)[:3]) / (2.0 * weights)
    residual = float(np.sqrt(np.mean((np.linalg.norm(about, axis=1) - 1.0) ** 2)) * radius.mean())
    return HardIron(
        centre * scale,
        sigma * scale,
        radius * scale,
        residual * scale,
        _doubt(subject, centre * scale, radius * scale),
    )


_ATTITUDES = (
    "magnetometer: not every attitude is there; turn it slowly so that each axis points up, down"
    " and all around, for 2 min"
)


def _doubt(subject: Subject, centre: Array, radius: Array) -> str | None:
    spread = float(np.ptp(radius) / radius.mean())
    if float(np.abs(centre).max()) > subject.limits["iron"]:
        return (
            f"hard iron of {np.abs(centre).max():.0f} counts, limit {subject.limits['iron']:g}:"
            " move the IMU from motor, servo and steel"
        )
    if spread > subject.limits["axes"]:
        return (
            f"soft iron: the axes' radii differ by {100.0 * spread:.0f} %, limit"
            f" {100.0 * subject.limits['axes']:.0f}; nothing here corrects it"
        )
    return None


def rounded(centre: Array) -> tuple[int, int, int]:
    """Return the three counts for the IMU's console."""
    x, y, z = (math.floor(c + 0.5) for c in centre)
    return x, y, z
