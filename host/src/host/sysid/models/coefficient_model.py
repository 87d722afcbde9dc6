"""Model structure: the terms of each force and moment coefficient, read from TOML.

`standard_coefficients.toml` has the equations used when nothing is given, and the syntax of a term.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.files.user_text import read_toml

SIGNALS = ("alpha", "beta", "p", "q", "r", "de", "da", "dr", "V")
LIFT = "CL"  # as a regressor: of the drag polar
WIND, BODY = ("CL", "CD"), ("CZ", "CX")
DRAG = ("CD", "CX")  # what thrust leaves
MOMENTS_AND_SIDE = ("Cm", "CY", "Cl", "Cn")
KIND = "coefficients"
KEYS = ("kind", "name", "rows", "beside")
_FACTOR = re.compile(
    r"(?P<bar>\|)?\s*(?P<signal>[A-Za-z]+)(?:_hat)?\s*(?(bar)\|)\s*(?:\^\s*(?P<power>[23]))?"
)
SYNTAX = "products of " + ", ".join(SIGNALS) + " with ^2, ^3 or between bars"


@dataclass(frozen=True, slots=True)
class CoefficientTerm:
    """A product of signals: (signal, power, absolute) each, in the order of `SIGNALS`."""

    factors: tuple[tuple[str, int, bool], ...]

    @property
    def label(self) -> str:
        """The coefficient's name behind its equation: ``alpha``, ``alpha2``, ``abs_beta``."""
        return "_".join(
            f"{'abs_' if bars else ''}{signal}{power if power > 1 else ''}"
            for signal, power, bars in self.factors
        )

    @property
    def linear(self) -> bool:
        """Whether it is one signal as it stands."""
        return len(self.factors) == 1 and self.factors[0][1:] == (1, False)

    def values(self, signals: Mapping[str, Array], reference: Mapping[str, float]) -> Array:
        """Return the regressor, (n,); signals in a product are relative to `reference`."""
        if self.linear:
            return signals[self.factors[0][0]]
        product: Array | None = None
        for name, power, bars in self.factors:
            factor = signals[name] - reference[name] if name in reference else signals[name]
            factor = np.abs(factor) if bars else factor
            factor = factor**power if power > 1 else factor
            product = factor if product is None else product * factor
        assert product is not None
        return product


@dataclass(frozen=True, slots=True)
class CoefficientModel:
    """Terms of every equation, in the order of the fit.

    Attributes
    ----------
    name : str
    equations : mapping
        Equation, such as ``Cm``, to its terms.
    nuisance : frozenset of str
        Coefficients that are fitted and not reported.
    """

    name: str
    equations: Mapping[str, tuple[CoefficientTerm, ...]]
    nuisance: frozenset[str]

    @property
    def forces(self) -> tuple[str, str]:
        """Equations of normal and axial force: CL and CD, or CZ and CX."""
        return BODY if set(BODY) & set(self.equations) else WIND

    def named(self) -> Iterator[tuple[str, str, CoefficientTerm]]:
        """Return coefficient name, equation and term of everything fitted."""
        for equation, terms in self.equations.items():
            for term in terms:
                yield f"{equation}_{term.label}", equation, term


def coefficients_from(document: Mapping[str, object], source: str) -> CoefficientModel:
    """Build a model from a parsed document: ``[rows]`` are reported, ``[beside]`` nuisance terms.

    Raises
    ------
    IdentificationError
        If an equation is absent or unknown, a term is unknown or doubled.
    """
    unknown = sorted(set(document) - set(KEYS))
    if unknown:
        raise IdentificationError(
            f"{source}: unknown key {', '.join(unknown)}; known are {', '.join(KEYS)}"
        )
    reported, nuisance = (_lists(document.get(key, {}), f"{source}: [{key}]") for key in KEYS[2:])
    fitted = _fitted_rows(reported, nuisance, source)
    equations, not_reported = {}, set()
    for row in fitted:
        texts = [*reported[row], *nuisance.get(row, ())]
        terms = tuple(parse_term(text, row, f"{source}: {row}") for text in texts)
        for term, count in Counter(terms).items():
            if count > 1:
                raise IdentificationError(f"{source}: {row}: {term.label} stands there twice")
        equations[row] = terms
        not_reported |= {f"{row}_{term.label}" for term in terms[len(reported[row]) :]}
    name = str(document.get("name", Path(source).stem))
    return CoefficientModel(name, equations, frozenset(not_reported))


def _fitted_rows(
    reported: Mapping[str, list[str]], nuisance: Mapping[str, list[str]], source: str
) -> list[str]:
    """Return the rows that have terms; refuse unknown ones, and nuisance terms alone."""
    forces = BODY if set(BODY) & set(reported) else WIND
    expected = (*forces, *MOMENTS_AND_SIDE)
    for row in (*reported, *nuisance):
        if row not in expected:
            raise IdentificationError(
                f"{source}: unknown row {row}; a model has CL and CD or CZ and CX, and"
                f" {', '.join(MOMENTS_AND_SIDE)}"
            )
    fitted = [row for row in expected if reported.get(row)]
    nuisance_only = [row for row in nuisance if row not in fitted]
    if not fitted or nuisance_only:
        raise IdentificationError(
            f"{source}: no terms for {', '.join(nuisance_only or expected)};"
            " [rows] needs one row or more"
        )
    return fitted


def _lists(value: object, where: str) -> dict[str, list[str]]:
    if not isinstance(value, dict) or not all(
        isinstance(terms, list) and all(isinstance(x, str) for x in terms)
        for terms in value.values()
    ):
        raise IdentificationError(f'{where}: expected lines such as Cm = ["alpha", "q", "de"]')
    return {str(row): list(terms) for row, terms in value.items()}


def parse_term(text: str, row: str, where: str) -> CoefficientTerm:
    """Return the term that a text means.

    Parameters
    ----------
    text : str
    row : str
        Its equation: only CD may have ``CL^2``.
    where : str
        Begins the error message.

    Raises
    ------
    IdentificationError
        If it is no term.
    """
    powers: Counter[tuple[str, bool]] = Counter()
    for part in text.split("*"):
        found = _FACTOR.fullmatch(part.strip())
        signal = found["signal"] if found else ""
        if found is None or (signal not in SIGNALS and signal != LIFT):
            raise IdentificationError(f"{where}: unknown term '{text}'; terms are {SYNTAX}")
        powers[signal, bool(found["bar"])] += int(found["power"] or 1)
    order = (*SIGNALS, LIFT)
    factors = tuple(
        (signal, power, bars)
        for (signal, bars), power in sorted(powers.items(), key=lambda f: order.index(f[0][0]))
    )
    if any(f[0] == LIFT for f in factors) and (row != "CD" or factors != ((LIFT, 2, False),)):
        raise IdentificationError(f"{where}: '{text}': lift stands in CD only, as CL^2")
    return CoefficientTerm(factors)


@cache
def standard_model() -> CoefficientModel:
    """Return the terms of coefficients that are used when none are given."""
    path = Path(__file__).with_name("standard_coefficients.toml")
    return coefficients_from(read_toml(path, IdentificationError), str(path))
