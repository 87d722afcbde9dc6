"""Functions that become machine code where numba is installed and the work is worth it.

Kernels are written in the subset that Python and numba both understand. Nothing here loads numba
before a kernel is called, and only that kernel is compiled: once per install, with a line that says
so, for the code is kept next to its source.
"""

from __future__ import annotations

import contextlib
import dis
import functools
import hashlib
import importlib.util
import os
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, Generic, ParamSpec, TypeVar

from host.extras import install_hint
from host.progress import stage
from host.resources import user_cache

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
# numba's own start, an instruction, a loop: six kernels of equations, tests/bench/README.md
LOADING_S, INSTRUCTION_S, LOOP_S = 0.5, 0.0007, 0.2
A_WAIT_S = 4.0  # what is said of a later kernel too
SLOWER = "100 to 400"  # times: the card `calm` in flight 103, the printed Hopfield iteration 410
KEPT = "kernels"  # folder in the `__pycache__` of the source
GENERATED = ".text"  # how the name of a generated module ends
MOST_KEPT = 30  # generated modules of a kind: models that a user tries, about 1 MB each


class Kernel(Generic[Arguments, Result]):
    """A function that is compiled when it is first called; without numba it stays what it is.

    Parameters
    ----------
    function : callable
        Function of scalars and arrays; it raises nothing of its own. It names the kernels that it
        calls, not a module and a kernel in it.
    reordered : bool
        Let the compiler reorder sums.
    part : bool
        Only other kernels are worth compiling it for; called from Python it is Python.
    by_arrays : callable, optional
        The same without its loops, for kernels that run as Python: what numba takes long to compile
        is quick there.
    """

    def __init__(
        self,
        function: Callable[Arguments, Result],
        *,
        reordered: bool,
        part: bool = False,
        by_arrays: Callable[Arguments, Result] | None = None,
    ) -> None:
        functools.update_wrapper(self, function)
        self.function: Any = function
        self.name = self.function.__name__
        self.place = f"{function.__module__} {self.function.__qualname__}"
        self._reordered = reordered
        self._run: Any = function if part else None
        self._by_arrays = by_arrays
        self._machine: Any = None
        self._kept: Path | None = None

    def __call__(self, *arguments: Arguments.args, **named: Arguments.kwargs) -> Result:
        """Run, compiled."""
        if self._run is None and has_compiler():
            self._run = self.machine(said=True)
        elif self._run is None:
            self._run = self.plain()
            say_if_slow()
        try:
            result: Result = self._run(*arguments, **named)
        except Exception:
            if self._kept is None:
                raise
            # Kept code was cut short by a full disk, or names what another release of numba had.
            self._forget()
            self._run = self.machine()
            self._kept = None  # a second failure is not the cache's
            result = self._run(*arguments, **named)
        return result

    def _forget(self) -> None:
        for kernel in _all_of(self):
            kernel._machine = None
            if kernel._kept is not None:
                shutil.rmtree(kernel._kept, ignore_errors=True)

    def pays(self, work: float, worth: float) -> bool:
        """Return whether a call has so much work that machine code pays.

        The call itself decides, or the program (`prefer_machine_code`), never what a process did
        before: the two round differently, and the same call gives the same answer.

        Parameters
        ----------
        work : float
            Work of the call to come, in the caller's own unit.
        worth : float
            Work from which on machine code pays.
        """
        return (_preferred or work >= worth) and has_compiler()

    def machine(self, *, said: bool = False) -> Any:
        """Return what numba makes of it; `said`: after a line to stderr if that takes a while."""
        if self._machine is None:
            self._kept = _folder(self)
            fresh = self._kept is None or not any(self._kept.rglob("*.nbc"))
            if said and fresh:
                _say_compiling(self.name, compiling_s(self))
            self._machine = _jit(self._linked(Kernel.machine), self._reordered, self._kept)
        return self._machine

    def plain(self) -> Any:
        """Return it as Python, by arrays if it may be; what it calls are functions, no kernels."""
        return self._by_arrays or self._linked(Kernel.plain)

    def _linked(self, form: Callable[[Kernel[..., Any]], Any]) -> FunctionType:
        """Return the function with each kernel that it calls in a form of it."""
        own = self.function
        places = own.__globals__ | {name: form(k) for name, k in _called(own)}
        linked = FunctionType(own.__code__, places, own.__name__, own.__defaults__, own.__closure__)
        linked.__module__, linked.__qualname__ = own.__module__, own.__qualname__
        return linked


