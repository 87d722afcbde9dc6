"""Permitted numbers in files of the user: unit, range, and source of the range."""

from __future__ import annotations

import math
from dataclasses import dataclass

from host.errors import UsageError
from host.files.user_text import shown


@dataclass(frozen=True, slots=True)
class Quantity:
    """One number of a file.

    Attributes
    ----------
    unit : str
        For messages; empty for a number without one.
    least, most : float
        Beyond these it is refused: no such thing exists, or it would mean something else.
    source : str
        Where the range is from.
    above : bool
        Whether `least` itself is refused too.
    """

    unit: str
    least: float
    most: float
    source: str
    above: bool = False

    def check(self, where: str, value: object, error: type[UsageError]) -> float:
        """Return a number of a file.

        Parameters
        ----------
        where : str
            File and field, for the message.
        value : object
            As it was read.
        error : type
            What to raise.

        Raises
        ------
        UsageError
            As `error`: no number, not finite, or out of range.
        """
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise error(f"{where} is {shown(value)}, expected a number")
        if not abs(value) < math.inf:  # NaN neither
            raise error(f"{where} is {shown(value)}, expected a number")
        low = value <= self.least if self.above else value < self.least
        if low or value > self.most:
            raise error(f"{where} is {_short(value)}{self._unit}, expected {self.words}")
        return float(value)

    @property
    def words(self) -> str:
        """The range in words, with the unit."""
        if self.above and math.isclose(self.least, 0.0):
            return f"above 0 to {self.most:g}{self._unit}"
        return f"{'above ' if self.above else ''}{self.least:g} to {self.most:g}{self._unit}"

    @property
    def _unit(self) -> str:
        return f" {self.unit}" if self.unit else ""


def _short(value: float) -> str:
    return f"{value:g}" if abs(value) < 1e300 else shown(value)
