"""`python -m host.sysid`: compile every kernel of identification once, so that no answer waits."""

from __future__ import annotations

import compileall
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import host
from host.aircraft.powerplant import powerplant
from host.sysid.compatibility.strapdown import path_slopes, strapdown
from host.sysid.estimators.fit import fit
from host.sysid.estimators.gust import fit_with_gust
from host.sysid.estimators.hopfield import iterate, iterate_until
from host.sysid.estimators.recursive import update
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.model import DelayGroup, LinearModel
from host.sysid.models.templates import Trim, longitudinal
from host.sysid.numerics.problem import OutputProblem

AIRCRAFT, SPEED_MPS = "ultrastick25e", 17.0


def example() -> tuple[LinearModel, Maneuver]:
    """Return a small aircraft with a delay and a doublet of it, simulated, light white noise."""
    free = ("alpha_rad",)
    model = longitudinal(Trim(SPEED_MPS, 0.05, 0.05), delays=(DelayGroup("delay_s", free),))
    known = {"Z_alpha": -8.0, "M_alpha": -60.0, "M_q": -8.0, "M_de": -70.0, "Z_de": -0.5}
    known |= {"D_u": -0.2, "D_alpha": -5.0, "Z_u": -0.07}
    model = model.with_start([known.get(p.name, 0.0) for p in model.parameters])
    t = np.arange(0.0, 5.0, 0.02)
    inputs = 0.05 * (np.sign(t - 1.0) - 2.0 * np.sign(t - 1.5) + np.sign(t - 2.0))[:, None]
    problem = OutputProblem(model, [Maneuver(0.02, inputs, np.zeros((len(t), len(model.outputs))))])
    y = problem.outputs(problem.first_guess())
    if y is None:
        raise RuntimeError("the example diverges")
    noise = 0.02 * np.std(y[0], axis=1) + 1e-4
    outputs = y[0].T + noise * np.random.default_rng(1).standard_normal(y[0].T.shape)
    return model, Maneuver(0.02, inputs, outputs)


def build_kernels() -> None:
    """Run small fits through every compiled function; a test holds the list to that."""
    model, maneuver = example()
    fit("output-error", model, [maneuver])
    fit_with_gust(model, [maneuver], SPEED_MPS)
    W, b = -np.eye(2), np.ones(2)
    iterate(W, b, np.zeros(2), 0.1, 200.0, 3, 1e6)
    iterate_until(W, b, np.zeros(2), 0.1, 200.0, b, 0.5, 3)
    path = np.zeros((3, 3))
    turn, _ = strapdown(path, path, np.eye(3), np.zeros(3), 0.01)
    signals = (path, path, path, path, np.ones((2, 3)))
    known = np.full((2, 3, 3), -1)
    slopes = (np.zeros((3, 3, 6)), np.zeros((3, 6)), np.zeros((3, 3, 6)))
    path_slopes(turn, *signals, known, known[0, 0, :2], 0, 0.05, 0.1, *slopes)
    powerplant(AIRCRAFT).run(np.full(2, 0.5), np.full(2, SPEED_MPS), np.full(2, 1.2), 0.03)
    update(np.zeros(2), np.eye(2), np.ones((3, 2)), np.ones(3), 1.0)


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
