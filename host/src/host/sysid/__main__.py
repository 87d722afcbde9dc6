"""`python -m host.sysid`: compile the kernels of identification once, so that no answer waits."""

from __future__ import annotations

import compileall
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import host
from host.aircraft.file import load_measured
from host.aircraft.propulsion import RotorInputs, rotor_steps
from host.sysid.models.maneuver import Maneuver
from host.sysid.numerics.intermittent_filter import FilterEquations, filter_intermittent
from host.sysid.numerics.recursion import propagate_block
from host.sysid.numerics.sampled_model import SampledModel

AIRCRAFT = "ultrastick25e"


def build_kernels() -> None:
    """Call every kernel with arguments of the types that methods use; a test holds it to that."""
    F, S, out = np.eye(2), np.zeros((2, 3)), np.zeros((2, 4, 3))
    propagate_block(F, F, S, S.copy(), np.zeros((4, 6)), 0, 4, out)
    step, slopes = np.zeros((2, 3)), np.zeros((2, 3, 1))
    model = SampledModel(step, slopes, step, slopes, np.zeros(2), np.zeros((2, 1)))
    still = Maneuver(1.0, np.zeros((8, 1)), np.zeros((8, 2)))
    equations = FilterEquations.of_known_noise(model, F, np.ones(2), F)
    filter_intermittent(equations, np.zeros((8, 1)), still)
    half = np.full(2, 0.5)
    rotor_steps(load_measured(AIRCRAFT).airframe(), RotorInputs(half, half, half), 600.0, 0.01, 3)


def main() -> int:
    """Build the kernels, byte-compile the package, and say how long it took."""
    began = time.perf_counter()
    # Not every Python keeps its byte code; compiling it for one answer takes 0.1 s.
    compileall.compile_dir(Path(host.__file__).parent, quiet=2)
    build_kernels()
    sys.stderr.write(f"kernels ready after {time.perf_counter() - began:.1f} s\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
