"""After `python -m host.sysid` no answer waits for the compiler."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from host.compiled import compiled

STUDIES = Path(__file__).parents[3] / "host"
SCRIPT = """
import importlib, json, pkgutil
import host.sysid
from host.sysid.__main__ import build_kernels
from host.sysid.estimators.fit import fit
from studies.aircraft import navion_structured
from studies.data import TRUTH, with_rates

kernels = {}
for module in pkgutil.walk_packages(host.sysid.__path__, "host.sysid."):
    if module.name.endswith("__main__"):
        continue
    for name, thing in vars(importlib.import_module(module.name)).items():
        if hasattr(thing, "signatures") and thing.__module__ == module.name:
            kernels[f"{module.name}.{name}"] = thing
build_kernels()
built = {name: len(kernel.signatures) for name, kernel in kernels.items()}
model = navion_structured().with_start(1.1 * TRUTH)
data = [with_rates(1, snr=10.0), with_rates(2, snr=10.0)]
for method in ("output-error", "output-error-white", "filter-error", "frequency-output-error",
               "recursive", "recursive-fourier", "extended-kalman", "unscented-kalman"):
    fit(method, model, data)
fit("hopfield-whitened", model, data)
print(json.dumps([built, {name: len(kernel.signatures) for name, kernel in kernels.items()}]))
"""


def test_every_kernel_is_built_in_the_types_that_methods_use() -> None:
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(STUDIES)}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, env=environment, check=True
    )
    built, used = json.loads(done.stdout)
    assert len(built) >= 11
    # A private kernel may be part of the kernel that calls it; if Python calls it, the end says so.
    entered = {name: n for name, n in built.items() if not name.rpartition(".")[2].startswith("_")}
    assert min(entered.values()) >= 1, built
    assert used == built


AGAIN = """
import numpy as np
from host.sysid.numerics.kernels import ar_filter
from numba.core.runtime import rtsys

x = np.arange(8.0).reshape(4, 2)
print(ar_filter(x, np.array([0.5, -0.2]), np.eye(2)).sum(), rtsys._init)
"""


def test_machine_code_from_the_cache_does_not_wake_the_compiler(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    seen = [
        subprocess.run(
            [sys.executable, "-c", AGAIN],
            capture_output=True,
            text=True,
            env=environment,
            check=True,
        ).stdout.split()
        for _ in range(2)
    ]
    assert seen[0][0] == seen[1][0]
    assert [awake for _, awake in seen] == ["True", "False"]


def test_a_kernel_is_compiled_where_no_cache_can_be() -> None:
    found: dict[str, Callable[[float], Any]] = {}
    # numba keeps no cache of what stands in no file, as of a file where nobody may write.
    exec("def kernel(x):\n    return 2.0 * x\n", found)
    assert compiled(found["kernel"])(3.0) == 6.0
