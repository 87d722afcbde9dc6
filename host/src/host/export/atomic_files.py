"""Files that are whole under their own name or not there, and errors that name them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from host.errors import UsageError

LONGEST_NAME = 100  # characters; file systems take 255 bytes


def unfinished(path: Path) -> Path:
    """Return a name next to `path`, with its ending.

    The process is in it, so that it is no file of the user's, nor another run's.
    """
    return path.with_name(f"{path.stem}.part{os.getpid()}{path.suffix}")


@contextmanager
def blamed_on(target: Path | str) -> Iterator[None]:
    """Turn an error of the system into one that names the file the user asked for.

    Raises
    ------
    UsageError
        If the system says that the file cannot be written, or that there is no room.
    """
    try:
        yield
    except BrokenPipeError:  # the reader of our output left; not an error
        raise
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else error
        raise UsageError(
            f"{target}: cannot be written: {why}; make room or name another place"
        ) from error


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Give a name next to `path`; what is written there gets its own name once it is whole.

    Folders that are missing are made. A device or a pipe has no such name and is written to
    as it is.

    Parameters
    ----------
    path : Path
        What the user asked for; a file there before is replaced.

    Raises
    ------
    UsageError
        If it cannot be written, or there is no room.
    """
    plain = path.is_file() or not path.exists()
    part = unfinished(path) if plain else path
    try:
        with blamed_on(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            yield part
            if plain:
                part.replace(path)
    finally:
        if plain:
            with suppress(OSError):  # whatever is wrong with the place is said already
                part.unlink(missing_ok=True)


def check_destination(called: str, path: Path, *, folder: bool) -> None:
    """Check that a file, or a folder for files, can be written at a place.

    Parameters
    ----------
    called : str
        What the message calls it: an argument or an option.
    path : Path
    folder : bool
        Whether it is to be a folder.

    Raises
    ------
    UsageError
        If it cannot.
    """
    if folder and path.exists() and not path.is_dir():
        raise UsageError(f"{called} {path}: a file; name a folder")
    if not folder and path.is_dir():
        raise UsageError(f"{called} {path}: a folder; name a file in it")
    above = next(p for p in (path, *path.absolute().parents) if p.exists())
    if above != path and not above.is_dir():
        raise UsageError(f"{called} {path}: {above} is a file, no folder can be in it")
    # A file there before is replaced: that is written to its folder.
    for place in (above, above.parent) if above.is_file() else (above,):
        if not os.access(place, os.W_OK):
            raise UsageError(f"{called} {path}: no permission to write to {place}")


def file_names(labels: Iterable[str]) -> list[str]:
    """Return a file's name without ending for each label, each another in any case of letters.

    A model's name is a stranger's: nothing of it may lead out of the folder.
    """
    found: list[str] = []
    for label in labels:
        plain = re.sub(r"[^\w.+-]", "_", label)[:LONGEST_NAME].lstrip(".")
        taken = {name.lower() for name in found}
        name, number = plain, 1
        while name.lower() in taken:
            number += 1
            name = f"{plain}_{number}"
        found.append(name)
    return found
