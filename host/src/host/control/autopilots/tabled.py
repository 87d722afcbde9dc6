"""What axes and rudders of every law have alike: parameters of its file, and of a log."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from host.control.autopilots import parameter_table
from host.control.autopilots.structure import Setting


@dataclass(frozen=True)
class TabledAxis:
    """One axis: its parameters, and those that stay.

    Attributes
    ----------
    axis : str
    fixed : mapping
        Filters, loop rate and speeds; the log's own where it has them.
    assumed : tuple of str
        Names of those that are defaults, for the log has them not.
    """

    axis: str
    fixed: Mapping[str, float]
    assumed: tuple[str, ...] = field(default=(), kw_only=True)
    autopilot: ClassVar[str]
    searched: ClassVar[tuple[str, ...]] = ("P", "D", "TC")
    fastest: ClassVar[str] = "actuator"

    @property
    def settings(self) -> Mapping[str, Setting]:
        """Parameters that are tuned."""
        return parameter_table.settings(self.autopilot, self.axis)

    @property
    def gyro_filter_hz(self) -> float:
        """Frequency of a filter of second order: INAV's is the slower of its kinds."""
        return self.fixed["gyro_filter_hz"]

    @property
    def slew_limit_per_s(self) -> float:
        """None, where a law does not say another."""
        return math.inf


@dataclass(frozen=True)
class TabledRudder:
    """A rudder: its parameters, those that stay, and the aileron's share.

    Attributes
    ----------
    fixed : mapping
    share, aileron_share : float
        Share of the surfaces' travel that full output is.
    """

    fixed: Mapping[str, float]
    share: float
    aileron_share: float
    autopilot: ClassVar[str]

    @property
    def settings(self) -> Mapping[str, Setting]:
        """Parameters that are tuned."""
        return parameter_table.settings(self.autopilot, "yaw")

    def mix(self, gains: Mapping[str, float]) -> float:
        """Return the share of rudder travel per share of aileron travel."""
        return gains["MIX"] * self.share / self.aileron_share
