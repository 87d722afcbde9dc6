"""Arguments of a verb that belong to the file before them: `a.csv --from 10 --to 35 b.csv`.

argparse takes all files at once and forgets what stood between them. Here every file counts as an
option, so that its place among the others is known.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from host.errors import UsageError
from host.near_names import like

T = TypeVar("T")
Placed = Sequence[tuple[int, T]]  # a value, and how many files stood before it
_FILE = "--source"
READS = "reads"  # true of a verb whose `source` is files


class PlacedParser(argparse.ArgumentParser):
    """A parser whose files may stand anywhere among its options, after `add_files`."""

    def __init__(self, *args: Any, **options: Any) -> None:
        self._takes_value: dict[str, bool] = {}
        super().__init__(*args, **options)

    def error(self, message: str) -> NoReturn:
        """Refuse arguments in one line; argparse would print the whole usage before it.

        Raises
        ------
        UsageError
            Always.
        """
        raise UsageError(f"{message}; {self.prog} --help says more")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        known = [str(one) for one in action.choices or ()]
        if known and str(value) not in known:
            text = f"no {value!r}{like(str(value), known)}; there are {', '.join(known)}"
            raise argparse.ArgumentError(action, text)

    def add_argument(self, *names: Any, **options: Any) -> argparse.Action:
        """Add an argument, and remember whether a value follows it."""
        action = super().add_argument(*names, **options)
        self._takes_value |= dict.fromkeys(action.option_strings, action.nargs != 0)
        return action

    def add_files(self, about: str) -> None:
        """Add files as `source`, to which arguments of action `StorePlaced` belong."""
        self.set_defaults(**{READS: True})
        self.add_argument("_files", metavar="source", nargs="*", help=about)
        self.add_argument(_FILE, dest="source", type=Path, action="append", default=[],
                          help=argparse.SUPPRESS)  # fmt: skip

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> tuple[Any, list[str]]:
        """Parse, with every file as an option of its own."""
        words = list(sys.argv[1:] if args is None else args)
        if _FILE in self._takes_value:
            words = list(self._files_named(words))
        return super().parse_known_args(words, namespace)

    def _files_named(self, words: Sequence[str]) -> Iterable[str]:
        rest = iter(words)
        for word in rest:
            if word == "--":
                yield from (f"{_FILE}={name}" for name in rest)
            elif not word.startswith("-") or word == "-":
                yield f"{_FILE}={word}"
            else:
                yield word
                # A shortened option is one if it is the beginning of a single name.
                meant = [n for n in self._takes_value if n == word] or [
                    n for n in self._takes_value if n.startswith(word)
                ]
                if len(meant) == 1 and self._takes_value[meant[0]]:
                    yield from (value for value in [next(rest, None)] if value is not None)


class StorePlaced(argparse.Action):
    """Append (files before it, value), with `const` between them where there is one."""

    def __call__(
        self, parser: Any, namespace: Any, values: Any, option_string: str | None = None
    ) -> None:
        """Store one value."""
        side = () if self.const is None else (self.const,)
        placed = (len(namespace.source), *side, values)
        setattr(namespace, self.dest, [*(getattr(namespace, self.dest) or ()), placed])


class StoreOnce(argparse.Action):
    """Store a file to write, and refuse a second one: the first would silently not be written."""

    def __call__(
        self, parser: Any, namespace: Any, values: Any, option_string: str | None = None
    ) -> None:
        """Store one value."""
        first = getattr(namespace, self.dest)
        if first is not None:
            text = f"given twice, {first} and {values}; one run writes one"
            raise argparse.ArgumentError(self, text)
        setattr(namespace, self.dest, values)


def flattened(flights: Iterable[Sequence[Path]]) -> list[Path]:
    """Return the flights of all files, in order."""
    return [flight for every in flights for flight in every]


def of_each_flight(
    value: T | list[T | None] | None, flights: Sequence[Sequence[Path]]
) -> T | list[T | None] | None:
    """Return the value of an option for all flights, or for each: that of its file."""
    if not isinstance(value, list):
        return value
    return [own for own, every in zip(value, flights, strict=True) for _ in every]


def of_each(option: str, placed: Placed[T], files: int) -> T | list[T | None] | None:
    """Return the value of an option for all files, or for each.

    One value is of all files. As many values as files are theirs in order. Else each is of the file
    before it; one before the first is of those that have none of their own.

    Raises
    ------
    UsageError
        If two values belong to one file.
    """
    if len(placed) < 2:
        return placed[0][1] if placed else None
    if len(placed) == files:
        return [value for _, value in placed]
    for place in range(files + 1):
        if len([p for p, _ in placed if p == place]) > 1:
            raise UsageError(
                f"{option} stands {len(placed)} times for {files} source{'s' * (files > 1)}: give"
                " it once for all, or once behind each source"
            )
    own = dict(placed)
    return [own.get(number, own.get(0)) for number in range(1, files + 1)]


def stretches_of_each(
    ends: Iterable[tuple[int, int, float]], files: int
) -> list[list[tuple[float | None, float | None]]] | None:
    """Return from and to of the stretches of each file, of (files before it, 0 from or 1 to, s).

    An end that the last stretch has already begins a new one. Those before the first file are of
    every file without stretches of its own. None where there is no end at all.
    """
    found: dict[int, list[list[float | None]]] = {}
    for place, side, value in ends:
        own = found.setdefault(place, [])
        if not own or own[-1][side] is not None:
            own.append([None, None])
        own[-1][side] = value
    if not found:
        return None
    each = [found.get(k, found.get(0, [])) for k in range(1, files + 1)]
    return [[(first, last) for first, last in own] for own in each]
