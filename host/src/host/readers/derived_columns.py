"""Columns that nobody measures and a model may want: the rate of a surface."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from host.arrays import Array

RATE = "_rate_radps"  # elevator_rate_radps is the slope of elevator_rad


def derived_columns(columns: Mapping[str, Array], wanted: Collection[str]) -> dict[str, Array]:
    """Return the wanted rates of surfaces that no source has: central differences.

    Parameters
    ----------
    columns : mapping
        On an even grid, with ``t_s``.
    wanted : collection of str
    """
    found = {}
    for name in wanted:
        surface = f"{name.removesuffix(RATE)}_rad"
        if name.endswith(RATE) and name not in columns and surface in columns:
            found[name] = np.gradient(columns[surface], columns["t_s"])
    return found
