"""The figures that the thesis and its program print, against their definitions."""

import numpy as np
import pytest
from host.thesis.error_figures import thesis_program_error_percent, thesis_sum_of_mean_errors


def test_thesis_figures_show_what_the_second_division_hides() -> None:
    measured = np.column_stack([np.full(77, 2.0), np.full(77, -4.0)])
    simulated = measured * 0.72
    honest = 2 * 28.0
    assert thesis_program_error_percent(measured, simulated) == pytest.approx(honest / 77)
    assert thesis_sum_of_mean_errors(measured, simulated) == pytest.approx(0.28 * 6.0)
