"""Files of flights: on this computer, or at an address that fsspec reads (S3, HTTP, SSH...)."""

from __future__ import annotations

import glob
import hashlib
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from host.extras import install_hint
from host.fleet.fleet_error import FleetError

# Found in folders; tables next to them may be what `host decode` made of a log.
LOGS = (".bin", ".log", ".ulg", ".ulog", ".tlog")
_PIECE = 1 << 20
_WILD = "*?["


def is_address(source: str) -> bool:
    """Return whether fsspec reads a source: it begins with a protocol."""
    return "://" in source


def opened(address: str) -> AbstractContextManager[Any]:
    """Open an address to read its bytes.

    Raises
    ------
    FleetError
        If its protocol is unknown here, or needs a library.
    """
    import fsspec

    from host.fleet.sources.object_store import provide_s3

    provide_s3()
    try:
        found: AbstractContextManager[Any] = fsspec.open(address, "rb")
    except ImportError as error:
        raise FleetError(_missing(address, error)) from None
    except ValueError as error:
        raise FleetError(f"{address}: {error}") from None
    return found


def flight_files(source: str) -> list[str]:
    """Return the files that a source stands for, sorted; a file itself, logs below a folder.

    Raises
    ------
    FleetError
        If there are none.
    """
    try:
        found = _at_address(source) if is_address(source) else _on_disk(source)
    except OSError as error:
        raise FleetError(f"{source}: cannot be read: {error.strerror or error}") from None
    if not found:
        expected = "files" if any(c in source for c in _WILD) else f"logs ({', '.join(LOGS)})"
        raise FleetError(f"{source}: no {expected} there; name a file, a folder or a pattern")
    return sorted(found)


def _on_disk(source: str) -> list[str]:
    path = Path(source)
    if path.is_dir():
        return [p.as_posix() for p in path.rglob("*") if p.suffix.lower() in LOGS and p.is_file()]
    if path.is_file():
        return [path.as_posix()]
    found = map(Path, glob.glob(source, recursive=True))  # noqa: PTH207  a pattern with a root
    return [path.as_posix() for path in found if path.is_file()]


def _at_address(source: str) -> list[str]:
    import fsspec

    from host.fleet.sources.object_store import provide_s3

    provide_s3()
    try:
        system, path = fsspec.core.url_to_fs(source)
    except ImportError as error:
        raise FleetError(_missing(source, error)) from None
    except ValueError as error:
        raise FleetError(f"{source}: {error}") from None
    if any(c in path for c in _WILD):
        found = [p for p in system.glob(path) if not system.isdir(p)]
    elif system.isdir(path):
        found = [p for p in system.find(path) if p.lower().endswith(LOGS)]
    else:
        found = [path] if system.exists(path) else []
    return [str(system.unstrip_protocol(p)) for p in found]


def log_id(source: str, seen: dict[str, str]) -> str:
    """Return the SHA-256 of a log, or for an address the identifier that its store gives.

    Parameters
    ----------
    source : str
    seen : dict
        Hashes by path, size and time of change; a hash that was computed is added.
    """
    if is_address(source):
        import fsspec

        system, path = fsspec.core.url_to_fs(source)
        return hashlib.sha256(f"{source} {system.ukey(path)}".encode()).hexdigest()
    stat = Path(source).stat()
    name = f"{Path(source).resolve().as_posix()} {stat.st_size} {stat.st_mtime_ns}"
    if name not in seen:
        digest = hashlib.sha256()
        with Path(source).open("rb") as file:
            while piece := file.read(_PIECE):
                digest.update(piece)
        seen[name] = digest.hexdigest()
    return seen[name]


def _missing(address: str, error: ImportError) -> str:
    needs = str(error).splitlines()[0]
    name = address.partition("://")[0]
    how = f" ({install_hint(error.name)})" if error.name else ""
    return f"{address}: {name} addresses need a library: {needs}{how}"
