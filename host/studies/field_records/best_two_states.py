"""Moments of the two-state model that answers the test inputs best, beside the truth of the table.

    python -m studies.field_records.best_two_states --rows FILE

Downwash that comes late is a third state of the pitching motion. The truth has its effect at the
natural frequency (`true_derivatives`). A model of two states that is fitted to the answer to the
elevator's test inputs, without noise and errors, ends elsewhere: late air is what angle of attack,
pitch rate and elevator explain of it over the spectrum of these inputs.
"""

from __future__ import annotations

import argparse
import csv
import functools
from collections.abc import Sequence

import numpy as np
from host.arrays import Array

from studies.field_records.ranges import draw
from studies.field_records.record_flight import drawn_aircraft
from studies.field_records.true_derivatives import NAMES, WIDTH, forces, true_derivatives
from studies.field_records.worn_aeroplane import Worn
from studies.foreign.flight import INPUTS, SPEED_MPS
from studies.judgement.field_flights import DRAW
from studies.stored_rows import rows_file

RADPS = 2.0 * np.pi * np.arange(0.05, 8.0, 0.05)
COLUMNS = ("alpha", "q", "de")
MOMENTS = ("M_alpha", "M_q", "M_de")
WORLD = "real records, no file"


def best_moments(a: Worn) -> dict[str, float]:
    """Return moments per angle of attack, pitch rate and elevator at the trim, in 1/s2 and 1/s."""
    point = np.array([SPEED_MPS, a.trim_alpha, 0.0, 0.0, 0.0, 0.0, a.trim_de, 0.0, 0.0])
    shifts = {name: WIDTH * (np.array(NAMES) == name) for name in COLUMNS}
    slopes = {n: _slope(a, (point + s, point - s)) for n, s in shifts.items()}
    late = _slope(a, (point, point), (np.array([WIDTH, 0.0]), np.array([-WIDTH, 0.0])))
    A = np.zeros((3, 3))
    A[:2] = np.column_stack([slopes["alpha"], slopes["q"] + [1.0, 0.0], late])
    A[2] = -a.downwash * A[0]
    A[2, 2] -= SPEED_MPS / (a.wash_lag * a.tail_arm)
    B = np.append(slopes["de"], -a.downwash * slopes["de"][0])
    states = np.array([np.linalg.solve(1j * w * np.eye(3) - A, B) for w in RADPS])
    weight = _elevator_spectrum()[:, None]
    seen = np.column_stack([states[:, :2], np.ones(len(RADPS))]) * weight
    air = states[:, 2] * weight[:, 0]
    share = np.linalg.lstsq(
        np.vstack([seen.real, seen.imag]), np.concatenate([air.real, air.imag]), rcond=None
    )[0]
    return {
        name: float(slopes[column][1] + late[1] * part)
        for name, column, part in zip(MOMENTS, COLUMNS, share, strict=True)
    }


def _slope(a: Worn, points: Sequence[Array], late: Sequence[Array] = ()) -> Array:
    """Return the slopes of lift and pitching acceleration between two points, or two late airs."""
    airs = late or (None, None)
    up, down = (forces(a, p, SPEED_MPS, air) for p, air in zip(points, airs, strict=True))
    return np.array([(up[row] - down[row]) / (2.0 * WIDTH) for row in "ZM"])


def _elevator_spectrum() -> Array:
    """Return the root of the power of all elevator inputs at `RADPS`."""
    power = np.zeros(len(RADPS))
    for surface, _, unit_s, degrees, signs in INPUTS:
        if surface == 0:
            steps = sum(
                sign * np.exp(-1j * RADPS * (k + 0.5) * unit_s) for k, sign in enumerate(signs)
            )
            power += np.abs(degrees * unit_s * np.sinc(RADPS * unit_s / (2.0 * np.pi)) * steps) ** 2
    return np.sqrt(power)


@functools.lru_cache(maxsize=1)
def _best_over_true(seed: int) -> dict[str, float]:
    """Return the best moments of the aircraft of a flight over the truth of the table."""
    rng = np.random.default_rng([DRAW, seed])
    a = drawn_aircraft(rng, draw(rng))
    true = true_derivatives(a, SPEED_MPS, a.trim_alpha, a.trim_de)
    return {name: best / true[name] for name, best in best_moments(a).items()}


def main() -> None:
    """Print, over the flights of a file of rows, what holds by either truth."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=rows_file, required=True, help="of studies.judgement")
    path = parser.parse_args().rows
    if not path.is_file():
        parser.error(f"{path} is no file; `python -m studies.judgement --rows {path}` writes it")
    with path.open(encoding="utf-8", newline="") as file:
        rows = [r for r in csv.DictReader(file) if r["world"] == WORLD and r["name"] in MOMENTS]
    if not rows:
        parser.error(f"{path} has no flight of the world {WORLD!r}")
    ratio: dict[str, list[float]] = {name: [] for name in MOMENTS}
    held = {name: np.zeros(3, dtype=int) for name in MOMENTS}
    for row in rows:
        name = row["name"]
        part = _best_over_true(int(row["seed"]))[name]
        ratio[name].append(part)
        if row["half_width"]:
            true, value, half = (float(row[k]) for k in ("true", "estimate", "half_width"))
            held[name] += (1, abs(value - true) <= half, abs(value - part * true) <= half)
    for name in MOMENTS:
        low, middle, high = np.quantile(ratio[name], (0.05, 0.5, 0.95))
        count, table, best = held[name]
        print(
            f"{name}: best over true {middle:.2f} ({low:.2f} to {high:.2f});"
            f" of {count} intervals {table} hold the table's truth, {best} the best model's"
        )


if __name__ == "__main__":
    main()
