"""`python -m host.twin`: compile every kernel of the virtual flight once, so that no flight
waits."""

from __future__ import annotations

import sys
import time

from host.twin.flight.fly import fly
from host.twin.outcome import ideal
from host.twin.outcome.flight_outcome import load_kernels
from host.twin.sensors.local_flow import air_data
from host.twin.testcard import cards


def main() -> int:
    """Build the kernels and say how long it took."""
    began = time.perf_counter()
    load_kernels(cards.load("demo"))
    record = fly(cards.load("calm"))
    ideal.measured_table(record, air_data(record))
    sys.stderr.write(f"kernels ready after {time.perf_counter() - began:.1f} s\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
