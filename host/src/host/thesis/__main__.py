"""`python -m host.thesis`: compile the kernels of the networks once, so that no answer waits."""

from __future__ import annotations

import sys
import time

import numpy as np

from host.thesis.hopfield import iterate, iterate_until


def build_kernels() -> None:
    """Call every kernel with arguments of the types that methods use; a test holds it to that."""
    W, b = -np.eye(2), np.ones(2)
    iterate(W, b, np.zeros(2), 0.1, 200.0, 3, 1e6)
    iterate_until(W, b, np.zeros(2), 0.1, 200.0, b, 0.5, 3)


def main() -> int:
    """Build the kernels and say how long it took."""
    began = time.perf_counter()
    build_kernels()
    sys.stderr.write(f"kernels ready after {time.perf_counter() - began:.1f} s\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
