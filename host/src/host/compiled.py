"""The one place that knows how a function is compiled: machine code with numba, Python without.

Kernels are written in the subset both understand. Compiled code is cached beside its source, so
that only set-up (`python -m host.twin`, `python -m host.sysid`) pays for the compiler.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, TypeVar

Kernel = TypeVar("Kernel", bound=Callable[..., Any])
DIRECT_WITH = ("0.68.",)


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
    how = {"error_model": "numpy", "fastmath": reordered}
    try:
        kernel = _COMPILER(cache=True, **how)(function)
    except RuntimeError:  # neither beside the source nor at home is room for a cache
        kernel = _COMPILER(**how)(function)
    else:
        _load_directly(kernel)
        _load_what_fits(kernel)
    compiled_kernel: Kernel = kernel
    return compiled_kernel


def _load_what_fits(kernel: Any) -> None:
    """Compile anew where the cache is of other code: numba takes a file's date for its content.

    A module that moved since, or a file cut short by a full disk, ended every command in a
    traceback (ModuleNotFoundError, UnpicklingError, EOFError).
    """
    cache = kernel._cache
    load = cache.load_overload

    def load_or_none(signature: Any, target: Any) -> Any:
        try:
            return load(signature, target)
        except Exception:
            cache.flush()
            return None

    cache.load_overload = load_or_none


def _load_directly(kernel: Any) -> None:
    """Let a kernel take its machine code from the cache without waking the compiler.

    numba readies the types and code of all it can compile before it looks into its cache: 0.15 s
    of a process that finds everything there. All such code needs is its runtime, by name. This goes
    through inner doors of numba: versions it was not tried with load as they always do.
    """
    import numba

    if not numba.__version__.startswith(DIRECT_WITH):
        return
    binding = importlib.import_module("llvmlite.binding")
    runtime = importlib.import_module("numba.core.runtime._nrt_python")
    inner = kernel._cache
    wake = inner.load_overload

    def load(signature: Any, target: Any) -> Any:
        for name, address in runtime.c_helpers.items():
            binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)
        found = inner._load_overload(signature, target)
        return wake(signature, target) if found is None else found

    inner.load_overload = load
