"""A case: stored inputs, and the options with which `host.identify` is called on them."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from host.errors import HostError

import host
from tests.answers.answer_record import Record, record_of, refusal
from tests.answers.stored_input import opened

FILES = ("inputs/", "../data/")  # an option that begins so names a stored file


@dataclass(frozen=True, slots=True)
class Case:
    """One call of `host.identify`.

    Attributes
    ----------
    name : str
        Name of its frozen answer.
    sources : tuple of str
        Stored inputs; several are identified jointly.
    options : mapping
        Keyword arguments of `host.identify`; stored files by path.
    truth : str
        Stored file with the true values, where they are known.
    """

    name: str
    sources: tuple[str, ...]
    options: Mapping[str, Any] = field(default_factory=dict)
    truth: str = ""

    @property
    def files(self) -> set[str]:
        """Every stored file that the case reads."""
        named = (v for value in self.options.values() for v in _each(value))
        own = {v for v in named if isinstance(v, str) and v.startswith(FILES)}
        return own | set(self.sources) | ({self.truth} if self.truth else set())

    def answer(self) -> Record:
        """Identify, and return what is compared; a refusal is an answer too."""
        return self.identified_and_recorded()[0]

    def identified_and_recorded(self) -> tuple[Record, host.Identification | None]:
        """Identify, and return what is compared and the answer itself, if it is no refusal."""
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            truth = opened(self.truth, folder) if self.truth else None
            try:
                found = self.identified(folder)
            except HostError as error:
                return refusal(error, folder), None
            return record_of(found, folder, truth if isinstance(truth, Path) else None), found

    def identified(self, folder: Path) -> host.Identification:
        """Identify from inputs that are unpacked into a folder.

        Raises
        ------
        HostError
            Where this case is a refusal.
        """
        sources = [opened(name, folder) for name in self.sources]
        options = {key: _resolved(value, folder) for key, value in self.options.items()}
        return host.identify(sources if len(sources) > 1 else sources[0], **options)


def _each(value: Any) -> tuple[Any, ...]:
    return tuple(value) if isinstance(value, list | tuple) else (value,)


def _resolved(value: Any, folder: Path) -> Any:
    if isinstance(value, list | tuple):
        return [_resolved(item, folder) for item in value]
    named = isinstance(value, str) and value.startswith(FILES)
    return opened(value, folder) if named else value
