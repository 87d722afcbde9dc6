"""Fit one channel's line and print its table for a calibration file.

    python hw/calibration/fit_line.py channel.alpha_a points.csv --unit rad --in deg \\
        --reference 0.2 --source "protractor jig 2, vane serial 7, 2026-11-21"

points.csv has a head `true,raw`, one row per setting, in the order in which they were set: up the
range and down again. `true` is what the jig says, `raw` the mean of the channel there, in the
unit of protocol/frames.toml (count, us).
"""

from __future__ import annotations

import argparse
import csv
import math
import os
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
FACTORS = {"deg": math.pi / 180.0}
LEAST_POINTS = 5
DEFAULT = Path(__file__).with_name("default.toml")


class PointsError(Exception):
    """Points that no line can be drawn through."""


@dataclass(frozen=True, slots=True)
class Fit:
    """value = (raw - zero) * slope, with one standard deviation of each.

    Parameters
    ----------
    zero, slope : float
        Raw unit; unit of the value per raw unit.
    zero_sigma : float
        Raw unit: of the fit, of the hysteresis, of the reference, together.
    slope_sigma : float
        Share of the slope.
    residual : float
        Root mean square of the points' distance from the line, in raw units.
    hysteresis : float
        Largest difference between up and down at the same setting, in raw units.
    """

    zero: float
    slope: float
    zero_sigma: float
    slope_sigma: float
    residual: float
    hysteresis: float


def fit_line(true: Points, raw: Points, *, reference: float) -> Fit:
    """Fit raw over true, as the settings are known better than the readings.

    Parameters
    ----------
    true : (n,) array
        Settings, in the unit of the value.
    raw : (n,) array
        Readings, in the raw unit.
    reference : float
        One standard deviation of a setting, common to all of them (a jig that is turned), in the
        unit of the value.

    Raises
    ------
    PointsError
        Fewer than five points, all alike, not finite, or no slope beyond its own scatter.
    """
    if true.size < LEAST_POINTS or np.unique(true).size < 3:
        raise PointsError(f"{true.size} points found, expected 5 or more at 3 or more settings")
    if not (np.isfinite(true).all() and np.isfinite(raw).all()):
        raise PointsError("a number is missing")
    design = np.column_stack([np.ones_like(true), true])
    inverse = np.linalg.inv(design.T @ design)
    zero, gradient = inverse @ (design.T @ raw)
    distance = raw - design @ np.array([zero, gradient])
    variance = float(distance @ distance) / (true.size - 2)
    zero_fit, gradient_sigma = np.sqrt(variance * np.diag(inverse))
    if abs(gradient) <= 4.0 * gradient_sigma or gradient == 0.0:
        raise PointsError("raw does not follow true: wrong channel, or a slipping shaft?")
    hysteresis = max(float(np.ptp(raw[true == one])) for one in np.unique(true))
    span = float(np.ptp(true))
    # Anywhere within the hysteresis band is equally likely: half width over root 3.
    zero_sigma = math.hypot(zero_fit, hysteresis / 2.0 / math.sqrt(3.0), reference * abs(gradient))
    return Fit(
        zero=float(zero),
        slope=float(1.0 / gradient),
        zero_sigma=zero_sigma,
        slope_sigma=math.hypot(gradient_sigma / abs(gradient), reference * math.sqrt(2.0) / span),
        residual=math.sqrt(float(np.mean(distance**2))),
        hysteresis=hysteresis,
    )


def read_points(path: Path) -> tuple[Points, Points]:
    """Read the columns `true` and `raw`.

    Raises
    ------
    PointsError
        A column or a number is missing.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        columns = [np.array([float(row[name]) for row in rows]) for name in ("true", "raw")]
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        raise PointsError(f"{path}: expected numbers in columns true and raw ({error})") from error
    return columns[0], columns[1]


def as_toml(name: str, unit: str, fit: Fit, source: str) -> str:
    """Write the table of a calibration file."""
    quoted = source.replace("\\", "/").replace('"', "'")
    return (
        f'[{name}]\nunit = "{unit}"\nzero = {fit.zero:.3f}\nslope = {fit.slope:.9e}\n'
        f"zero_sigma = {fit.zero_sigma:.3f}\nslope_sigma = {fit.slope_sigma:.5f}\n"
        f'source = "{quoted}; residual {fit.residual:.2f}, hysteresis {fit.hysteresis:.2f}"\n'
        "default = false\n"
    )


def lines_known() -> list[str]:
    """Return the names of all lines that the default calibration has."""
    tables = tomllib.loads(DEFAULT.read_text(encoding="utf-8"))
    rooms = {name: table for name, table in tables.items() if isinstance(table, dict)}
    return [f"{room}.{name}" for room, table in rooms.items() for name in table]


def _spread(text: str) -> float:
    value = float(text)
    if not (math.isfinite(value) and value >= 0.0):
        raise ValueError(text)
    return value


def main(arguments: list[str] | None = None) -> int:
    """Print the table; 0 ok, 2 the points cannot be used."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "name", choices=lines_known(), metavar="NAME", help="channel.alpha_a, pulse.elevator, ..."
    )
    parser.add_argument("points", type=Path, help="CSV with columns true and raw")
    parser.add_argument("--unit", default="rad", help="unit of the value (default rad)")
    parser.add_argument(
        "--in", dest="given", choices=sorted(FACTORS), help="deg, if true is in degrees"
    )
    parser.add_argument(
        "--reference", type=_spread, required=True, help="standard deviation of a setting, as true"
    )
    parser.add_argument("--source", required=True, help="how, with what, serial, who, when")
    args = parser.parse_args(arguments)
    factor = FACTORS.get(args.given, 1.0)
    try:
        true, raw = read_points(args.points)
        fit = fit_line(true * factor, raw, reference=args.reference * factor)
    except (PointsError, OSError) as error:
        print(f"fit_line: {error}", file=sys.stderr)
        return 2
    try:
        print(as_toml(args.name, args.unit, fit, args.source), end="", flush=True)
    except OSError as error:
        # What it still holds could not be flushed at the end either.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        print(f"fit_line: standard output: {error.strerror}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
