"""Write tables to files: one module per format, each fed piece by piece."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from host.errors import UsageError
from host.export.writer import Meta, TableWriter
from host.extras import install_hint

FORMATS = ("csv", "parquet", "mat", "npz")


def open_writer(kind: str, path: Path, meta: Meta) -> TableWriter:
    """Return a writer of one format.

    Parameters
    ----------
    kind : str
        One of `FORMATS`.
    path : Path
        File to make.
    meta : Meta
        Units and the rest of what a file should say of itself.

    Raises
    ------
    UsageError
        If the format is unknown or needs an extra that is not installed.
    """
    makers: dict[str, Callable[[Path, Meta], TableWriter]] = {
        "csv": _csv,
        "parquet": _parquet,
        "mat": _mat,
        "npz": _npz,
    }
    if kind not in makers:
        raise UsageError(f"format {kind!r}; expected one of {', '.join(FORMATS)}")
    return makers[kind](path, meta)


def _csv(path: Path, meta: Meta) -> TableWriter:
    from host.export.csv import make_csv_writer

    return make_csv_writer(path, meta)


def _parquet(path: Path, meta: Meta) -> TableWriter:
    try:
        from host.export.parquet import ParquetWriter
    except ModuleNotFoundError as error:
        if error.name != "pyarrow":
            raise
        raise UsageError(
            f"Parquet needs pyarrow: {install_hint('pyarrow')}; or use --to csv"
        ) from error

    return ParquetWriter(path, meta)


def _mat(path: Path, meta: Meta) -> TableWriter:
    from host.export.array_files import MatWriter

    return MatWriter(path, meta)


def _npz(path: Path, meta: Meta) -> TableWriter:
    from host.export.array_files import NpzWriter

    return NpzWriter(path, meta)
