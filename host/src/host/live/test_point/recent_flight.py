"""The last seconds of the radio as the columns that a test point is judged by."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np

from host.arrays import Array
from host.constants import DEG_PER_RAD
from host.errors import IdentificationError
from host.live.live_sample import LiveUpdate
from host.readers.even_grid import BRIDGED, even_arrays

KEPT_S = 45.0
NEAR = 0.6  # of a step: that far from an instant of the grid its row may be
_ROWS = 10_000  # 50 s at 200 Hz
_IDLE_US, _FULL_US = 1120.0, 1920.0
_RESET_S = 5.0  # without a row: what was before is another flight


class RecentFlight:
    """Keeps `KEPT_S` of rows."""

    def __init__(self) -> None:
        self._rows: deque[Array] = deque(maxlen=_ROWS)
        self._names: tuple[str, ...] = ()

    @property
    def now_s(self) -> float:
        """Instant of the last row; NaN before there is one."""
        return float(self._rows[-1][0]) if self._rows else np.nan

    @property
    def airspeed_mps(self) -> float:
        """Airspeed of the last row; NaN where it has none."""
        return float(self._rows[-1][1]) if self._rows else np.nan

    def add(self, update: LiveUpdate) -> None:
        """Take rows; behind a silence begin anew."""
        if not len(update):
            return
        columns = surface_columns(update.rows)
        self._names = tuple(columns)
        table = np.stack(list(columns.values()), axis=1)
        if self._rows and table[0, 0] - self.now_s > _RESET_S:
            self._rows.clear()
        self._rows.extend(table)
        while self._rows[-1][0] - self._rows[0][0] > KEPT_S:
            self._rows.popleft()

    def columns(self) -> dict[str, Array]:
        """Return SI columns on an even grid, lines drawn over what did not arrive.

        ``arrived`` is 1 where a row came. Empty where there are too
        few rows.
        """
        if not self._rows:
            return {}
        table = np.stack(list(self._rows))
        raw = {name: table[:, k] for k, name in enumerate(self._names)}
        try:
            even, _ = even_arrays(raw)
        except IdentificationError:
            return {}
        even.pop(BRIDGED, None)
        step_s = float(even["t_s"][1] - even["t_s"][0])
        nearest = np.clip(np.searchsorted(raw["t_s"], even["t_s"]), 1, len(table) - 1)
        off = np.minimum(
            np.abs(raw["t_s"][nearest] - even["t_s"]), np.abs(raw["t_s"][nearest - 1] - even["t_s"])
        )
        return even | {"arrived": (off < NEAR * step_s).astype(np.float64)}


def surface_columns(rows: Mapping[str, Array]) -> dict[str, Array]:
    """Return rows of the page as columns of identification: SI, pairs averaged.

    Parameters
    ----------
    rows : dict of str to Array, each of shape (n,)
        The columns of `LIVE_UNITS`.
    """

    def rad(name: str) -> Array:
        return rows[f"{name}_deg"] / DEG_PER_RAD

    out = {
        "t_s": rows["t_s"],
        "airspeed_mps": _mean(rows["airspeed_a_mps"], rows["airspeed_b_mps"]),
        "alpha_rad": _mean(rad("alpha_a"), rad("alpha_b")),
        "beta_rad": _mean(rad("beta_a"), rad("beta_b")),
    }
    out |= {f"{name}_radps": rows[f"{name}_degps"] / DEG_PER_RAD for name in "pqr"}
    out |= {"phi_rad": rad("phi"), "theta_rad": rad("theta"), "az_mps2": rows["az_mps2"]}
    out |= {
        "elevator_rad": rad("elevator_pot"),
        "aileron_rad": 0.5 * (rad("aileron_left") - rad("aileron_right")),
        "rudder_rad": rad("rudder_pot"),
        "throttle": (rows["servo_throttle_us"] - _IDLE_US) / (_FULL_US - _IDLE_US),
    }
    return out


def _mean(left: Array, right: Array) -> Array:
    """Return the mean of a pair, or the one that is there."""
    both = np.where(np.isnan(right), left, 0.5 * (left + right))
    return np.asarray(np.where(np.isnan(left), right, both))
