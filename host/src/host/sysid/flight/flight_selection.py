"""Which flights of its sources a fit takes: one of each, that with a number, or all of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from host.errors import IdentificationError
from host.readers.autopilot_flight import is_autopilot_log, read_autopilot
from host.readers.column_map import mapped, read_map
from host.readers.even_grid import USED
from host.readers.flight_choice import ALL, with_flight
from host.readers.foreign_tables import is_text, read_foreign
from host.readers.original_table import is_original
from host.readers.readable_file import readable_file
from host.readers.table_clock import counted_on, flown_s, recordings
from host.sysid.flight.flight_tables import READ


def chosen_flights(
    sources: Sequence[Path],
    flight: int | str | None,
    mapping: Path | Sequence[Path | None] | None = None,
) -> list[list[Path]]:
    """Return of each source the flights that are read of it, as ``log.tlog#2``.

    Parameters
    ----------
    sources : sequence of Path
    flight : int or str, optional
        Number of a flight; ``all`` for each in which something flew; without it the source itself.
    mapping : Path or sequence of Path, optional
        Map of all sources, or of each.

    Raises
    ------
    host.errors.HostError
        If a source cannot be read.
    """
    if flight != ALL:
        number = None if flight is None else int(flight)
        return [[with_flight(source, number)] for source in sources]
    maps = mapping if isinstance(mapping, Sequence) else [mapping] * len(sources)
    return [
        [with_flight(source, number) for number in _numbers(source, own)] or [source]
        for source, own in zip(sources, maps, strict=True)
    ]


def _numbers(source: Path, mapping: Path | None) -> list[int]:
    """Return the numbers of the flights of a source; none where it has but one."""
    source = readable_file(source)
    if not source.is_file() or is_original(source):
        return []
    if is_autopilot_log(source):
        found = read_autopilot(source)
        return [one.number for one in found.listed if one.airborne_s > 0.0] or [found.number]
    if source.suffix.lower() in READ and (mapping is not None or not _is_log(source)):
        return _recorded(source, mapping)
    from host.log import read_log

    return [session.number for session in read_log(source).sessions if session.rows]


def _is_log(source: Path) -> bool:
    """Return whether a file with the ending of a table holds our own frames, as a capture does."""
    return source.suffix.lower() in (".txt", ".dat") and not is_text(source)


def _recorded(source: Path, mapping: Path | None) -> list[int]:
    found = read_foreign(source)
    columns = found.columns
    if mapping is not None:
        lines = read_map(mapping, ("t_s", *USED))
        columns = mapped(columns, found.unusable, lines, mapping, found.twice)
    if "t_s" not in columns:
        raise IdentificationError(f"{source}: no column t_s: its flights cannot be separated")
    columns = columns | {"t_s": counted_on(columns["t_s"], [])}
    parts = recordings(columns["t_s"])
    length = len(columns["t_s"])
    whole = {name: values for name, values in columns.items() if len(values) == length}
    flown = [k for k, rows in enumerate(parts, start=1) if flown_s(whole, rows) > 0.0]
    return flown if len(parts) > 1 else []
