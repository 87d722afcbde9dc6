"""Outputs of one maneuver with their sensitivities."""

from __future__ import annotations

from dataclasses import dataclass

from host.arrays import Array


@dataclass(frozen=True, slots=True)
class Response:
    """Simulated outputs of one maneuver and their sensitivities.

    Attributes
    ----------
    y : Array, shape (p, samples)
        Outputs in the units of the model.
    sensitivities : Array, shape (p, samples, columns of this maneuver)
        Derivatives of `y` by the unknowns that this maneuver depends on.
    """

    y: Array
    sensitivities: Array
