"""Measure the flight image on the simulated chip, every device at its real rate.

``make flight-bench`` flies ten simulated minutes at 100 Hz and at 200 Hz, through all eight
receivers of :mod:`flight.bench.plan`, then a row of a flight card that teaches an axis
(:mod:`flight.bench.inputs`), and prints every figure with its limit.

Simulation only: cycles and bytes are those of the image, times those of the device models.
"""

import sys
from pathlib import Path

# Its tools read the ELF: stack_depth, owners.
TOOLCHAIN = Path(__file__).resolve().parents[4] / "firmware" / "toolchain"
if str(TOOLCHAIN) not in sys.path:
    sys.path.insert(0, str(TOOLCHAIN))
