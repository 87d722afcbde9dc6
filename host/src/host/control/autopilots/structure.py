"""What an autopilot's loop of one axis is to design and flight: a difference equation of gains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from host.arrays import Array

SMALL = 2.0**-20  # a power of two: nothing is rounded


@dataclass(frozen=True, slots=True)
class Setting:
    """One parameter as the autopilot documents it.

    Attributes
    ----------
    name : str
        As the release writes it.
    default, lowest, highest, step : float
        The documented range and the step of the autopilot's own editor.
    unit : str
    """

    name: str
    default: float
    lowest: float
    highest: float
    step: float
    unit: str

    def rounded(self, value: float) -> float:
        """Return a value on the parameter's own steps within its range."""
        return float(np.clip(round(value / self.step) * self.step, self.lowest, self.highest))


class Loop(Protocol):
    """One axis of an autopilot with its gains, at one airspeed.

    Its output is the share of the surface's full travel.
    """

    @property
    def period_s(self) -> float:
        """Period of the difference equation."""

    @property
    def states(self) -> int:
        """Numbers that it keeps between two steps."""

    def step(self, state: Array, angle_error: Array, rate: Array) -> tuple[Array, Array]:
        """Return the new state and the output; of limits only the integral's.

        Parameters
        ----------
        state : Array, shape (..., states)
        angle_error : Array, shape (...)
            Demanded minus measured angle, rad.
        rate : Array, shape (...)
            Measured, rad/s.
        """


class Structure(Protocol):
    """One axis of an autopilot before it has gains."""

    @property
    def settings(self) -> Mapping[str, Setting]:
        """Parameters that are tuned, by their role: ``P``, ``I``, ``D``, ``FF``, ``TC``."""

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names of parameters that stay and that nobody gave: defaults stand for them."""

    @property
    def searched(self) -> tuple[str, ...]:
        """Roles that a search may choose; the others follow from these."""

    @property
    def fastest(self) -> str:
        """Loop whose crossover a search raises: ``actuator`` or ``attitude``."""

    def completed(self, chosen: Mapping[str, float], feed_forward: float) -> dict[str, float]:
        """Return every gain on its own steps.

        Parameters
        ----------
        chosen : mapping of str to float
            By role, of `searched`.
        feed_forward : float
            Share of travel that holds 1 rad/s at the trim.
        """

    @property
    def gyro_filter_hz(self) -> float:
        """Corner of the second-order low-pass before the loop."""

    @property
    def slew_limit_per_s(self) -> float:
        """Rate of the output, in shares of travel, beyond which gains are taken back."""

    def loop(self, gains: Mapping[str, float], airspeed_mps: float) -> Loop:
        """Return the loop with gains by their role, at an airspeed."""


class YawStructure(Protocol):
    """An autopilot's rudder before it has gains: a damper, and a share of the aileron."""

    @property
    def settings(self) -> Mapping[str, Setting]:
        """Parameters that are tuned, by their role; ``MIX`` is the aileron's share."""

    @property
    def damper(self) -> str:
        """Role of the gain from yaw rate."""

    def completed(self, damper: float, mix: float, feed_forward: float) -> dict[str, float]:
        """Return every gain on its own steps; `feed_forward` as in `Structure`."""

    def loop(self, gains: Mapping[str, float], airspeed_mps: float) -> Loop:
        """Return the loop from bank (`angle_error` is what is missing to level) and yaw rate."""

    def mix(self, gains: Mapping[str, float]) -> float:
        """Return the share of rudder travel per share of aileron travel."""


def state_space(loop: Loop) -> tuple[Array, Array, Array, Array]:
    """Return A, B, C, D of a loop from measured angle and rate to its output.

    The difference equation itself is asked, with states and inputs far below its limits: what is
    analysed is what flies.
    """
    n = loop.states
    state = SMALL * np.vstack([np.eye(n), np.zeros((2, n))])
    angle = SMALL * np.r_[np.zeros(n), 1.0, 0.0]
    rate = SMALL * np.r_[np.zeros(n), 0.0, 1.0]
    new, out = (one / SMALL for one in loop.step(state, -angle, rate))
    return new[:n].T, new[n:].T, out[None, :n], out[None, n:]
