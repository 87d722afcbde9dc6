"""What the instrument does to mass, CG and inertia of the aircraft that carries it.

python hw/weight_and_balance.py hw/installation.csv --mass 2.605 --inertia 0.129 0.197 0.258

The file has one line a thing: what, mass_g, x_m, y_m, z_m; places from the CG before installation,
x forward, y right, z down. Each thing is a point. `--inertia` is the aircraft's before, in kg m2.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
from dataclasses import dataclass
from pathlib import Path


class BalanceError(Exception):
    """A file that lists no things."""


@dataclass(frozen=True, slots=True)
class Balance:
    """Mass in kg, CG in m from where it was, inertia about the new CG in kg m2."""

    mass_kg: float
    cg_m: tuple[float, float, float]
    inertia_kgm2: tuple[float, float, float]


def read(text: str) -> list[tuple[str, float, tuple[float, float, float]]]:
    """Read the things.

    Raises
    ------
    BalanceError
        A column is missing, a number is none or not finite, a mass is negative, nothing is listed.
    """
    found = []
    for number, row in enumerate(csv.DictReader(text.splitlines()), start=2):
        try:
            mass, x, y, z = (float(row[name]) for name in ("mass_g", "x_m", "y_m", "z_m"))
        except (KeyError, TypeError, ValueError):
            raise BalanceError(f"line {number}: expected what,mass_g,x_m,y_m,z_m") from None
        if not all(map(math.isfinite, (mass, x, y, z))) or mass < 0.0:
            raise BalanceError(f"line {number}: found mass {mass:g} g at {x:g}, {y:g}, {z:g} m")
        found.append((row["what"], mass * 1e-3, (x, y, z)))
    if not found:
        raise BalanceError("found no line below the heading")
    return found


def balance(
    mass_kg: float,
    inertia_kgm2: tuple[float, float, float],
    things: list[tuple[str, float, tuple[float, float, float]]],
) -> Balance:
    """Add things to an aircraft whose CG is the origin (parallel axes, points)."""
    bodies = [(mass_kg, (0.0, 0.0, 0.0)), *((mass, place) for _, mass, place in things)]
    total = sum(mass for mass, _ in bodies)
    x, y, z = (sum(mass * place[k] for mass, place in bodies) / total for k in range(3))
    ixx, iyy, izz = inertia_kgm2
    for mass, (px, py, pz) in bodies:
        dx, dy, dz = px - x, py - y, pz - z
        ixx += mass * (dy * dy + dz * dz)
        iyy += mass * (dx * dx + dz * dz)
        izz += mass * (dx * dx + dy * dy)
    return Balance(total, (x, y, z), (ixx, iyy, izz))


def main(arguments: list[str] | None = None) -> int:
    """Print the aircraft before and after; 0 ok, 2 the file or a number is wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("file", type=Path, help="what,mass_g,x_m,y_m,z_m")
    parser.add_argument("--mass", type=float, required=True, help="of the aircraft before, kg")
    parser.add_argument("--inertia", type=float, nargs=3, required=True, metavar=("XX", "YY", "ZZ"))
    args = parser.parse_args(arguments)
    try:
        if not (math.isfinite(args.mass) and args.mass > 0.0):
            raise BalanceError(f"--mass is {args.mass:g}, expected more than 0 kg")
        things = read(args.file.read_text(encoding="utf-8"))
    except (BalanceError, OSError, UnicodeDecodeError) as error:
        print(f"{args.file}: {error}", file=sys.stderr)
        return 2
    after = balance(args.mass, tuple(args.inertia), things)
    print(f"mass {args.mass:.3f} -> {after.mass_kg:.3f} kg")
    moved = ", ".join(
        f"{1e3 * way:+.1f} mm {word}"
        for way, word in zip(after.cg_m, ("forward", "right", "down"), strict=True)
    )
    print(f"CG moves {moved}")
    for axis, was, now in zip(("xx", "yy", "zz"), args.inertia, after.inertia_kgm2, strict=True):
        print(f"I{axis} {was:.4f} -> {now:.4f} kg m2 ({100 * (now / was - 1):+.0f} %)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
