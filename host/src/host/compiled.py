"""The one place that knows how a function is compiled: machine code with numba, Python without.

Kernels are written in the subset both understand. Compiled code is cached beside its source, so
that only set-up (`python -m host.twin`, `python -m host.sysid`) pays for the compiler.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def _load_compiler() -> Callable[..., Any] | None:
    try:
        import numba
    except ImportError:
        return None
    compiler: Callable[..., Any] = numba.njit
    return compiler


_COMPILER = _load_compiler()


def compiled(function: Kernel) -> Kernel:
    """Return the compiled form of `function`, or `function` itself without numba.

    Parameters
    ----------
    function : callable
        Of scalars and arrays.

    Returns
    -------
    callable
        The same function, with the same signature and the same arithmetic.

    Notes
    -----
    Division by zero gives infinity as in numpy, not an exception.
    """
    return _compile(function, reordered=False)


def compiled_fast(function: Kernel) -> Kernel:
    """Do the same as `compiled`, and let the compiler reorder sums (fastmath).

    A fifth faster in the virtual flight, and still the same bits for the same seed on one machine;
    but NaN and infinity must not be relied on, which a divergence guard does.
    """
    return _compile(function, reordered=True)


def _compile(function: Kernel, *, reordered: bool) -> Kernel:
    if _COMPILER is None:
        return function
    kernel: Kernel = _COMPILER(cache=True, error_model="numpy", fastmath=reordered)(function)
    return kernel
