"""Where tables go and how they are written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from host.errors import UsageError
from host.export import FORMATS, open_writer
from host.export.atomic_files import blamed_on, unfinished
from host.export.csv import STDOUT, printable
from host.export.writer import Columns, Meta
from host.log import FlightLog

_ROWS_AT_ONCE = 65_536


@dataclass(frozen=True, slots=True)
class Request:
    """What to decode and where to; see ``host decode --help``."""

    source: Path
    output: str | None = None
    format: str | None = None
    frames: bool = False
    session: int | None = None
    file_id: int | None = None
    calibration: Path | None = None
    row_rate_hz: float | None = None
    sensors: tuple[tuple[str, int | str], ...] = ()


def destination(request: Request, source: Path) -> tuple[str, Path]:
    """Return format and file of the table.

    Raises
    ------
    UsageError
        If ending and --to disagree, the table would overwrite its source, or the place is none.
    """
    output = request.output
    if output == "-":
        if request.format not in (None, "csv"):
            raise UsageError(f"--to {request.format} cannot go to stdout; name a file with -o")
        return "csv", STDOUT
    if output is None:
        kind = request.format or "csv"
        target = Path(f"{source.stem}.{kind}")
    else:
        named = Path(output)
        special = named.exists() and not named.is_file() and not named.is_dir()
        if special or named.parent == Path("/dev"):  # /dev/stdout may be a file
            raise UsageError(f"-o {output}: a pipe or a device; -o - writes CSV to standard output")
        ending = named.suffix.lower().removeprefix(".")
        if named.is_dir() or output.endswith(("/", "\\")):
            kind = request.format or "csv"
            target = named / f"{source.stem}.{kind}"
        elif ending in FORMATS:
            if request.format not in (None, ending):
                raise UsageError(f"-o {output} ends in .{ending} but --to says {request.format}")
            kind, target = ending, named
        else:
            kind = request.format or "csv"
            target = named.with_name(f"{named.name}.{kind}")
    if target.exists() and target.samefile(source):
        raise UsageError(f"{target} is the source itself; name another file with -o")
    with blamed_on(_named(target)):
        target.parent.mkdir(parents=True, exist_ok=True)
    return kind, target


def write_table(pieces: Iterable[Columns], kind: str, target: Path, meta: Meta) -> None:
    """Write a table piece by piece; a file of that name appears only when it is whole.

    Raises
    ------
    UsageError
        If the place cannot be written to, or is full.
    """
    plain = target != STDOUT
    part = unfinished(target) if plain else target
    try:
        with blamed_on(_named(target)):
            writer = open_writer(kind, part, meta)
        try:
            for piece in pieces:
                with blamed_on(_named(target)):
                    writer.write(piece)
        finally:
            with blamed_on(_named(target)):
                writer.close()
        if plain:
            with blamed_on(_named(target)):
                part.replace(target)
    finally:
        if plain:
            part.unlink(missing_ok=True)


def _named(target: Path) -> Path | str:
    """Return what messages call the place."""
    return "standard output" if target == STDOUT else target


def write_frames(log: FlightLog, kind: str, target: Path) -> list[str]:
    """Write every kind of raw frame to a file of its own; return the files."""
    named = Path(log.path.name) if target == STDOUT else target
    folder = named.with_suffix(".frames")
    with blamed_on(folder):
        folder.mkdir(parents=True, exist_ok=True)
    files = []
    for name, frame in log.schema.by_name.items():
        data = log.frames[name]
        if not len(data):
            continue
        units: dict[str, str] = {}
        for part in frame.fields:
            scale = f"{part.scale:g} " if part.scale != 1.0 and part.unit else ""
            count = data.dtype[part.name].shape
            names = [f"{part.name}_{at}" for at in range(count[0])] if count else [part.name]
            units |= dict.fromkeys(names, scale + part.unit)
        # The schema's door lets in no name that leads out of the folder.
        file = folder / f"{name}.{kind}"
        notes = {"source": log.path.name, "frame": name, "content": "raw counts"}
        write_table(_raw_pieces(data), kind, file, Meta(units=units, notes=notes))
        files.append(str(file))
    return files


def _raw_pieces(data: NDArray[Any]) -> Iterator[Columns]:
    """Yield the fields of raw frames as columns, an array's elements as one each."""
    for first in range(0, len(data), _ROWS_AT_ONCE):
        rows = data[first : first + _ROWS_AT_ONCE]
        columns: dict[str, Any] = {}
        for name in rows.dtype.names or ():
            value = rows[name]
            if name == "id":
                continue
            if value.ndim == 1:
                columns[name] = value
            else:
                columns |= {f"{name}_{at}": value[:, at] for at in range(value.shape[1])}
        yield printable(columns)
