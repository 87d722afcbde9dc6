"""Compare a decoded table with the truth of its flight, within limits from the sensors' errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from host.twin.flight.fly import FlightRecord
from host.twin.outcome.ideal import true_table
from host.twin.sensors.imu import Imu
from host.twin.sensors.mega_clock import clock_share

# Column: largest mean error and largest standard deviation of the error in flight, at 10 to 20 m/s
# with every tolerance of `draws` at its end and light turbulence.
LIMITS: dict[str, tuple[float, float]] = {
    "airspeed_mps": (0.60, 0.25),  # pitot scale 3 % is 1.5 % of V, drift of 1 count 0.24 m/s
    "alpha_rad": (0.030, 0.015),  # upwash 10 +- 2 %, zero 0.5 deg, scale 3 %, 8 ms of vane
    "beta_rad": (0.015, 0.025),  # zero 0.5 deg; yaw rate times 0.18 m, 8 ms of vane
    "p_radps": (0.012, 0.030),  # bias 0.5 deg/s, scale 1 %, misalignment 1 deg
    "q_radps": (0.012, 0.030),
    "r_radps": (0.012, 0.030),
    "ax_mps2": (0.45, 0.20),  # bias 0.25, misalignment 1 deg of 9.8 m/s2, lever arm
    "ay_mps2": (0.45, 0.20),
    "az_mps2": (0.37, 0.35),
    "phi_rad": (0.06, 0.06),  # attitude filter
    "theta_rad": (0.06, 0.05),
    "elevator_rad": (0.0062, 0.0045),  # pot zero 0.3 deg, scale 1 %, half a count
    "aileron_rad": (0.0062, 0.0045),
    "rudder_rad": (0.0062, 0.0065),
    "static_pa": (103.0, 6.0),  # absolute accuracy 1 hPa, noise 3 Pa
}
SETTLED_S = 2.0  # after the launch


@dataclass(frozen=True, slots=True)
class Deviation:
    """Error of one column: mean and standard deviation, and what is allowed of both."""

    column: str
    mean: float
    spread: float
    mean_limit: float
    spread_limit: float

    @property
    def within(self) -> bool:
        """Whether both stay within their limits."""
        return abs(self.mean) <= self.mean_limit and self.spread <= self.spread_limit


def clock_began_s(record: FlightRecord, samples: Imu, ident: NDArray[np.void]) -> float:
    """Return the true time at which the recorder's clock stood at 0, by its first IMU samples.

    On a chip that is when its program starts, some milliseconds after power-on.

    Parameters
    ----------
    record : FlightRecord
    samples : Imu
        What was sent, and when it was taken.
    ident : structured array
        Identification frames of the log.
    """
    names = ("p", "q", "r", "ax", "ay", "az", "phi", "theta", "psi")
    sent = {row.tobytes(): t for row, t in zip(samples.raw, samples.t_s.tolist(), strict=True)}
    first = ident[:200]
    rows = np.column_stack([first[name] for name in names])
    taken_us = first["t_us"].astype(float) - 4.0 * first["imu_age"]
    found = [
        sent[row.tobytes()] - at_us * 1e-6 / (1.0 + clock_share(record))
        for row, at_us in zip(rows, taken_us.tolist(), strict=True)
        if row.tobytes() in sent
    ]
    return float(np.median(found)) if found else 0.0


def true_times(
    record: FlightRecord, table: pd.DataFrame, first_row_us: int, began_s: float = 0.0
) -> pd.Series:
    """Return the true time since power-on of each row of a decoded table.

    Parameters
    ----------
    record : FlightRecord
    table : DataFrame
        With ``t_s`` from its first row, corrected by GPS.
    first_row_us : int
        The recorder's clock at the first row.
    began_s : float
        When that clock stood at 0.
    """
    for fault in record.card.faults:
        if fault.kind == "clock_wrap":  # the clock did not begin at 0
            first_row_us = (first_row_us + round(fault.at_s * 1e6)) % (1 << 32)
    start_s = began_s + first_row_us * 1e-6 / (1.0 + clock_share(record))
    return pd.Series(table["t_s"].to_numpy() - table["t_s"].iloc[0] + start_s)


def deviations(record: FlightRecord, table: pd.DataFrame, true_s: pd.Series) -> list[Deviation]:
    """Compare the flight part of a table with the truth.

    Parameters
    ----------
    record : FlightRecord
    table : DataFrame
    true_s : Series
        True time of each row.

    Returns
    -------
    list of Deviation
        One per column of `LIMITS` that the table has.
    """
    truth = true_table(record)
    at = true_s.to_numpy()
    flying = (at > record.card.flight.ground_s + SETTLED_S) & (at < record.t_s[-1] - 0.1)
    found = []
    for column, (mean_limit, spread_limit) in LIMITS.items():
        if column not in table.columns:
            continue
        expected = np.interp(at[flying], truth["t_s"], truth[column])
        error = table[column].to_numpy()[flying] - expected
        error = error[np.isfinite(error)]
        if len(error):
            found.append(
                Deviation(column, float(error.mean()), float(error.std()), mean_limit, spread_limit)
            )
    return found
