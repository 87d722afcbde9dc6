"""Turn loops into machine code where numba is installed; run them as Python where it is not.

Kernels are written in the subset both understand. Compiled code is cached beside the module, so
that only the set-up (`python -m host.sysid.kernels`) pays for the compiler.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
F = TypeVar("F", bound=Callable[..., Any])


def _load_compiler() -> Callable[..., Any] | None:
    try:
        import numba
    except ImportError:
        return None
    compiler: Callable[..., Any] = numba.njit
    return compiler


_COMPILER = _load_compiler()


def compiled(function: F) -> F:
    """Return the compiled form of `function`, or `function` itself without numba."""
    if _COMPILER is None:
        return function
    kernel: F = _COMPILER(cache=True, error_model="numpy")(function)
    return kernel
