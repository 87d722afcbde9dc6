"""Find the recorder's library for this computer, or build it from the sources in the package.

The wheel holds the firmware's own C++ (`host/data/recorder`); a clone uses its firmware folder.
Nothing is downloaded: the compiler is the user's, or PyPI's ziglang if it is installed. Imports
are light, so that a missing compiler is reported at once.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from host.errors import UsageError
from host.extras import install_hint
from host.resources import CLONE, PACKED, user_cache

Progress = Callable[[str, float], None]

# The same flags as in firmware/toolchain/build_sitl.py; a test compares them.
ROOMS = ("core", "core/learning", "drivers", "storage", "app", "boards/sitl")
HEADERS = ("hal", "generated")
STANDARD = "-std=gnu++14"
INCLUDES = ("-Ifirmware", "-Iprotocol")
GENERATED = ("frames.h", "schema_blob.h")
CLONE_LIBRARY = CLONE / "build" / "sitl" / "libsitl.so"
_SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
_COMPILERS = ("c++", "g++", "clang++")
_ABOUT_S = 15  # of both cores of a small machine
_RUNTIME_S = 100  # ziglang compiles its C++ library first


def recorder_library(progress: Progress = lambda *_: None) -> Path:
    """Return the library: HOST_SITL's, the clone's, one built before, or one built now.

    Parameters
    ----------
    progress : callable
        Called with ``build`` and the share done.

    Raises
    ------
    UsageError
        There is none, and no compiler that builds it.
    """
    found = existing_library()
    return found if found is not None else _built(progress)


def existing_library() -> Path | None:
    """Return the library if nothing has to be built.

    Raises
    ------
    UsageError
        If HOST_SITL names none.
    """
    given = os.environ.get("HOST_SITL")
    if given:
        if not Path(given).is_file():
            raise UsageError(f"HOST_SITL={given}: no such file; it names the recorder's library")
        return Path(given)
    for path in (CLONE_LIBRARY, _kept()):
        if path is not None and path.is_file():
            return path
    return None


def check_recorder() -> None:
    """Raise at once where there is no recorder and none can be built.

    Raises
    ------
    UsageError
        With both ways to a compiler.
    """
    if existing_library() is None:
        if sources() is None:
            raise UsageError("the recorder's sources are not in this package; install it again")
        if not list(compilers()):
            raise UsageError(_no_compiler())


def sources() -> Path | None:
    """Return the folder that holds `firmware` and `protocol`, None where they are not packed."""
    for root in (PACKED / "recorder", CLONE):
        if (root / "firmware" / "boards" / "sitl" / "sitl.h").is_file():
            return root
    return None


def compilers() -> Iterator[tuple[str, ...]]:
    """Return the commands of C++ compilers of this computer: CXX, those of PATH, ziglang's."""
    named = shlex.split(os.environ.get("CXX", ""))
    if named and shutil.which(named[0]):
        yield tuple(named)
    seen = set()
    for name in _COMPILERS:
        path = shutil.which(name)
        if path is not None and os.path.realpath(path) not in seen:
            seen.add(os.path.realpath(path))
            yield (path,)
    if importlib.util.find_spec("ziglang") is not None:
        yield (sys.executable, "-m", "ziglang", "c++")


def _no_compiler() -> str:
    system = {
        "win32": "install MinGW-w64's g++",
        "darwin": "run `xcode-select --install`",
    }.get(sys.platform, "install g++ or clang++")
    return (
        f"the recorder is C++ and no compiler is on this computer: {system}, or bring one with pip:"
        f" {install_hint('ziglang')}; --firmware none flies without the recorder"
    )


def _built(progress: Progress) -> Path:
    check_recorder()
    root, target = sources(), _kept()
    assert root is not None
    if target is None:
        raise UsageError("no home folder to keep the recorder in: set XDG_CACHE_HOME")
    with contextlib.suppress(OSError):
        target.parent.mkdir(parents=True, exist_ok=True)
    if not os.access(target.parent, os.W_OK):
        raise UsageError(f"{target.parent}: cannot be written; set XDG_CACHE_HOME to another place")
    complaints = []
    for compiler in compilers():
        name = "ziglang" if "ziglang" in compiler else compiler[0]
        about_s = _ABOUT_S + (_RUNTIME_S if name == "ziglang" else 0)
        print(f"host: building the recorder with {name}, once, about {about_s} s", file=sys.stderr)
        complaint = _build(compiler, root, target, progress)
        if complaint is None:
            _forget_others(target)
            return target
        complaints.append(f"{name}: {complaint}")
    raise UsageError(f"the recorder cannot be built: {'; '.join(complaints)}. {_no_compiler()}")


def _build(compiler: tuple[str, ...], root: Path, target: Path, progress: Progress) -> str | None:
    """Compile and link; return what the compiler said where it refused."""
    position = () if sys.platform == "win32" else ("-fPIC",)
    with tempfile.TemporaryDirectory(prefix="recorder-") as name:
        folder = Path(name)
        units = [
            path for room in ROOMS for path in sorted((root / "firmware" / room).glob("*.cpp"))
        ]
        command = (*compiler, STANDARD, "-O2", "-w", *position, *INCLUDES, "-c")
        objects = [folder / f"{number}.o" for number in range(len(units))]
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            waiting = [
                pool.submit(
                    _complaint, (*command, str(unit.relative_to(root)), "-o", str(out)), root
                )
                for unit, out in zip(units, objects, strict=True)
            ]
            for done, one in enumerate(as_completed(waiting), 1):
                if complaint := one.result():
                    for other in waiting:
                        other.cancel()
                    return complaint
                progress("build", done / (len(units) + 1))
        # MinGW's C++ library goes in, for it is not next to python.exe; ziglang's does by itself.
        static = sys.platform == "win32" and "ziglang" not in compiler
        link = ("-shared", "-static") if static else ("-shared",)
        part = target.with_suffix(f".{os.getpid()}{_SUFFIX}")
        complaint = _complaint((*compiler, *link, *map(str, objects), "-o", str(part)), root)
        if complaint is None:
            part.replace(target)
            progress("build", 1.0)
        return complaint


def _complaint(command: tuple[str, ...], folder: Path) -> str | None:
    """Run a compiler; return the line that says why it failed."""
    try:
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, errors="replace", check=False
        )
    except OSError as error:
        return str(error.strerror or error)
    if done.returncode == 0:
        return None
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    telling = [line for line in lines if "error" in line.lower()] or lines
    return telling[0] if telling else f"exit code {done.returncode}"


def _kept() -> Path | None:
    """Return where a built library is kept: its name holds a digest of what it is made from."""
    root, cache = sources(), user_cache()
    if root is None or cache is None:
        return None
    digest = hashlib.sha256(f"{sys.platform} {platform.machine()} {STANDARD}".encode())
    for path in _all_sources(root):
        digest.update(path.read_bytes())
    return cache / "recorder" / f"recorder_{digest.hexdigest()[:16]}{_SUFFIX}"


def _all_sources(root: Path) -> list[Path]:
    own = [root / "firmware" / room for room in (*ROOMS, *HEADERS)]
    files = [path for room in own for path in room.glob("**/*") if path.suffix in (".h", ".cpp")]
    return sorted(files) + [root / "protocol" / "generated" / name for name in GENERATED]


def _forget_others(target: Path) -> None:
    """Remove what was built from other sources."""
    for path in target.parent.glob(f"recorder_*{_SUFFIX}"):
        if path != target:
            with contextlib.suppress(OSError):  # in use
                path.unlink()
