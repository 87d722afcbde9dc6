"""Values brought to the instants of rows: what a line between slow samples loses."""

from __future__ import annotations

import numpy as np
import pytest
from host.physical.sampling import Interpolator
from host.readers.even_grid import even_arrays

SHORT_PERIOD_HZ = 2.7


def _rms_loss(at_s: np.ndarray, values: np.ndarray) -> float:
    """Return the share of the motion's size that is missing."""
    known = np.isfinite(values)
    phase = 2.0 * np.pi * SHORT_PERIOD_HZ * at_s[known]
    basis = np.column_stack([np.sin(phase), np.cos(phase)])
    return 1.0 - float(np.linalg.norm(np.linalg.lstsq(basis, values[known], rcond=None)[0]))


@pytest.mark.parametrize(("rate_hz", "delay_s"), [(20.0, 0.007), (20.0, 0.025), (100.0, 0.005)])
def test_motion_keeps_its_size_between_samples(rate_hz: float, delay_s: float) -> None:
    """A line takes 4, 9 and 0.4 % off a short period; derivatives would miss the same."""
    rows_s = np.arange(0.0, 20.0, 1.0 / rate_hz)
    sampled_s = rows_s - delay_s
    bring = Interpolator(sampled_s * 1e6, rows_s * 1e6, 1e6 / rate_hz)
    found = bring(np.sin(2.0 * np.pi * SHORT_PERIOD_HZ * sampled_s))
    assert np.isfinite(found[2:-2]).all()
    assert abs(_rms_loss(rows_s, found)) < 0.013


def test_a_curve_is_drawn_over_no_gap_and_through_no_invalid_sample() -> None:
    rows_s = np.arange(0.0, 5.0, 0.05)
    rows_s = np.delete(rows_s, 40)
    sampled_s = rows_s - 0.01
    values = np.sin(2.0 * np.pi * SHORT_PERIOD_HZ * sampled_s)
    values[60] = np.nan
    found = Interpolator(sampled_s * 1e6, rows_s * 1e6, 5e4)(values)
    # Nothing over the gap, nothing next to the invalid sample, and all the rest stands.
    assert np.flatnonzero(~np.isfinite(found)).tolist() == [39, 59, 60, len(rows_s) - 1]
    true = np.sin(2.0 * np.pi * SHORT_PERIOD_HZ * rows_s)
    assert np.nanmax(np.abs(found - true)) < 0.05


def test_an_even_grid_of_slow_rows_keeps_the_motion() -> None:
    """The grid's rows lie anywhere between those recorded: 5.7 % less by lines."""
    t_s = 0.05 * np.arange(1200.0) + 2e-4 * (np.arange(1200) // 4)  # drifts by a step in all
    t_s = np.delete(t_s, slice(500, 503))
    table = {"t_s": t_s, "q_radps": np.sin(2.0 * np.pi * SHORT_PERIOD_HZ * t_s)}
    columns, _ = even_arrays(table | {"airspeed_mps": np.full(len(t_s), 18.0)})
    assert abs(_rms_loss(columns["t_s"], columns["q_radps"])) < 0.013
