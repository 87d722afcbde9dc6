"""Mass and inertia of an aircraft from a scale and a bifilar pendulum, as lines of its file.

Threads hang parallel and vertical, the aircraft turns about the vertical through its CG.

    I = m g d^2 T^2 / (16 pi^2 L)

for small angles (Jardin & Mueller, J. Aircraft 46 (2009) 763); at 10 deg the period is 0.2 % long.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from host.bench_calibration.bench_plan import Subject
from host.bench_calibration.reading_table import number_of, rows_of
from host.constants import GRAVITY_MPS2
from host.errors import UsageError
from host.export.toml import dumps
from host.files.user_text import shown

LEAST_PERIODS = 3
COVERS = 2.0  # a tolerance is two standard deviations
AXES = ("xx", "yy", "zz")


@dataclass(frozen=True, slots=True)
class Swing:
    """A moment of inertia (kg m2) and its share of one standard deviation."""

    inertia_kgm2: float
    sigma_share: float


def inertia(
    subject: Subject, mass_kg: float, mass_sigma_kg: float, numbers: Sequence[float]
) -> Swing:
    """Return the inertia of one axis.

    Parameters
    ----------
    subject : Subject
        Its limits are the errors by tape measure and entrained air.
    mass_kg, mass_sigma_kg : float
        What hangs, and one standard deviation of the scale.
    numbers : sequence of float
        Distance of the threads (m), their length (m), periods (s).

    Raises
    ------
    UsageError
        Fewer than three periods, a number that is not positive, or periods that scatter.
    """
    distance_m, length_m, *periods_s = numbers if len(numbers) > 1 else (0.0, 0.0)
    if len(periods_s) < LEAST_PERIODS:
        raise UsageError(f"{len(periods_s)} periods found, expected a distance, a length and three")
    if min(mass_kg, *numbers) <= 0.0 or not all(map(math.isfinite, (mass_kg, *numbers))):
        raise UsageError("mass, distance, length and periods must be above zero")
    period_s = statistics.fmean(periods_s)
    tape = subject.limits["tape_m"]
    scatter = statistics.stdev(periods_s) / period_s
    if scatter > subject.limits["scatter"]:
        raise UsageError(
            f"periods scatter by {100 * scatter:.0f} %, expected 1 %: did it swing sideways?"
        )
    value = mass_kg * GRAVITY_MPS2 * (distance_m * period_s / (4.0 * math.pi)) ** 2 / length_m
    return Swing(
        value,
        math.hypot(
            mass_sigma_kg / mass_kg,
            2.0 * tape / distance_m,
            tape / length_m,
            2.0 * scatter / math.sqrt(len(periods_s)),
            subject.limits["air"],
        ),
    )


def mass_section(
    subject: Subject,
    mass: tuple[float, float],
    swings: Mapping[str, Swing],
    *,
    cg_tolerance_m: float,
    source: str,
) -> str:
    """Return the section [mass] of an aircraft file; the worst axis gives the tolerance.

    Raises
    ------
    UsageError
        If an axis was not swung, or no body has such inertias.
    """
    missing = [axis for axis in AXES if axis not in swings]
    if missing:
        raise UsageError(f"{subject.name}: no swings about axis {missing[0]}; all three are needed")
    found = [swings[axis].inertia_kgm2 for axis in AXES]
    if max(found) > sum(found) - max(found):
        raise UsageError(
            "one inertia exceeds the sum of the other two, which no body has: was an axis swapped,"
            " or a thread's distance?"
        )
    worst = max(swing.sigma_share for swing in swings.values())
    section = {
        "mass_kg": float(f"{mass[0]:.4g}"),
        **{f"i{axis}_kgm2": float(f"{i:.5g}") for axis, i in zip(AXES, found, strict=True)},
        "ixz_kgm2": 0.0,
        "cg_m": [0.0, 0.0, 0.0],
        "mass_tolerance": round(COVERS * mass[1] / mass[0], 4),
        "inertia_tolerance": round(COVERS * worst, 3),
        "cg_tolerance_m": cg_tolerance_m,
        "source": source,
        "sources": {
            "ixz_kgm2": "not measured: zero",
            "cg_m": "places are counted from the CG",
        },
    }
    return dumps({"mass": section})


def read_swings(
    path: Path, subject: Subject, mass_kg: float, mass_sigma_kg: float
) -> dict[str, Swing]:
    """Return the inertia of each axis of a table: axis, distance_m, length_m, period_s.

    Raises
    ------
    UsageError
        If a row or an axis cannot be used.
    """
    numbers: dict[str, list[float]] = {}
    columns = ("distance_m", "length_m", "period_s")
    for index, row in enumerate(rows_of(path, ("axis", *columns)), start=2):
        axis = (row["axis"] or "").strip().lower()
        if axis not in AXES:
            raise UsageError(f"{path}: row {index} axis is {shown(axis)}, expected xx, yy or zz")
        distance, length, period = (number_of(path, row, c, index) for c in columns)
        if math.isnan(period):
            continue
        numbers.setdefault(axis, [distance, length])
        if numbers[axis][:2] != [distance, length]:
            raise UsageError(f"{path}: row {index}: axis {axis} hangs on other threads than before")
        numbers[axis].append(period)
    found = {}
    for axis, one in numbers.items():
        try:
            found[axis] = inertia(subject, mass_kg, mass_sigma_kg, one)
        except UsageError as error:
            raise UsageError(f"{path}: axis {axis}: {error}") from None
    return found
