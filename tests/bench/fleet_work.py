"""What children do in the bench of fleets: a sleep in place of identification, or a plain loop."""

from __future__ import annotations

import json
import os
import sys
import time
from typing import Any

from host.fleet.flight_task import IDENTIFIED, described

SLEEP_S = 0.01
# Size of a row of coefficients: 33 derivatives and 40 errors that flights share.
DERIVATIVES, ERRORS = 33, 40


def slept(values: dict[str, Any]) -> dict[str, Any]:
    """Return a row of usual size after a sleep."""
    time.sleep(SLEEP_S)
    numbers = [0.001 * k for k in range(DERIVATIVES * ERRORS)]
    return {
        **described(values),
        "state": IDENTIFIED,
        "reason": "",
        "parameters": [f"C_{k}" for k in range(DERIVATIVES)],
        "estimates": numbers[:DERIVATIVES],
        "own_covariance": numbers[: DERIVATIVES**2],
        "errors": [f"e_{k}" for k in range(ERRORS)],
        "error_sources": ["instrument"] * ERRORS,
        "loadings": numbers,
        "processor_s": SLEEP_S,
    }


def loop() -> None:
    """Identify flights one after another; the first one warms up and is not counted.

    Tasks come as a list on stdin; the seconds by the clock and of the processor go to stdout.
    """
    from host.fleet.tasks.flight_identification import flight_row

    tasks = json.load(sys.stdin)
    flight_row(tasks[0])
    began_s, used_s = time.perf_counter(), time.process_time()
    for task in tasks[1:]:
        flight_row(task)
    spent = {"clock_s": time.perf_counter() - began_s, "used_s": time.process_time() - used_s}
    os.write(1, json.dumps(spent).encode())


if __name__ == "__main__":
    loop()
