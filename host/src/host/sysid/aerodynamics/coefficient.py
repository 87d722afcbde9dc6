"""A coefficient with its interval, and the coefficients of a condition, whatever estimated them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A non-dimensional derivative: value, standard error of the fit alone, 95 % half-width with
    everything, and what widens that most."""

    name: str
    value: float
    fit_error: float
    half_width: float
    widened_by: str = ""

    @property
    def differs_from_zero(self) -> bool:
        """Whether its interval does not reach zero."""
        return abs(self.value) > self.half_width


@dataclass(frozen=True, slots=True)
class CoefficientTable:
    """Coefficients of one kind of maneuver: ``longitudinal``, ``lateral`` or another template."""

    template: str
    method: str
    alpha_rad: float
    coefficients: tuple[Coefficient, ...]
