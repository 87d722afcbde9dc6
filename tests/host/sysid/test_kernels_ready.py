"""A first answer waits for no compiler; a program of many fits gets machine code that agrees."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from host.aircraft import propulsion
from host.aircraft.powerplant import powerplant
from host.compiled import Kernel
from host.sysid.numerics import equation_recursion, recursion

STUDIES = Path(__file__).parents[3] / "host"
METHODS = """
import json, sys
from host.sysid.estimators import fit
from studies.navion import navion_structured
from studies.data import TRUTH, with_rates

model = navion_structured().with_start(1.1 * TRUTH)
data = [with_rates(1, snr=10.0), with_rates(2, snr=10.0)]
for method in ("output-error", "output-error-white", "filter-error", "frequency-output-error",
               "recursive", "recursive-fourier", "extended-kalman", "unscented-kalman"):
    fit(method, model, data)
print("numba" in sys.modules)
"""
BUILT = """
import json
from host.aircraft import propulsion
from host.compiled import Kernel
from host.sysid import __main__ as of_sysid
from host.sysid.numerics import intermittent_filter, recursion
from host.thesis import __main__ as of_thesis, hopfield
recursion.WORTH_COMPILING = propulsion.WORTH_COMPILING = 0.0
of_sysid.build_kernels()
of_thesis.build_kernels()

def codes():
    found = {}
    for module in (recursion, intermittent_filter, propulsion, hopfield):
        for name, thing in vars(module).items():
            if isinstance(thing, Kernel) and thing._machine is not None:
                found[name] = len(thing._machine.signatures)
    return found

built = codes()
from dataclasses import replace
import numpy as np
from host.aircraft.powerplant import powerplant
from host.sysid.estimators import fit
from studies.navion import navion_structured
from studies.data import TRUTH, with_rates
model = navion_structured().with_start(1.1 * TRUTH)
whole = with_rates(1, snr=10.0)
seen = np.ones(whole.outputs.shape, dtype=bool)
seen[1::2, 0] = False
slow = replace(whole, sampled=seen, rates=None)
for method, data in (("output-error", whole), ("filter-error", whole), ("filter-error", slow),
                     ("hopfield-whitened", whole)):
    fit(method, model, [data])
powerplant("ultrastick25e").run(*np.full((3, 9), 0.5), 0.03)
print(json.dumps([built, codes()]))
"""


def printed(script: str) -> str:
    """Run a script in a process of its own and return what it printed."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(STUDIES)}
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_few_fits_load_no_compiler() -> None:
    assert printed(METHODS) == "False\n"


@pytest.mark.usefixtures("loops_as_a_user_has_them")
def test_what_a_process_did_before_changes_no_answer() -> None:
    rng = np.random.default_rng(1)
    step, slopes = np.hstack([0.9 * np.eye(4), np.zeros((4, 2))]), rng.standard_normal((4, 6, 24))
    z, C, start = rng.standard_normal((2000, 6)), np.eye(4), np.zeros((4, 24))
    first, again = np.empty((2, 4, 2000, 24))
    recursion.propagate(step, slopes, z, C, start, first)
    # Forty of these and a thousand of those once brought machine code, which rounds differently.
    for _ in range(500):
        recursion.propagate_block.pays(2000 * 200, recursion.WORTH_COMPILING)
        propulsion.rotor_steps.pays(5000, propulsion.WORTH_COMPILING)
    recursion.propagate(step, slopes, z, C, start, again)
    np.testing.assert_array_equal(first, again)
    assert not recursion.propagate_block.pays(1.0, recursion.WORTH_COMPILING)
    assert not propulsion.rotor_steps.pays(1.0, propulsion.WORTH_COMPILING)


def test_every_kernel_is_built_in_the_types_that_methods_use() -> None:
    built, used = json.loads(printed(BUILT))
    assert set(built) >= {"propagate_block", "_filter", "rotor_steps", "iterate", "iterate_until"}
    assert used == built


@pytest.mark.parametrize("free", [0, 11])  # none: a model without constants, run as it is
@pytest.mark.parametrize("samples", [1, 2, 7, 255, 256, 600])
def test_slopes_by_pieces_and_by_machine_code_agree(
    samples: int, free: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(samples)
    n, wide, p = 4, 6, 3
    step = np.hstack([0.97 * np.eye(n) + 0.02 * rng.standard_normal((n, n)), np.zeros((n, 2))])
    slopes = rng.standard_normal((n, wide, free))
    z, C = rng.standard_normal((samples, wide)), rng.standard_normal((p, n))
    start = rng.standard_normal((n, free))
    found = []
    for worth in (np.inf, 0.0):
        monkeypatch.setattr(recursion, "WORTH_COMPILING", worth)
        out = np.full((p, samples, free), np.nan)
        recursion.propagate(step, slopes, z, C, start, out)
        found.append(out)
    S = start
    for k in range(samples):
        np.testing.assert_allclose(found[0][:, k], C @ S, rtol=1e-9, atol=1e-9)
        S = step[:, :n] @ S + np.einsum("c,icq->iq", z[k], slopes)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9, atol=1e-9)


def test_parts_of_equations_by_arrays_are_their_loops() -> None:
    rng = np.random.default_rng(2)
    a, b, c, d, e = rng.standard_normal((5, 4, 4))
    column = np.array([2, -1, 0, 2])
    given: dict[str, tuple[Any, ...]] = {
        "multiply": (a, b, c), "add_columns": (a, column, b), "begin_step": (a, b, c),
        "add_rates": (a, 2.0, 0.3, b, c, d), "add_times": (0.7, a, e),
    }  # fmt: skip
    kernels = {n: k for n, k in vars(equation_recursion).items() if isinstance(k, Kernel)}
    assert set(given) == {n for n, k in kernels.items() if k.plain().__name__ != n}
    for name, arguments in given.items():
        left = []
        for form in (kernels[name].function, kernels[name].plain()):
            copies = [x.copy() if isinstance(x, np.ndarray) else x for x in arguments]
            form(*copies)
            left.append(copies)
        for loops, arrays in zip(*left, strict=True):
            np.testing.assert_allclose(arrays, loops, rtol=1e-12, err_msg=name)


def test_a_rotor_in_python_and_as_machine_code_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    throttle = 0.5 + 0.5 * np.sin(np.arange(200) * 0.1)  # to full and to nothing
    found = []
    for worth in (np.inf, 0.0):
        monkeypatch.setattr(propulsion, "WORTH_COMPILING", worth)
        found.append(
            powerplant("ultrastick25e").run(throttle, np.full(200, 17.0), np.full(200, 1.2), 0.03)
        )
    np.testing.assert_allclose(found[0], found[1], rtol=1e-10)
