"""The models and methods that a user names, checked and read."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from host.errors import IdentificationError
from host.near_names import like
from host.sysid import coefficients, models
from host.sysid.estimators.method_registry import all_methods, find_method
from host.sysid.estimators.method_registry import methods as single_methods
from host.sysid.linear.model_names import AXIS_OF, DEFAULT_METHOD, STAGED
from host.sysid.models.named_models import model_path, shipped_files, shipped_lines
from host.sysid.models.thrust_column import THRUST_COLUMNS
from host.sysid.pipeline.arguments import listed

if TYPE_CHECKING:
    from host.sysid.coefficients import CoefficientModel
    from host.sysid.models import LinearModel

    ModelName = str | Path | LinearModel | CoefficientModel

COEFFICIENTS = "coefficients"  # the name of the standard ones
DEFAULT_MODELS = ("longitudinal", "lateral")
# The replacement of a default model, and why.
WITHOUT_AIRSPEED = (
    {"longitudinal": "short-period", "lateral": "dutch-roll"},
    "without airspeed_mps longitudinal and lateral cannot be estimated: short-period and dutch-roll"
    " by angles and rates replace them; name its column in a map (argument mapping) if it is there",
)
WITHOUT_VANES = (
    {"longitudinal": "short-period"},
    "without vanes longitudinal tells drag and what airspeed does poorly: short-period by q and az"
    " in its place",
)
WITHOUT_PITCH = (
    {"longitudinal": "short-period"},
    "without theta_rad longitudinal cannot be estimated: short-period in its place",
)
WITHOUT_BANK = (
    {"lateral": "dutch-roll"},
    "without phi_rad lateral cannot be estimated: dutch-roll in its place",
)


@dataclass(frozen=True, slots=True)
class Models:
    """The requested models.

    Attributes
    ----------
    linear : tuple
        Name of a template and None, or the name and the model of a user.
    coefficients : CoefficientModel or None
    named : bool
        By the user; not those by default.
    """

    linear: tuple[tuple[str, LinearModel | None], ...]
    coefficients: CoefficientModel | None
    named: bool

    @property
    def signals(self) -> tuple[str, ...]:
        """Inputs and outputs of the user's own models; thrust where it was measured."""
        own = {s for _, m in self.linear if m is not None for s in m.signals()}
        return tuple(sorted({*own, *THRUST_COLUMNS}))

    @property
    def equations(self) -> tuple[str, ...]:
        """Columns that models of the user's own read; empty where others are fitted too."""
        if self.coefficients is not None or any(m is None for _, m in self.linear):
            return ()
        own = {s for _, m in self.linear if m is not None for s in m.signals()}
        return tuple(sorted({*own, "airspeed_mps"}))


def requested_models(given: ModelName | Iterable[ModelName] | None) -> Models:
    """Return the requested models; the two four-state ones by default.

    Parameters
    ----------
    given : str, Path, LinearModel, CoefficientModel or several of them, optional
        Name of a template, ``coefficients``, or a TOML file.

    Raises
    ------
    IdentificationError
        If there is no such model, or there are two sets of coefficients.
    """
    linear: list[tuple[str, LinearModel | None]] = []
    terms: list[CoefficientModel] = []
    for name in listed(given) or DEFAULT_MODELS:
        model = _named_model(name) if isinstance(name, str | Path) else name
        if model is None:
            linear.append((str(name), None))
        elif isinstance(model, coefficients.CoefficientModel):
            terms.append(model)
        elif isinstance(model, models.LinearModel):
            linear.append((str(name) if isinstance(name, str | Path) else model.name, model))
        else:
            raise IdentificationError(
                f"a model is of type {type(name).__name__}, expected a name, a path, a LinearModel"
                " or a CoefficientModel"
            )
    if len({*map(id, terms)}) > 1:
        raise IdentificationError(
            "argument models names several models of the coefficients; give one at a time"
        )
    return Models(tuple(linear), terms[0] if terms else None, bool(listed(given)))


def _named_model(name: str | Path) -> LinearModel | CoefficientModel | None:
    """Return a user's or a shipped model by its name; None of a template."""
    called = str(name)
    if name in AXIS_OF:
        return None
    if name == COEFFICIENTS:
        return coefficients.standard_model()
    if (called and Path(name).exists()) or called.lower().endswith(".toml"):
        return models.read_model(Path(name), of_coefficients=True)
    if called in shipped_files():
        return models.read_model(model_path(name))
    raise IdentificationError(
        f"no model '{name}'{like(called, (*AXIS_OF, COEFFICIENTS, *shipped_files()))};"
        f" there are {', '.join(AXIS_OF)}, coefficients, those of the thesis (`--model"
        " list`), or a TOML file"
    )


def possible_models(asked: Models, columns: Sequence[Collection[str]]) -> tuple[Models, list[str]]:
    """Return the models of flights, and a note where the default ones change for want of a column.

    Parameters
    ----------
    asked : Models
    columns : sequence of collections of str
        Columns of each flight.
    """
    if asked.named:
        return asked, []
    instead: dict[str, str] = {}
    notes: list[str] = []
    for other, note in _wanting(columns):
        instead = other | instead
        notes.append(note)
    linear = tuple((instead.get(name, name), own) for name, own in asked.linear)
    return replace(asked, linear=linear), notes


def _wanting(columns: Sequence[Collection[str]]) -> Iterator[tuple[dict[str, str], str]]:
    """Return which models stand in the place of default ones for want of which column, and why."""
    if not all("airspeed_mps" in c for c in columns):
        yield WITHOUT_AIRSPEED
        return
    if all("alpha_rad" not in c and "az_mps2" in c for c in columns):
        yield WITHOUT_VANES
    elif any("q_radps" in c and "theta_rad" not in c for c in columns):
        yield WITHOUT_PITCH
    if any("r_radps" in c and "phi_rad" not in c for c in columns):
        yield WITHOUT_BANK


def known_methods() -> dict[str, str]:
    """Return every method of linear models with a line about it."""
    return {**STAGED, **single_methods(), **STAGED}  # listed first, and nobody's else


def method_lines() -> list[str]:
    """Return every method with a line about it and the options that it takes."""
    taken = {n: ", ".join(o.name for o in by.options) for n, by in all_methods().items()}
    return [
        f"{name:26s} {about}{f' (options: {taken[name]})' if taken.get(name) else ''}"
        for name, about in known_methods().items()
    ]


def requested_methods(given: str | Iterable[str] | None) -> tuple[str, ...]:
    """Return the requested methods, each once; the default one if there is none.

    Raises
    ------
    IdentificationError
        If there is no such method.
    """
    requested = tuple(dict.fromkeys(map(str, listed(given) or [DEFAULT_METHOD])))
    unknown = [m for m in requested if m not in STAGED and find_method(m) is None]
    if unknown:
        known = known_methods()
        meant = like(unknown[0], known)
        raise IdentificationError(
            f"unknown method {', '.join(unknown)}{meant}; known: {', '.join(known)}"
        )
    return requested


def model_lines() -> list[str]:
    """Return every model that has a name, with a line or more about it."""
    templates = [f"{name:26s} of {', '.join(AXIS_OF[name])}" for name in AXIS_OF]
    direct = f"{COEFFICIENTS:26s} lift, drag, side force and moments, fitted directly"
    return [*templates, direct, *shipped_lines()]
