"""Rows of flights on disk: whenever a run is stopped, each is whole or absent, none twice.

A new row is a file of its own in `new/`, under its key. `compact` moves rows into
`flights/type=T/aircraft=A/month=M/flights.parquet`: a partition's file is written apart and takes
the old one's place in one step; only then the new rows are deleted. If a run is stopped in
between, the next one drops the rows in `new/` that a partition already has.
"""

from __future__ import annotations

import functools
import json
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, unquote

import pyarrow as pa
from pyarrow import parquet

from host.export.atomic_files import unfinished
from host.fleet.dataset.flight_columns import PARTITIONS, SCHEMA
from host.fleet.fleet_error import FleetError

if TYPE_CHECKING:
    import pandas as pd

_FILE = "flights.parquet"
_HASHES = "hashes.json"


class FlightStore:
    """The dataset of a fleet in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._new = folder / "new"
        self._flights = folder / "flights"
        self._guarded(lambda: self._new.mkdir(parents=True, exist_ok=True))
        self._guarded(lambda: self._flights.mkdir(exist_ok=True))

    def keep(self, row: dict[str, Any]) -> None:
        """Keep the row of a flight, on disk when this returns.

        Raises
        ------
        FleetError
            If there is no room, or the folder cannot be written to.
        """
        table = pa.Table.from_pylist([row], schema=SCHEMA)
        self._guarded(lambda: _published(table, self._new / f"{row['key']}.parquet"))

    def compact(self) -> None:
        """Move all new rows into their partitions.

        Raises
        ------
        FleetError
            As `keep`.
        """
        waiting: dict[tuple[str, ...], list[Path]] = {}
        for path in sorted(self._new.glob("*.parquet")):
            if ".part" in path.name:  # of a run that was stopped in mid-writing
                path.unlink(missing_ok=True)
                continue
            row = parquet.read_table(path, columns=list(PARTITIONS)).to_pylist()[0]
            waiting.setdefault(tuple(row[name] for name in PARTITIONS), []).append(path)
        for place, paths in waiting.items():
            self._guarded(functools.partial(self._merged, place, paths))

    def _merged(self, place: tuple[str, ...], paths: list[Path]) -> None:
        folder = self._flights
        for name, value in zip(PARTITIONS, place, strict=True):
            folder = folder / f"{name}={quote(value, safe=' ()+,')}"
        folder.mkdir(parents=True, exist_ok=True)
        target = folder / _FILE
        for stale in folder.glob("*.part*.parquet"):
            stale.unlink(missing_ok=True)
        plain = pa.schema([f for f in SCHEMA if f.name not in PARTITIONS])
        old = [parquet.ParquetFile(target).read()] if target.is_file() else []
        fresh = [parquet.ParquetFile(p).read().select(plain.names) for p in paths]
        # A log has one row: an answer with another aircraft file or version replaces the earlier
        # one.
        rows = {row["log_id"]: row for table in (*old, *fresh) for row in table.to_pylist()}
        ordered = sorted(rows.values(), key=lambda row: (row["date"], row["source"]))
        _published(pa.Table.from_pylist(ordered, schema=plain), target)
        for path in paths:
            path.unlink(missing_ok=True)

    def states(self) -> dict[str, str]:
        """Return the state of every flight that is kept, by its key."""
        found: dict[str, str] = {}
        for path in (*self._flights.rglob(_FILE), *self._new.glob("*.parquet")):
            if ".part" not in path.name:
                table = parquet.ParquetFile(path).read(columns=["key", "state"])
                found |= dict(zip(*(table[c].to_pylist() for c in ("key", "state")), strict=True))
        return found

    def rows(self, keys: Iterable[str] | None = None) -> pd.DataFrame:
        """Return the rows of flights, those of some keys or all, in order of aircraft and date."""
        import pandas as pd

        found: list[dict[str, Any]] = []
        for path in sorted(self._flights.rglob(_FILE)):
            place = {
                name: unquote(part.partition("=")[2])
                for name, part in zip(
                    PARTITIONS, path.relative_to(self._flights).parts, strict=False
                )
            }
            found += [{**row, **place} for row in parquet.ParquetFile(path).read().to_pylist()]
        wanted = None if keys is None else set(keys)
        kept = [row for row in found if wanted is None or row["key"] in wanted]
        table = pd.DataFrame(kept, columns=SCHEMA.names)
        return table.sort_values(
            ["type", "aircraft", "date", "source"], kind="stable", ignore_index=True
        )

    def drop(self, unwanted: Callable[[dict[str, Any]], bool]) -> None:
        """Delete rows of flights to be tried again, or whose answer a newer one has replaced."""
        for path in self._flights.rglob(_FILE):
            table = parquet.ParquetFile(path).read()
            good = [row for row in table.to_pylist() if not unwanted(row)]
            if len(good) < table.num_rows:
                fresh = pa.Table.from_pylist(good, schema=table.schema)
                self._guarded(functools.partial(_published, fresh, path))

    def read_hashes(self) -> dict[str, str]:
        """Return the hashes of logs that earlier runs computed."""
        try:
            found = json.loads((self.folder / _HASHES).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return found if isinstance(found, dict) else {}

    def write_hashes(self, hashes: dict[str, str]) -> None:
        """Keep the hashes of logs."""
        path = self.folder / _HASHES

        def write() -> None:
            part = unfinished(path)
            part.write_text(json.dumps(hashes), encoding="utf-8")
            part.replace(path)

        self._guarded(write)

    def _guarded(self, work: Callable[[], object]) -> None:
        try:
            work()
        except OSError as error:
            why = os.strerror(error.errno) if error.errno else error
            raise FleetError(
                f"{self.folder}: cannot be written: {why}; what was done is kept, make room and run"
                " the same command again"
            ) from error


def _published(table: pa.Table, path: Path) -> None:
    """Write a file that is whole or not there, on the disk itself when this returns."""
    part = unfinished(path)
    try:
        with part.open("wb") as file:
            parquet.write_table(table, file, compression="zstd")
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
