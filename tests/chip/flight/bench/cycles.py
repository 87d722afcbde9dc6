"""Print which functions take the cycles while a row of three axes teaches one.

``python -m flight.bench.cycles``: share of the chip by function as the linker left it; what was
inlined counts where it stands.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from bisect import bisect_right
from collections import Counter
from pathlib import Path

from compilers import TESTED
from flight.bench.inputs import FRAMES_S, input_rig
from flight.images import build_image

from tests.sitl.input_flight import TRIGGER_S

SECONDS = 3.0
LEAST_SHARE = 0.002


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="flight.bench.cycles", description=__doc__)
    parser.add_argument("--rate", type=int, choices=(100, 200), default=100)
    parser.add_argument("--gcc", choices=TESTED, default=TESTED[0])
    asked = parser.parse_args()
    elf = build_image("mega2560", asked.gcc)
    with tempfile.TemporaryDirectory() as folder:
        rig = input_rig(
            elf, rate_hz=asked.rate, frame_s=FRAMES_S[0], duration_s=8.0, folder=Path(folder)
        )
        rig.run_to(TRIGGER_S + 1.2)
        rig.chip.count_cycles()
        begin = rig.chip.cycle
        rig.run_to(TRIGGER_S + 1.2 + SECONDS)
        whole = rig.chip.cycle - begin
        spent = rig.chip.cycles_spent()
        rig.chip.close()
    functions = _functions(elf)
    starts = [start for start, _ in functions]
    cycles: Counter[str] = Counter()
    for word in spent.nonzero()[0].tolist():
        name = functions[bisect_right(starts, 2 * word) - 1][1]
        cycles[name] += int(spent[word])
    print(f"{100 * cycles.total() / whole:5.2f} %  all but sleep")
    for name, count in cycles.most_common():
        if count >= LEAST_SHARE * whole:
            print(f"{100 * count / whole:5.2f} %  {name}")
    return 0


def _functions(elf: Path) -> list[tuple[int, str]]:
    """Return address and name of every function, by address."""
    listed = subprocess.run(
        ["avr-nm", "-C", str(elf)], capture_output=True, text=True, check=True
    ).stdout
    found = []
    for line in listed.splitlines():
        address, kind, name = line[:8], line[9:10], line[11:]
        if kind in "tTwW":
            plain = name.replace("(anonymous namespace)::", "").split("(", 1)[0]
            found.append((int(address, 16), plain))
    return sorted(found)


if __name__ == "__main__":
    sys.exit(main())
