"""What a method of estimation is: its function, and what the pipeline must know of it.

Every method is one `Method`. Those of this room stand in `method_registry.METHODS`; any package
plugs in its own by an entry point of the group `host.identification_methods`, whose name is the
method's and whose object is a `Method`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from host.errors import IdentificationError
from host.files.user_text import shown

if TYPE_CHECKING:
    from host.files.quantities import Quantity
    from host.sysid.models.fit_result import FitResult

Reader = Callable[[object, str], object]


@dataclass(frozen=True, slots=True)
class MethodOption:
    """An option of a method that a user may set.

    Attributes
    ----------
    name : str
        As the user writes it, ``lambda``.
    read : callable
        Returns the checked value of a number or a text, given it and the words for where it
        stands; raises IdentificationError. `number`, `numbers`, `whole_number` and `one_of` make
        such.
    keyword : str, optional
        Argument of the method's function, where it is not the name.
    """

    name: str
    read: Reader
    keyword: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Method:
    """A method of estimation.

    Attributes
    ----------
    function : str or callable
        ``function(model, maneuvers, **options) -> FitResult`` of a LinearModel and a sequence of
        Maneuver; as ``module:function`` it is imported when the method is first used.
    about : str
        A few words.
    settings : mapping
        Keyword arguments with which the function is this method.
    equations : str or callable, optional
        The same function for a NonlinearModel; without it a user's equations are refused.
    options : tuple of MethodOption
    history : str or callable, optional
        ``history(result) -> list of str``, lines on how the estimate settled. The method notes
        `history` (points, parameters) and `history_step` or `history_s` (points,) in the details
        of its result, and columns of its own as `history_...`.
    valid_in : tuple of str
        Noise in which the method is consistent, so that it may contradict others: ``white``,
        ``coloured``, ``gust``.
    ties : bool
        An entry may stand in several equations; else accelerations are left out.
    holds_noise, holds_starts : bool
        Known noise, and known or shared initial states of a model are heeded.
    estimates_delays : bool
        Delays and places of sensors may be free.
    """

    function: str | Callable[..., Any]
    about: str
    settings: Mapping[str, object] = field(default_factory=dict)
    equations: str | Callable[..., Any] | None = None
    options: tuple[MethodOption, ...] = ()
    history: str | Callable[[FitResult], list[str]] | None = None
    valid_in: tuple[str, ...] = ()
    ties: bool = True
    holds_noise: bool = False
    holds_starts: bool = True
    estimates_delays: bool = False


def loaded(place: str | Callable[..., Any]) -> Callable[..., Any]:
    """Return a function, imported if it is given as ``module:function``."""
    if not isinstance(place, str):
        return place
    module, _, name = place.partition(":")
    function: Callable[..., Any] = getattr(import_module(module), name)
    return function


def number(quantity: Quantity) -> Reader:
    """Return a reader of one number in the range of a quantity."""

    def read(value: object, where: str) -> float:
        return quantity.check(where, _parsed(value, where), IdentificationError)

    return read


def whole_number(quantity: Quantity) -> Reader:
    """Return a reader of one whole number in the range of a quantity."""

    def read(value: object, where: str) -> int:
        count = quantity.check(where, _parsed(value, where), IdentificationError)
        if count != int(count):
            raise IdentificationError(f"{where}: {count:g}, expected a whole number")
        return int(count)

    return read


def numbers(quantity: Quantity) -> Reader:
    """Return a reader of one number or several, in a list or a text with commas; none is zero."""

    def read(value: object, where: str) -> float | np.ndarray:
        parts = value.split(",") if isinstance(value, str) else value
        if not isinstance(parts, list | tuple | np.ndarray):
            parts = [parts]
        found = [
            quantity.check(where, _parsed(part, where), IdentificationError) for part in list(parts)
        ]
        if not found or 0.0 in found:
            raise IdentificationError(f"{where}: zero or nothing, expected numbers other than zero")
        return found[0] if len(found) == 1 else np.array(found)

    return read


def one_of(choices: tuple[str, ...]) -> Reader:
    """Return a reader of one of several words."""

    def read(value: object, where: str) -> object:
        if value not in choices:
            raise IdentificationError(f"{where}: {shown(value)}, expected {', '.join(choices)}")
        return value

    return read


def _parsed(value: object, where: str) -> object:
    if not isinstance(value, str):
        return value
    try:
        return float(value)
    except ValueError:
        raise IdentificationError(f"{where}: {shown(value)}, expected a number") from None
