"""Print the attitude errors of the firmware's filter against those of the original algorithm.

    .venv/bin/python tests/attitude/table.py            three cards, two seeds each
    .venv/bin/python tests/attitude/table.py --seeds 8

Virtual flights, never a real one. Both see the same motion, biases, misalignment
and speed; the original samples at 50 Hz behind its 20 Hz low-pass.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.attitude import flights

CARDS = ("turns", "inputs", "thermals")
AXES = ("phi", "theta", "psi")


def rows(seeds: int) -> list[str]:
    """Return the lines of the table; rms over seeds, largest of all seeds, degrees."""
    head = f"{'card':<10}{'speed':<10}" + "".join(
        f"{f'{axis} rms':>11}{'original':>10}{'max':>8}{'original':>10}" for axis in AXES
    )
    lines = [head]
    for card in CARDS:
        flown = [flights.fly_card(card, seed) for seed in range(1, seeds + 1)]
        for source in flights.SPEEDS:
            pairs = [flights.judge(flight, source) for flight in flown]
            cells = ""
            for axis in range(3):
                for pick in (flights.rms_of, flights.most_of):
                    width = (11, 10) if pick is flights.rms_of else (8, 10)
                    for which in range(2):
                        value = pick([pair[which] for pair in pairs])[axis]
                        cells += f"{value:>{width[which]}.2f}"
            lines.append(f"{card:<10}{source:<10}{cells}")
    return lines


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Attitude errors on virtual flights, in degrees.")
    parser.add_argument("--seeds", type=int, default=2, help="flights per card")
    asked = parser.parse_args()
    if asked.seeds < 1:
        print(f"--seeds is {asked.seeds}, expected at least 1", file=sys.stderr)
        return 2
    print("\n".join(rows(asked.seeds)))
    floor_deg = float(np.rad2deg(0.25 / 9.81))
    print(f"simulated; an accelerometer bias of 0.25 m/s2 alone tilts the vertical {floor_deg:.1f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
