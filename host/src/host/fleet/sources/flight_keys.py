"""Each flight's task, with the hash by which an earlier answer is found."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from host import __version__
from host.aircraft.file import load_measured, read_document
from host.fleet.fleet_error import FleetError
from host.fleet.flight_task import DEFAULT_MODELS, ROWS, FlightTask
from host.fleet.sources.fleet_table import TableRow, row_of
from host.fleet.sources.flight_files import flight_files, is_address, log_id
from host.physical.calibration import load_calibration


@dataclass(slots=True)
class FleetSources:
    """Sources of a run's flights, and the options common to all.

    Attributes
    ----------
    sources : sequence of str
    aircraft : str
        Name or file, for flights of which the table says no other; may be empty.
    table : sequence of TableRow
    models, accept : tuple of str
    hashes : dict
        Hashes of logs seen before (`log_id`).
    """

    sources: Sequence[str]
    aircraft: str = ""
    table: Sequence[TableRow] = ()
    models: tuple[str, ...] = DEFAULT_MODELS
    accept: tuple[str, ...] = ()
    hashes: dict[str, str] = field(default_factory=dict)
    _files: dict[str, str] = field(default_factory=dict)

    def tasks(self) -> Iterator[FlightTask]:
        """Go through all flights, each file once.

        Raises
        ------
        FleetError
            If a source has none, or no aircraft file is known of a flight.
        """
        _check_models(self.models)
        given = list(self.sources) or [row.source for row in self.table if row.source]
        if not given:
            raise FleetError("no sources; name files, folders, patterns or a --table")
        done: set[str] = set()
        for source in given:
            for path in flight_files(source):
                if path not in done:
                    done.add(path)
                    yield self._task(path)

    def _calibration_id(self, path: str) -> str:
        """Return the hash of a calibration that can be read; empty without one."""
        if not path:
            return ""
        if path not in self._files:
            load_calibration(Path(path))
            self._files[path] = _file_id(path)
        return self._files[path]

    def _task(self, path: str) -> FlightTask:
        row = row_of(path, list(self.table)) or TableRow()
        file = row.file or self.aircraft
        if not file:
            raise FleetError(f"{path}: whose flight? give --aircraft FILE, or file in the --table")
        folder = path.rpartition("/")[0].rpartition("/")[2]
        known = {
            "log_id": log_id(path, self.hashes),
            "type": row.type or _memoized(self._files, f"type {file}", lambda: _type_of(file)),
            "aircraft": row.aircraft or folder or "aircraft",
            "aircraft_id": _memoized(self._files, f"aircraft {file}", lambda: _aircraft_id(file)),
            "calibration_id": self._calibration_id(row.calibration),
            "date": row.date,
            "version": f"{__version__}, rows {ROWS}",
        }
        map_id = _file_id(row.map) if row.map and Path(row.map).is_file() else row.map
        settings = [list(self.models), list(self.accept), map_id]
        key = hashlib.sha256(json.dumps([*known.values(), settings]).encode()).hexdigest()
        return FlightTask(
            key=key,
            source=path if is_address(path) else str(Path(path).resolve()),
            aircraft_file=_absolute(file),
            calibration=_absolute(row.calibration),
            mapping=_absolute(row.map),
            models=self.models,
            accept=self.accept,
            **known,
        )


def _check_models(names: Sequence[str]) -> None:
    """Refuse models whose parameters are not the same from flight to flight."""
    from host.sysid.pipeline.requested_models import requested_models

    asked = requested_models(names)
    if asked.linear or asked.coefficients is None:
        name = asked.linear[0][0] if asked.linear else "none"
        raise FleetError(
            f"--model {name} is linear: its A and B are those of one flight's airspeed, air and"
            " loading, so that a spread between flights would be that of the weather; give"
            " 'coefficients', or a model of that kind"
        )


def _memoized(known: dict[str, str], name: str, made: Callable[[], str]) -> str:
    """Return the value of a name, made at its first use only."""
    if name not in known:
        known[name] = made()
    return known[name]


def _type_of(file: str) -> str:
    """Return the name of a type that the table does not name: that of its aircraft file."""
    return load_measured(file).name


def _aircraft_id(file: str) -> str:
    """Return the hash of an aircraft file's content, comments excluded."""
    load_measured(file)
    text = json.dumps(read_document(file), sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _file_id(path: str) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()[:16]


def _absolute(name: str) -> str:
    return str(Path(name).resolve()) if name and Path(name).is_file() else name


def tasks_by_key(tasks: Iterable[FlightTask]) -> dict[str, FlightTask]:
    """Return tasks by key: the same log given twice is one flight."""
    return {task.key: task for task in tasks}
