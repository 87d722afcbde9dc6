"""Mass and inertia of an aircraft from a scale and a bifilar pendulum, as lines of its file.

    python hw/calibration/pendulum.py --mass 1.793 0.005 --yy 0.62 1.20 1.79 1.80 1.78 \\
        --source "two threads, J. Doe, 2026-11-21" > mass.toml

Each axis that was swung takes the distance between the threads (m), their length (m) and the
periods that a stopwatch gave (s), three or more, each the mean of ten swings or more. Threads hang
parallel and vertical, the aircraft turns about the vertical through its CG.

    I = m g d^2 T^2 / (16 pi^2 L)

for small angles (Jardin & Mueller, J. Aircraft 46 (2009) 763); at 10 deg the period is 0.2 % long.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
from collections.abc import Sequence
from dataclasses import dataclass

GRAVITY_MPS2 = 9.80665
LENGTH_SIGMA_M = 0.001  # a tape measure
LEAST_PERIODS = 3
# The air that swings with a light wing: the share of inertia found that may not be the aircraft's.
AIR_SHARE = 0.03
COVERS = 2.0  # a tolerance is two standard deviations


class SwingError(Exception):
    """A pendulum that cannot have swung so."""


@dataclass(frozen=True, slots=True)
class Swing:
    """A moment of inertia (kg m2) and its share of one standard deviation."""

    inertia_kgm2: float
    sigma_share: float


def inertia(mass_kg: float, mass_sigma_kg: float, numbers: Sequence[float]) -> Swing:
    """Return the inertia of one axis.

    Parameters
    ----------
    mass_kg, mass_sigma_kg : float
        What hangs, and one standard deviation of the scale.
    numbers : sequence of float
        Distance of the threads (m), their length (m), periods (s).

    Raises
    ------
    SwingError
        Fewer than three periods, a number that is not positive, or periods that scatter by 5 %.
    """
    distance_m, length_m, *periods_s = numbers if len(numbers) > 1 else (0.0, 0.0)
    if len(periods_s) < LEAST_PERIODS:
        raise SwingError(f"{len(periods_s)} periods found, expected a distance, a length and three")
    if min(mass_kg, *numbers) <= 0.0 or not all(map(math.isfinite, (mass_kg, *numbers))):
        raise SwingError("mass, distance, length and periods must be above zero")
    period_s = statistics.fmean(periods_s)
    scatter = statistics.stdev(periods_s) / period_s
    if scatter > 0.05:
        raise SwingError(
            f"periods scatter by {100 * scatter:.0f} %, expected 1 %: did it swing sideways?"
        )
    value = mass_kg * GRAVITY_MPS2 * (distance_m * period_s / (4.0 * math.pi)) ** 2 / length_m
    return Swing(
        value,
        math.hypot(
            mass_sigma_kg / mass_kg,
            2.0 * LENGTH_SIGMA_M / distance_m,
            LENGTH_SIGMA_M / length_m,
            2.0 * scatter / math.sqrt(len(periods_s)),
            AIR_SHARE,
        ),
    )


def as_toml(
    mass: tuple[float, float], swings: dict[str, Swing], *, cg_tolerance_m: float, source: str
) -> str:
    """Write the section [mass] of an aircraft file; the worst axis gives the tolerance."""
    quoted = source.replace("\\", "/").replace('"', "'")
    worst = max(swing.sigma_share for swing in swings.values())
    lines = ["[mass]", f"mass_kg = {mass[0]:.4g}"]
    lines += [f"i{axis}_kgm2 = {swing.inertia_kgm2:.5g}" for axis, swing in swings.items()]
    lines += [
        "ixz_kgm2 = 0.0",
        "cg_m = [0.0, 0.0, 0.0]",
        f"mass_tolerance = {COVERS * mass[1] / mass[0]:.4f}",
        f"inertia_tolerance = {COVERS * worst:.3f}",
        f"cg_tolerance_m = {cg_tolerance_m}",
        f'source = "{quoted}"',
        "[mass.sources]",
        'ixz_kgm2 = "not measured: zero"',
        'cg_m = "places are counted from the CG"',
    ]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Print the section; 0 ok, 2 the numbers cannot be used."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--mass", type=float, nargs=2, required=True, metavar=("KG", "SIGMA"), help="from a scale"
    )
    for axis, name in (("xx", "roll"), ("yy", "pitch"), ("zz", "yaw")):
        parser.add_argument(
            f"--{axis}", type=float, nargs="+", required=True, metavar="NUMBER",
            help=f"{name}: distance of the threads, m; their length, m; three periods or more, s",
        )  # fmt: skip
    parser.add_argument("--cg-tolerance", type=float, default=0.010, metavar="M")
    parser.add_argument("--source", required=True, help="how, who, when")
    args = parser.parse_args(arguments)
    swings = {}
    for axis in ("xx", "yy", "zz"):
        try:
            swings[axis] = inertia(args.mass[0], args.mass[1], getattr(args, axis))
        except SwingError as error:
            print(f"pendulum: --{axis}: {error}", file=sys.stderr)
            return 2
    found = [swing.inertia_kgm2 for swing in swings.values()]
    if max(found) > sum(found) - max(found):
        print(
            "pendulum: one inertia exceeds the sum of the other two, which no body has: was an axis"
            " swapped, or a thread's distance?",
            file=sys.stderr,
        )
        return 2
    mass = (args.mass[0], args.mass[1])
    print(as_toml(mass, swings, cg_tolerance_m=args.cg_tolerance, source=args.source), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