def compiled(function: Callable[Arguments, Result]) -> Kernel[Arguments, Result]:
    """Return the function as a kernel.

    Notes
    -----
    Division by zero gives infinity as in numpy, not an exception.
    """
    return Kernel(function, reordered=False)


def compiled_fast(function: Callable[Arguments, Result]) -> Kernel[Arguments, Result]:
    """Do the same as `compiled`, and let the compiler reorder sums (fastmath).

    A fifth faster in the virtual flight, and still the same bits for the same seed on one machine;
    but NaN and infinity must not be relied on, which a divergence guard does.
    """
    return Kernel(function, reordered=True)


def compiled_part(function: Callable[Arguments, Result]) -> Kernel[Arguments, Result]:
    """Do the same as `compiled_fast` for what kernels call; called from Python it stays Python."""
    return Kernel(function, reordered=True, part=True)


def part_by_arrays(
    by_arrays: Callable[Arguments, Result],
) -> Callable[[Callable[Arguments, Result]], Kernel[Arguments, Result]]:
    """Do the same, and run `by_arrays` in its place where the kernels that call it are Python."""
    return functools.partial(Kernel, reordered=True, part=True, by_arrays=by_arrays)


_preferred = False
_announced = False  # that kernels are being compiled


def prefer_machine_code() -> None:
    """Run every kernel as machine code from now on: for programs of many fits, at their start."""
    global _preferred
    _preferred = True


@functools.cache
def has_compiler() -> bool:
    """Return whether numba is installed."""
    return importlib.util.find_spec("numba") is not None


@functools.cache
def say_if_slow() -> None:
    """Say once, where numba is not installed, how long loops take and what helps."""
    if not has_compiler():
        _say(f"without numba this takes {SLOWER} times as long: {install_hint('numba')}")


def compiling_s(kernel: Kernel[..., Any]) -> float:
    """Return about how long numba takes over a kernel and what it calls, s: half to twice that."""
    left = [k.function.__code__ for k in _all_of(kernel) if k._machine is None]
    names = [one.opname for code in left for one in dis.get_instructions(code)]
    return LOADING_S + INSTRUCTION_S * len(names) + LOOP_S * names.count("FOR_ITER")


def generated_source(text: str, kind: str) -> Path:
    """Keep a generated module as a file, because numba keeps code of files alone.

    Its name holds a digest of its text: what any installation of this user generated before is
    compiled already. The `MOST_KEPT` used last stay.

    Parameters
    ----------
    text : str
    kind : str
        Begins the name.

    Returns
    -------
    Path
        Path of a file, or of none where nobody may write: it is then compiled in every process.
    """
    stem = f"{kind}_{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    by_source = Path(__file__).parent / "__pycache__" / KEPT
    for place in sorted(_places(Path(__file__)), key=lambda one: one == by_source):
        path = place / f"{stem}{GENERATED}"
        with contextlib.suppress(OSError):
            place.mkdir(parents=True, exist_ok=True)
            if not path.is_file():
                part = path.with_suffix(f".{os.getpid()}")
                part.write_text(text, encoding="utf-8")
                part.replace(path)
            # Read now, not changed: numba keeps code by the date of change.
            os.utime(path, ns=(time.time_ns(), path.stat().st_mtime_ns))
            _forget_oldest(place, kind)
            return path
    return Path(f"{stem}{GENERATED}")


def _forget_oldest(place: Path, kind: str) -> None:
    """Remove generated modules that were used longest ago, and their compiled code."""
    kept = sorted(place.glob(f"{kind}_*{GENERATED}"), key=lambda path: path.stat().st_atime)
    for path in kept[:-MOST_KEPT]:
        path.unlink(missing_ok=True)
        for code in (path.parent / "__pycache__" / KEPT).glob(f"{path.stem}.*"):
            shutil.rmtree(code, ignore_errors=True)


def _options(reordered: bool) -> dict[str, Any]:
    """Return numba's options.

    Kernels whose sums may be reordered are inlined (`forceinline`) in all that call them. Else each
    caller's object file has a copy that rounds differently, and the one loaded first runs for all:
    the run that compiled flew another last digit than those after it. A virtual flight takes 10 %
    longer to compile so.
    """
    return {"error_model": "numpy", "fastmath": reordered, "forceinline": reordered}


