"""Rows of the dataset as flights of a type, about the type's one CG."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from host.fleet.flight_task import IDENTIFIED
from host.fleet.statistics.loaded_flight import LoadedFlight
from host.fleet.statistics.reference_cg import Place, about_cg

if TYPE_CHECKING:
    import pandas as pd

# Errors as rows of released versions call them.
RELEASED_NAMES = {f"tilt_{axis}_rad": f"imu_tilt_{axis}_rad" for axis in "xyz"} | {
    "pitot_drift_pa": "pitot_zero_pa"
}
CONDITIONS = (
    "airspeed_mps", "alpha_rad", "lift", "drag", "chord_m", "span_m", "mass_kg",
)  # fmt: skip


def reference_cg(rows: pd.DataFrame) -> Place:
    """Return the median place of the CG of the aircraft files of a type, m."""
    each = rows[rows["state"] == IDENTIFIED].groupby("aircraft_id")["cg_m"].first()
    x, y, z = np.median(np.stack([np.asarray(v, dtype=np.float64) for v in each]), axis=0)
    return float(x), float(y), float(z)


def type_flights(rows: pd.DataFrame) -> list[LoadedFlight]:
    """Return the identified flights of a type by aircraft and date, all about its reference CG.

    Parameters
    ----------
    rows : pandas.DataFrame
        Rows of one type, as `FlightStore.rows` returns them.
    """
    at = reference_cg(rows)
    found = rows[rows["state"] == IDENTIFIED].to_dict("records")
    return [_flight(row, at) for row in found]


def _watched(row: dict[Any, Any]) -> dict[str, tuple[float, float]]:
    columns = (row[name] for name in ("watched", "watched_values", "watched_deviations"))
    return {str(n): (float(v), float(sd)) for n, v, sd in zip(*columns, strict=True)}


def _flight(row: dict[Any, Any], at: Place) -> LoadedFlight:
    names = tuple(row["parameters"])
    errors = [RELEASED_NAMES.get(name, name) for name in row["errors"]]
    count = len(names)
    flight = LoadedFlight(
        aircraft=str(row["aircraft"]),
        names=names,
        values=np.asarray(row["estimates"], dtype=np.float64),
        own=np.asarray(row["own_covariance"], dtype=np.float64).reshape(count, count),
        sources=tuple(zip(row["error_sources"], errors, strict=True)),
        loadings=np.asarray(row["loadings"], dtype=np.float64).reshape(len(errors), count),
        left_out=frozenset(row["doubted"]),
        date=str(row["date"] or ""),
        label=str(row["source"]),
        conditions={name: float(row[name]) for name in CONDITIONS},
        watched=_watched(row),
    )
    x, y, z = (a - float(b) for a, b in zip(at, row["cg_m"], strict=True))
    return about_cg(flight, (x, y, z))
