"""Slope and lag of surface positions, as pots measure them, against the servo pulses.

The position is a straight line of the pulse some time ago. That time is the one that leaves the
smallest squares; it holds the delay and the first order of the servo together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.fleet.statistics.watched_quantities import LAG_S, SLOPE

POTS = {
    "elevator": ("elevator_pot_rad",),
    "aileron": ("aileron_left_rad", "aileron_right_rad"),
    "rudder": ("rudder_pot_rad",),
}
_LAGS_S = np.arange(0.0, 0.1501, 0.005)
_FINE_S = 0.0005
_LEAST_US = 8.0  # rms of the pulses: quieter sticks tell no slope
_BLOCK_S = 0.25  # residuals of a servo go together for about so long
_LEAST_BLOCKS = 20


@dataclass(frozen=True, slots=True)
class SurfaceResponse:
    """Slope and lag of a surface, each with its standard deviation.

    Attributes
    ----------
    slope, slope_sd : float
        rad/us.
    lag_s, lag_sd_s : float
    """

    slope: float
    slope_sd: float
    lag_s: float
    lag_sd_s: float


def surface_response(t_s: Array, pulse_us: Array, position_rad: Array) -> SurfaceResponse | None:
    """Return the response of one surface; None where its pulses hardly move.

    Parameters
    ----------
    t_s, pulse_us, position_rad : Array, shape (n,)
        Rising times; rows without a number are left out.
    """
    good = np.isfinite(pulse_us) & np.isfinite(position_rad)
    t, pulse, position = t_s[good], pulse_us[good], position_rad[good]
    if len(t) < 2 or float(np.std(pulse)) < _LEAST_US:
        return None
    blocks = (t[-1] - t[0]) / _BLOCK_S
    if blocks < _LEAST_BLOCKS:
        return None
    lag = _least(t, pulse, position, _LAGS_S)
    lag = _least(t, pulse, position, lag + np.arange(-0.005, 0.00501, _FINE_S))
    slope, left = _line(t, pulse, position, lag)
    then = np.interp(t - lag, t, pulse)
    rms, root = float(np.sqrt(np.mean(left**2))), float(np.sqrt(blocks))
    rate = abs(slope) * float(np.std(np.gradient(then, t)))
    return SurfaceResponse(
        slope, rms / float(np.std(then)) / root, lag, rms / max(rate, 1e-12) / root
    )


def surface_quantities(table: Mapping[str, Array]) -> dict[str, tuple[float, float]]:
    """Return slope and lag of every surface that pots measure, each with its deviation.

    Parameters
    ----------
    table : mapping of (n,) Array
        A log of ours in SI, with pulses.
    """
    found: dict[str, tuple[float, float]] = {}
    for surface, pots in POTS.items():
        pulses = (f"rc_{surface}_us", f"servo_{surface}_us", "mega_drives")
        if any(name not in table for name in (*pots, *pulses)):
            continue
        received, driven, mega = (np.asarray(table[name], dtype=np.float64) for name in pulses)
        # Left and right move against each other: half the difference, as the aileron is defined.
        signs = (0.5, -0.5) if len(pots) == 2 else (1.0,)
        position = sum(
            s * np.asarray(table[p], dtype=np.float64) for s, p in zip(signs, pots, strict=True)
        )
        response = surface_response(
            np.asarray(table["t_s"], dtype=np.float64),
            np.where(mega > 0.5, driven, received),
            np.asarray(position),
        )
        if response is not None:
            found[f"{surface}{SLOPE}"] = (response.slope, response.slope_sd)
            found[f"{surface}{LAG_S}"] = (response.lag_s, response.lag_sd_s)
    return found


def _least(t: Array, pulse: Array, position: Array, lags_s: Array) -> float:
    squares = [float(np.sum(_line(t, pulse, position, lag)[1] ** 2)) for lag in lags_s.tolist()]
    return float(lags_s[int(np.argmin(squares))])


def _line(t: Array, pulse: Array, position: Array, lag_s: float) -> tuple[float, Array]:
    """Return the slope of the position over the pulse `lag_s` earlier, and the residuals."""
    then = np.interp(t - lag_s, t, pulse)
    then = then - then.mean()
    rest = position - position.mean()
    slope = float(then @ rest / (then @ then))
    return slope, rest - slope * then
