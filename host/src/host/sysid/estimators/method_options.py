"""Options of methods that a user may set, checked: `lambda=1e-5`, `start=zero`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from host.errors import IdentificationError
from host.files.quantities import Quantity
from host.files.user_text import shown

STARTS = ("least-squares", "model", "zero")
NETWORK = ("lambda", "rho", "iterations", "start")
# Options by method; all others have none.
OPTIONS: dict[str, tuple[str, ...]] = {
    "hopfield": NETWORK,
    "hopfield-line-search": NETWORK,
    "hopfield-whitened": ("iterations", "start"),
    "recursive": ("forgetting",),
}
# Methods that note how an estimate settles.
SETTLING = (
    "hopfield", "hopfield-line-search", "hopfield-whitened", "recursive", "recursive-fourier",
)  # fmt: skip
_SIZE = Quantity("", -1e12, 1e12, "the thesis has -200 to 200")
_GAIN = Quantity("", 0.0, 1e6, "the thesis has 1e-3, its program 1e-5", above=True)
_COUNT = Quantity("", 1.0, 1e8, "the thesis has 200 000")
_SHARE = Quantity("", 0.0, 1.0, "weight of the past per sample", above=True)


def read_options(texts: Iterable[str]) -> dict[str, str]:
    """Return options by name from texts such as ``lambda=1e-5``.

    Raises
    ------
    IdentificationError
        If one has no equals sign, or is given twice.
    """
    found: dict[str, str] = {}
    for text in texts:
        name, sign, value = text.partition("=")
        name = name.strip()
        if not sign:
            raise IdentificationError(f"method option {shown(text)}, expected NAME=VALUE")
        if name in found:
            raise IdentificationError(f"method option {name} is given twice")
        found[name] = value.strip()
    return found


def check_options(given: Mapping[str, object], methods: Sequence[str]) -> None:
    """Refuse an option that none of the methods has.

    Raises
    ------
    IdentificationError
        With the methods that have options.
    """
    for name in given:
        if not any(name in OPTIONS.get(method, ()) for method in methods):
            known = "; ".join(f"{method}: {', '.join(names)}" for method, names in OPTIONS.items())
            raise IdentificationError(
                f"method option {name}: {', '.join(methods)} has none of this name;"
                f" there are {known}"
            )


def options_of(method: str, given: Mapping[str, object]) -> dict[str, object]:
    """Return the keyword arguments of one method from its options.

    Parameters
    ----------
    method : str
    given : mapping
        Numbers, or texts of a command line; options of other methods are passed over.

    Raises
    ------
    IdentificationError
        If a value is not what the option takes.
    """
    result: dict[str, object] = {}
    for name in OPTIONS.get(method, ()):
        if name not in given:
            continue
        where, value = f"method option {name}", given[name]
        if name == "start":
            if value not in STARTS:
                raise IdentificationError(f"{where}: {shown(value)}, expected {', '.join(STARTS)}")
            result["start"] = value
        elif name == "rho":
            result["rho"] = _numbers(value, where)
        elif name == "lambda":
            result["lambda_"] = _GAIN.check(where, _number(value, where), IdentificationError)
        elif name == "forgetting":
            result[name] = _SHARE.check(where, _number(value, where), IdentificationError)
        else:
            count = _COUNT.check(where, _number(value, where), IdentificationError)
            if count != int(count):
                raise IdentificationError(f"{where}: {count:g}, expected a whole number")
            result["iterations"] = int(count)
    return result


def _numbers(value: object, where: str) -> float | np.ndarray:
    """Return one number, or several from a list or a text with commas."""
    parts = value.split(",") if isinstance(value, str) else value
    if not isinstance(parts, list | tuple | np.ndarray):
        parts = [parts]
    numbers = [
        _SIZE.check(where, _number(part, where), IdentificationError) for part in list(parts)
    ]
    if not numbers or 0.0 in numbers:
        raise IdentificationError(f"{where}: zero or nothing, expected numbers other than zero")
    return numbers[0] if len(numbers) == 1 else np.array(numbers)


def _number(value: object, where: str) -> object:
    if not isinstance(value, str):
        return value
    try:
        return float(value)
    except ValueError:
        raise IdentificationError(f"{where}: {shown(value)}, expected a number") from None
