"""Columns of the dataset, one row a flight."""

from __future__ import annotations

import pyarrow as pa

_TEXTS = pa.list_(pa.string())
_NUMBERS = pa.list_(pa.float64())

SCHEMA = pa.schema(
    [
        ("key", pa.string()),
        ("state", pa.string()),
        ("reason", pa.string()),
        ("source", pa.string()),
        ("log_id", pa.string()),
        ("type", pa.string()),
        ("aircraft", pa.string()),
        ("date", pa.string()),
        ("month", pa.string()),
        ("aircraft_file", pa.string()),
        ("aircraft_id", pa.string()),
        ("calibration_id", pa.string()),
        ("models", _TEXTS),
        ("version", pa.string()),
        ("parameters", _TEXTS),
        ("estimates", _NUMBERS),
        ("own_covariance", _NUMBERS),  # row by row
        ("errors", _TEXTS),
        ("error_sources", _TEXTS),
        ("loadings", _NUMBERS),  # error by error: shift of every estimate by one deviation of it
        ("watched", _TEXTS),  # names of quantities that are no derivatives (`watched_quantities`)
        ("watched_values", _NUMBERS),
        ("watched_deviations", _NUMBERS),
        ("doubted", _TEXTS),  # derivatives that a finding about the data speaks against
        ("verdict", _TEXTS),
        ("findings", pa.string()),
        ("delays", pa.string()),
        ("maneuvers", pa.int64()),
        ("airspeed_mps", pa.float64()),
        ("alpha_rad", pa.float64()),
        ("lift", pa.float64()),
        ("drag", pa.float64()),
        ("mass_kg", pa.float64()),
        ("cg_m", _NUMBERS),
        ("chord_m", pa.float64()),
        ("span_m", pa.float64()),
        ("processor_s", pa.float64()),
    ]
)
# Folders of the dataset; in its files these columns are not repeated.
PARTITIONS = ("type", "aircraft", "month")
