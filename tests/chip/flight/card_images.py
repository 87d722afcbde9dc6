"""Fly the image with cards drawn at random, altered from good ones, on the simulated chip.

    make card-images CHIP_IMAGES="--count 200"

Simulation only. The Mega drives meanwhile: servos, relay and heartbeat are judged too. The same
seeds give the same cards as in tests/sitl/card_images.py.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from functools import partial
from pathlib import Path

from flight.card_flight import fly_beside
from flight.images import build_image
from simavr_bench import in_fork
from simavr_bench.heartbeat import LEAST_GATE_VOLT

from tests.cards.drawn import draw
from tests.cards.tally import Result, Tally


def main() -> int:
    """Print what is wrong with which card, and the shares; 0 if nothing is, else 6."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--count", type=int, default=200, help="cards (default 200)")
    parser.add_argument("--seed", type=int, default=1, help="of the first card (default 1)")
    parser.add_argument("--elf", type=Path, help="image to fly; else it is built")
    options = parser.parse_args()
    tally, rest_s, gate_volt = Tally(), 0.0, float("inf")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        elf = Path(shutil.copy(options.elf or build_image("mega2560"), folder / "firmware.elf"))
        for seed in range(options.seed, options.seed + options.count):
            drawn = draw(seed)
            seen = in_fork(partial(fly_beside, elf, drawn.card, folder))
            drawn.card.close()
            tally.show(Result(seed, seen.judgement, drawn.altered))
            rest_s = max(rest_s, seen.beats.rest_s)
            gate_volt = min(gate_volt, seen.beats.gate_volt)
    print(tally.table())
    print(f"longest rest of the heartbeat {1e3 * rest_s:.2f} ms, limit 4 ms")
    print(f"lowest gate voltage {gate_volt:.2f} V, limit {LEAST_GATE_VOLT} V")
    print(f"{options.count} cards, seeds from {options.seed}: {len(tally.wrong)} are wrong")
    return 0 if tally.passed() else 6


if __name__ == "__main__":
    sys.exit(main())
