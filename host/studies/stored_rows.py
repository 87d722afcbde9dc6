"""Rows of a study in a file that a later run continues: what is there is not flown again."""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from host.errors import ExitCode

Row = Mapping[str, object]
Key = tuple[object, ...]


@dataclass(frozen=True, slots=True)
class SeededRun:
    """What a study of seeded flights was asked for: its seeds, and the file of its rows."""

    seeds: range
    rows: Path

    def report(
        self,
        rows: Iterable[dict[str, str]],
        table: Callable[[Sequence[dict[str, str]]], Iterable[str]],
    ) -> int:
        """Print the table of the rows of these seeds; return the exit code."""
        print("\n".join(table([r for r in rows if int(r["seed"]) in self.seeds])))
        return 0


def rows_file(text: str) -> Path:
    """Return where rows are kept; argparse says so in one line where that is a folder.

    Raises
    ------
    argparse.ArgumentTypeError
        A folder was named.
    """
    path = Path(text)
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{text} is a folder; name a file in it")
    return path


def seeded_run(
    name: str,
    about: str | None,
    arguments: Sequence[str] | None,
    *,
    flights: int,
    first_seed: int,
    each: str = "flights",
) -> SeededRun:
    """Return the seeds and the file of rows that a study's command line asks for.

    Parameters
    ----------
    name : str
        Name of the study, and of its file in build/study.
    about : str or None
        Its docstring, for --help.
    arguments : sequence of str or None
        Words of the command line; None: of the program.
    flights, first_seed : int
        Without options.
    each : str
        What is counted, for --help.
    """
    parser = argparse.ArgumentParser(prog=f"python -m studies.{name}", description=about)
    parser.add_argument("--flights", type=int, default=flights, help=each)
    parser.add_argument("--first", type=int, default=first_seed, help="first seed")
    parser.add_argument("--rows", type=rows_file, default=Path(f"../build/study/{name}.csv"))
    asked = parser.parse_args(arguments)
    return SeededRun(range(asked.first, asked.first + asked.flights), asked.rows)


def flown_rows(
    path: Path,
    columns: Sequence[str],
    keys: Iterable[Key],
    fly: Callable[..., Iterable[Row]],
) -> list[dict[str, str]]:
    """Fly what the file has not yet, and return all its rows.

    Parameters
    ----------
    path : Path
        CSV file; made where there is none.
    columns : sequence of str
        Columns of a row; the first ones are the key.
    keys : iterable of tuple
        One of each flight, all of one length.
    fly : callable
        Given the entries of a key, its rows.

    Raises
    ------
    SystemExit
        130 after Ctrl-C; flights that are done stay in the file, whole.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    rows, keys = _read(path), list(keys)
    known = {tuple(r[c] for c in columns[: len(key)]) for key in keys[:1] for r in rows}
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, columns, restval="")
        if file.tell() == 0:  # not where a run was stopped before its first flight
            writer.writeheader()
        try:
            for key in keys:
                if tuple(map(str, key)) not in known:
                    found = list(fly(*key))
                    writer.writerows(found)
                    file.flush()
                    print(f"\r{', '.join(map(str, key))}   ", end="", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            print(f"\nstopped; the next run goes on behind the rows of {path}", file=sys.stderr)
            raise SystemExit(int(ExitCode.INTERRUPTED)) from None
    print(file=sys.stderr)
    return _read(path)


def _read(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))
