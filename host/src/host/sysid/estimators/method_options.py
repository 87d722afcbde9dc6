"""Options of methods that a user may set, checked: `lambda=1e-5`, `start=zero`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from host.errors import IdentificationError
from host.files.user_text import shown
from host.sysid.estimators.method_registry import all_methods, find_method


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
        if not any(name in option_names(method) for method in methods):
            known = "; ".join(
                f"{method}: {', '.join(o.name for o in by.options)}"
                for method, by in all_methods().items()
                if by.options
            )
            raise IdentificationError(
                f"method option {name}: {', '.join(methods)} has none of this name;"
                f" there are {known}"
            )


def option_names(method: str) -> tuple[str, ...]:
    """Return the names of a method's options."""
    by = find_method(method)
    return tuple(o.name for o in by.options) if by else ()


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
    by = find_method(method) if given else None
    return {
        option.keyword or option.name: option.read(
            given[option.name], f"method option {option.name}"
        )
        for option in (by.options if by else ())
        if option.name in given
    }
