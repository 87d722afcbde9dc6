"""Stored inputs: tables, logs and texts in `inputs/`, each with its SHA-256 checked before use."""

from __future__ import annotations

import gzip
import hashlib
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

HERE = Path(__file__).resolve().parent
SUMS = HERE / "inputs.sha256"  # as `sha256sum -c` reads it, in this folder


def sums() -> dict[str, str]:
    """Return the SHA-256 of every stored file by its path from this folder."""
    lines = SUMS.read_text(encoding="utf-8").splitlines()
    return {name: digest for digest, name in (line.split("  ", 1) for line in lines)}


def write_sums(names: Iterable[str]) -> None:
    """Write the SHA-256 of these files, paths from this folder."""
    lines = (f"{_digest(HERE / name)}  {name}\n" for name in sorted(set(names)))
    SUMS.write_text("".join(lines), encoding="utf-8")


def opened(name: str, folder: Path) -> Path | pd.DataFrame:
    """Return a stored input as `host.identify` takes it.

    Parameters
    ----------
    name : str
        Path from this folder. An NPZ becomes a table, what ends in `.gz` is unpacked.
    folder : Path
        Where to unpack.

    Raises
    ------
    ValueError
        If its SHA-256 is not the one that is committed.
    """
    path, expected = HERE / name, sums().get(name, "none")
    if (found := _digest(path)) != expected:
        raise ValueError(f"{name}: SHA-256 is {found}, inputs.sha256 says {expected}")
    if path.suffix == ".npz":
        with np.load(path) as stored:
            return pd.DataFrame({column: stored[column].astype(float) for column in stored})
    if path.suffix == ".gz":
        unpacked = folder / path.stem
        unpacked.write_bytes(gzip.decompress(path.read_bytes()))
        return unpacked
    return path


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