def _jit(function: FunctionType, reordered: bool, folder: Path | None) -> Any:
    import numba

    jit: Any = functools.partial(numba.njit, **_options(reordered))
    if folder is None:
        return jit()(function)
    with _cache_in(folder):
        try:
            return jit(cache=True)(function)
        except RuntimeError:  # no room for it after all
            return jit()(function)


@contextlib.contextmanager
def _cache_in(folder: Path) -> Iterator[None]:
    """Let numba keep what is decorated meanwhile in a folder (its setting NUMBA_CACHE_DIR)."""
    import numba

    config: Any = numba.config
    before, config.CACHE_DIR = config.CACHE_DIR, str(folder)
    try:
        yield
    finally:
        config.CACHE_DIR = before


def _folder(kernel: Kernel[..., Any]) -> Path | None:
    """Return where its code is kept; None where nobody may write, or of no file.

    The folder's name holds a digest of all that the code depends on: numba itself takes a file's
    date for its content and does not see that a kernel in another file has changed. Folders of
    what this source was before are removed.
    """
    source = Path(kernel.function.__code__.co_filename)
    if not source.is_file():
        return None
    name = f"{source.stem}.{kernel.name}.{sys.implementation.cache_tag}"
    digest = _digest(kernel)
    for place in _places(source):
        with contextlib.suppress(OSError):
            place.mkdir(parents=True, exist_ok=True)
            if not os.access(place, os.W_OK):
                continue
            for old in place.glob(f"{name}.*"):
                # Code of a generated module may be another installation's: it goes with its module.
                if old.name != f"{name}.{digest}" and source.suffix != GENERATED:
                    shutil.rmtree(old, ignore_errors=True)
            return place / f"{name}.{digest}"
    return None


def _places(source: Path) -> Iterator[Path]:
    """Return where code may be kept: where asked, next to its source, in the user's own cache."""
    asked = os.environ.get("NUMBA_CACHE_DIR")
    if asked:
        yield Path(asked) / KEPT
    yield source.parent / "__pycache__" / KEPT
    own = user_cache()
    if own is not None:
        yield own / KEPT


def generated_folders() -> list[Path]:
    """Return the folders that hold compiled code."""
    package = Path(__file__).parent
    by_source = [path for path in package.rglob(f"__pycache__/{KEPT}") if path.is_dir()]
    asked = os.environ.get("NUMBA_CACHE_DIR")
    return [*by_source, *([Path(asked) / KEPT] if asked else [])]


def _digest(kernel: Kernel[..., Any]) -> str:
    import numba

    digest = hashlib.sha256(numba.__version__.encode())
    for part in sorted(_all_of(kernel), key=lambda k: k.place):
        code = part.function.__code__
        digest.update(f"{part.place} {_options(part._reordered)}".encode())
        for text in _instructions(code):
            digest.update(text)
        for name in sorted(code.co_names):
            value = part.function.__globals__.get(name)
            if isinstance(value, (int, float, str, tuple)):
                digest.update(f"{name} {value!r}".encode())
    return digest.hexdigest()[:16]


def _instructions(code: CodeType) -> Iterator[bytes]:
    """Return byte code and constants, of functions within too."""
    yield code.co_code
    yield repr((code.co_names, code.co_varnames)).encode()
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _instructions(constant)
        else:
            yield repr(constant).encode()


def _called(function: Any) -> list[tuple[str, Kernel[..., Any]]]:
    """Return the kernels that a function names."""
    found = ((name, function.__globals__.get(name)) for name in function.__code__.co_names)
    return [(name, value) for name, value in found if isinstance(value, Kernel)]


def _all_of(kernel: Kernel[..., Any]) -> set[Kernel[..., Any]]:
    """Return a kernel, those that it calls, and those that they call."""
    found: set[Kernel[..., Any]] = {kernel}
    for _, part in _called(kernel.function):
        found |= _all_of(part)
    return found


def _say_compiling(name: str, takes_s: float) -> None:
    """Announce the first compilation of a process, and each later one that is a wait."""
    global _announced
    what = f"{name}, about {takes_s:.0f} s"
    stage(f"compiling {what}")
    if not _announced:
        _announced = True
        _say(f"a first run compiles its kernels and keeps them for the next ({what}, comes first)")
    elif takes_s >= A_WAIT_S:
        _say(f"compiling {what}")


def _say(text: str) -> None:
    sys.stderr.write(f"host: {text}\n")
    sys.stderr.flush()
