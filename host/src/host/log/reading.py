"""A file of the logger or of a ground station -> a flight log."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from host.errors import LogError
from host.files.regular import file_or_folder
from host.log.capture_head import read_capture_head
from host.log.flight_log import FlightLog
from host.physical.calibration import Calibration, calibration_of_text, load_calibration
from host.wire.blocks import Progress, Scan, scan
from host.wire.frames import find_schemas
from host.wire.schema import Schema
from host.wire.selection import Selection, select
from host.wire.stream import looks_like_stream, read_stream, stream_schemas

_HEAD_BYTES = 64 << 10  # 25 s of the fastest radio


def read_log(
    path: Path | str,
    *,
    session: int | None = None,
    file_id: int | None = None,
    calibration: Path | str | Calibration | None = None,
    progress: Progress | None = None,
    limit_bytes: int | None = None,
) -> FlightLog:
    """Read a flight log.

    Parameters
    ----------
    path : Path or str
        The file the logger wrote, or what a ground station received from its radio.
    session : int, optional
        Keep one recording session; all of the file's log without it.
    file_id : int, optional
        Take the blocks with this file id instead of those of the file's first block: an older
        flight behind the end, or a second log glued on.
    calibration : Path, str or Calibration, optional
        Counts to SI; without it that in the head of a ground capture, else the default.
    progress : callable, optional
        Called with bytes or blocks done and in all.
    limit_bytes : int, optional
        Look at the head of the file only.

    Returns
    -------
    FlightLog

    Raises
    ------
    NotALogError
        If the file holds not one intact block.
    LogError
        If the session, the file id or the schema is not known.
    CalibrationError
        If the calibration file cannot be used.
    UsageError
        If it is a pipe or a device.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import host
    >>> log = host.read_log("flight.bin")  # doctest: +SKIP
    >>> log.table()[["t_s", "alpha_rad", "q_radps"]]  # doctest: +SKIP
    """
    path = Path(path)
    if path.exists():
        file_or_folder(path)
    if _is_capture(path):
        if file_id is not None:
            raise LogError(f"{path}: received from the radio, so it has no file id")
        return _read_capture(path, session, calibration, progress, limit_bytes)
    if not isinstance(calibration, Calibration):
        calibration = load_calibration(calibration)
    found = scan(path, progress, limit_bytes=limit_bytes)
    selection = select(found, str(path), file_id)
    schema = _main_schema(path, selection)
    return FlightLog(
        path, found, selection, schema, calibration, session=session, progress=progress
    )


def _main_schema(path: Path, selection: Selection) -> Schema:
    """Return the schema that most blocks follow, of those that can be read."""
    refused: LogError | None = None
    for _, found in find_schemas(path, selection.blocks):
        if isinstance(found, Schema):
            return found
        refused = refused or found
    if refused is not None:
        raise LogError(f"{path}: {refused}") from refused
    values, counts = np.unique(selection.blocks.schema_hash, return_counts=True)
    raise LogError(
        f"{path}: schema {int(values[np.argmax(counts)]):08x} is neither whole in the log nor known"
        " to this program: the frames cannot be read; install the host tool of that firmware"
    )


def _is_capture(path: Path) -> bool:
    with path.open("rb") as file:
        return looks_like_stream(file.read(_HEAD_BYTES))


def _read_capture(
    path: Path,
    session: int | None,
    calibration: Path | str | Calibration | None,
    progress: Progress | None,
    limit_bytes: int | None,
) -> FlightLog:
    """Read what a ground station received from the radio."""
    head = read_capture_head(path)
    texts = [head.schema_text] if head is not None and head.schema_text else []
    if calibration is None and head is not None and head.calibration_text:
        calibration = calibration_of_text(head.calibration_text, path)
    if not isinstance(calibration, Calibration):
        calibration = load_calibration(calibration)
    stream = read_stream(path, texts=texts, limit_bytes=-1 if limit_bytes is None else limit_bytes)
    schema = stream_schemas(path, stream, texts)[0]
    blocks = stream.blocks
    numbers = tuple(dict.fromkeys(blocks.session.tolist()))
    return FlightLog(
        path,
        Scan(blocks, stream.bad, len(stream.data)),
        Selection(blocks, 0, numbers, (), len(stream.repeated), 0, 0),
        schema,
        calibration,
        session=session,
        progress=progress,
        stream=stream,
    )
