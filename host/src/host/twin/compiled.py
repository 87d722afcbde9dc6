"""The one place that knows how a function is compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

Kernel = TypeVar("Kernel", bound=Callable[..., object])


def compiled(function: Kernel) -> Kernel:
    """Compile a function of scalars and arrays to machine code, cached beside its source.

    Parameters
    ----------
    function : callable
        Plain Python, in the subset that numba compiles.

    Returns
    -------
    callable
        The same function, with the same signature.

    Notes
    -----
    Division by zero gives infinity as in numpy, not an exception. Sums may be reordered (fastmath):
    a fifth faster, and still the same bits for the same seed on one machine.
    """
    return cast(Kernel, numba.njit(cache=True, error_model="numpy", fastmath=True)(function))
