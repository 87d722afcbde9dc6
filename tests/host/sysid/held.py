"""Intervals that hold what is true."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType

import numpy as np
from host.sysid.models import FitResult


def assert_held(
    result: FitResult,
    truth: Mapping[str, float],
    names: Iterable[str] = (),
    *,
    times: float = 1.0,
    known: Mapping[str, float] = MappingProxyType({}),
) -> None:
    """Assert that so many half-widths hold some values, of `known` ones within a share of them."""
    half = result.half_width()
    for name in names or known or truth:
        width = float(half[result.index(name)])
        assert abs(result.value(name) - truth[name]) < times * width, (name, width)
        assert width < known.get(name, np.inf) * abs(truth[name]), (name, width)
