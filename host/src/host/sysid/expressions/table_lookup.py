"""Tables: linear between their points, constant beyond them."""

from __future__ import annotations

from host.arrays import Array
from host.compiled import compiled_part


@compiled_part
def table_value(tables: Array, first: int, count: int, x: float) -> float:
    """Return a table at x.

    Parameters
    ----------
    tables : Array
        All tables end to end: `count` points of x, as many of y.
    first, count : int
        Place and number of points of this table.
    x : float
    """
    if x <= tables[first]:
        return float(tables[first + count])
    if x >= tables[first + count - 1]:
        return float(tables[first + 2 * count - 1])
    k = table_interval(tables, first, count, x)
    share = (x - tables[k]) / (tables[k + 1] - tables[k])
    return float(tables[k + count] + share * (tables[k + count + 1] - tables[k + count]))


@compiled_part
def table_slope(tables: Array, first: int, count: int, x: float) -> float:
    """Return the slope of a table at x: at a point that of its right side, beyond them zero."""
    if x < tables[first] or x >= tables[first + count - 1]:
        return 0.0
    k = table_interval(tables, first, count, x)
    return float((tables[k + count + 1] - tables[k + count]) / (tables[k + 1] - tables[k]))


@compiled_part
def table_interval(tables: Array, first: int, count: int, x: float) -> int:
    """Return the last point that is not beyond x, by bisection."""
    low, high = first, first + count - 1
    while high - low > 1:
        middle = (low + high) // 2
        if tables[middle] <= x:
            low = middle
        else:
            high = middle
    return low
