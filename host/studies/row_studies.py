"""The studies that keep a row of each estimate, as `make study` runs them.

Each flies, identifies and keeps rows in a file of its own behind `_rows.csv`; a run that was broken
off goes on behind it. Sizes here are those that show the shape; a study's page says how its own
program is run for its figures.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from host.errors import IdentificationError

from studies import (
    demonstration,
    independent,
    shipped_models,
    short_records,
    spoilt_columns,
    surfaces_between_samples,
    users_models,
    wrong_models,
)
from studies.interval_rows import interval_figure, interval_table
from studies.stored_rows import Key, Row, flown_rows
from studies.study_table import write

WRONG_COLUMNS = ("template", "fault", "noise", "method", "seed", *independent.COLUMNS[2:])


@dataclass(frozen=True, slots=True)
class RowStudy:
    """What is flown and how it is kept.

    Attributes
    ----------
    title : str
    columns : tuple of str
        Columns of a row; those of the key come first.
    keys : callable
        Given the seeds and whether the run is small, the key of each flight.
    fly : callable
        Given the entries of a key, its rows.
    group : tuple of str
        The columns that name a line of the table, besides the derivative.
    first_seed : int
    flights : tuple of int
        Flights of a small and of a full run.
    names : tuple of str
        The derivatives shown; none: all.
    """

    title: str
    columns: tuple[str, ...]
    keys: Callable[[range, bool], Iterable[Key]]
    fly: Callable[..., Iterable[Row]]
    group: tuple[str, ...]
    first_seed: int
    flights: tuple[int, int]
    names: tuple[str, ...] = ()

    def run(self, stem: Path, size: int) -> list[Path]:
        """Fly what the file of rows lacks; write table and picture."""
        seeds = range(self.first_seed, self.first_seed + self.flights[size])
        kept, keys = stem.with_name(f"{stem.name}_rows.csv"), list(self.keys(seeds, size == 0))
        rows = self.asked(flown_rows(kept, self.columns, keys, self.fly), keys)
        groups = {
            name: [r for r in rows if ", ".join(r[c] for c in self.group) == name]
            for name in dict.fromkeys(", ".join(r[c] for c in self.group) for r in rows)
        }
        return write(interval_table(self.title, groups), interval_figure(groups), stem)

    def asked(self, rows: Sequence[dict[str, str]], keys: Sequence[Key]) -> list[dict[str, str]]:
        """Return the rows of these keys, of the derivatives that are shown."""
        known = {tuple(map(str, key)) for key in keys}
        return [
            r
            for r in rows
            if tuple(r[c] for c in self.columns[: len(keys[0])]) in known
            and (not r["estimate"] or not self.names or r["name"] in self.names)
        ]


def independent_rows(axis: str, cell: str, seed: int) -> Iterator[dict[str, object]]:
    """Return the rows of one axis of a flight of the independent simulator, without a file."""
    for row in independent.rows_of(cell, independent.cells()[cell], seed, axis):
        yield {"axis": axis, **row}


def wrong_rows(
    template: str, fault: str, noise: str, method: str, seed: int
) -> Iterator[dict[str, object]]:
    """Return the rows of one flight with a wrong model, its truth taken for 1."""
    row = wrong_models.Row(template, fault, noise, method)
    key = (template, fault, noise, method, seed)
    try:
        found = wrong_models.judge(row, seed, wrong_limit(row))
    except IdentificationError:
        yield dict(zip(WRONG_COLUMNS, (*key, "refused"), strict=False))
        return
    for one in found:
        values = (one.name, 1.0, 1.0 + one.error, one.half_width, one.mark)
        yield dict(zip(WRONG_COLUMNS, (*key, *values), strict=True))


wrong_limit = functools.cache(wrong_models.noise_free_limit)


def _wrong_keys(seeds: range, small: bool) -> Iterator[Key]:
    """Return the rows by the default, of a small run those of the short period in white noise."""
    for seed in seeds:
        for row in wrong_models.rows():
            if row.method != "flight":
                continue
            if not small or (row.template, row.noise) == ("short-period", "white"):
                yield row.template, row.fault, row.noise, row.method, seed


ROW_STUDIES = {
    "l_independent": RowStudy(
        "The default answer on a simulator with other equations",
        ("axis", *independent.COLUMNS),
        lambda seeds, small: (
            (axis, cell, seed)
            for seed in seeds
            for cell in independent.cells()
            for axis in tuple(independent.NAMES)[: 1 if small else None]
        ),
        independent_rows,
        ("cell", "axis"),
        first_seed=23000,
        flights=(1, 6),
    ),
    "m_wrong_models": RowStudy(
        "Wrong models against right ones, relative to the truth",
        WRONG_COLUMNS,
        _wrong_keys,
        wrong_rows,
        ("template", "fault", "noise"),
        first_seed=23000,
        flights=(1, 3),
    ),
    "n_users_models": RowStudy(
        "A user's model by its default and by each of three methods",
        users_models.COLUMNS,
        lambda seeds, _: ((noise, seed) for seed in seeds for noise in users_models.NOISES),
        users_models.rows_of,
        ("noise", "method"),
        first_seed=23000,
        flights=(1, 10),
    ),
    "o_shipped_models": RowStudy(
        "The equations that are shipped, on flights of the twin",
        shipped_models.COLUMNS,
        lambda seeds, small: (
            (model, air, seed)
            for seed in seeds
            for air in shipped_models.AIRS_MPS
            for model in shipped_models.MODELS[: 1 if small else None]
        ),
        shipped_models.rows_of,
        ("model", "air_mps"),
        first_seed=23000,
        flights=(1, 2),
        names=(*shipped_models.PRINCIPAL, *shipped_models.ERROR_SD),
    ),
    "p_spoilt_columns": RowStudy(
        "Columns quantised, held and free of noise, against the unspoilt ones",
        spoilt_columns.COLUMNS,
        lambda seeds, small: (
            (cell, seed) for seed in seeds for cell in spoilt_columns.CELLS[: 1 if small else None]
        ),
        spoilt_columns.rows_of,
        ("cell", "analysis", "case"),
        first_seed=23000,
        flights=(1, 3),
    ),
    "q_short_records": RowStudy(
        "Records of one doublet, 1.5 to 5 s",
        short_records.COLUMNS,
        lambda seeds, small: (
            (seed, name, air, model, length_s)
            for seed in seeds
            for name in short_records.fleet()
            for air in short_records.AIRS
            for model in short_records.MODELS
            for length_s in short_records.LENGTHS_S[1 : 2 if small else None]
        ),
        short_records.rows_of,
        ("aircraft", "air", "model"),
        first_seed=23000,
        flights=(1, 4),
    ),
    "r_demonstration": RowStudy(
        "The default answer on the demonstration's card, through the recorder",
        demonstration.COLUMNS,
        lambda seeds, _: ((seed,) for seed in seeds),
        demonstration.rows_of,
        (),
        first_seed=23000,
        flights=(2, 20),
        names=demonstration.PRINCIPAL,
    ),
    "s_surfaces": RowStudy(
        "However surfaces moved between the samples of others' tables",
        surfaces_between_samples.COLUMNS,
        lambda seeds, small: (
            (seed, motion, rate_hz)
            for seed in seeds
            for motion in surfaces_between_samples.MOTIONS
            for rate_hz in surfaces_between_samples.RATES_HZ[: 1 if small else None]
        ),
        surfaces_between_samples.rows_of,
        ("motion", "rate_hz"),
        first_seed=23000,
        flights=(1, 4),
    ),
}
