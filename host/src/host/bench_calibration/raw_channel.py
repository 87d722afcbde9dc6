"""A channel of identification frames in its raw unit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from host.wire.schema import Schema


def raw_channel(schema: Schema, rows: NDArray[np.void], name: str) -> NDArray[np.float64]:
    """Return a channel in the raw unit of protocol/frames.toml; NaN where it was not valid.

    Parameters
    ----------
    schema : Schema
    rows : (n,) array of frames `ident`
    name : str
    """
    field = schema.by_name["ident"].field(name)
    value = rows[name].astype(np.float64)
    if field.invalid is not None:
        value[value == field.invalid] = np.nan
    if field.valid is not None:
        value[(rows["valid"] >> field.valid & 1) == 0] = np.nan
    return np.asarray(value * field.scale)
