"""Sensor errors removed from a record: the same columns, whatever was asked for before."""

import numpy as np
import pytest
from host.aircraft.mass_properties import airframe_data
from host.instrument.deviations import deviations, sensor_error_model
from host.sysid.coefficients.coefficient_search import COLUMNS
from host.sysid.reconstruction import Record, apply_sensor_errors

NAME = "ultrastick25e"


@pytest.fixture(scope="module")
def columns() -> dict[str, np.ndarray]:
    """Slow noise about a steady flight."""
    rng = np.random.default_rng(2)
    swing = {k: 0.05 * np.convolve(rng.standard_normal(599), np.ones(40) / 6.0) for k in COLUMNS}
    steady = {"qbar_pa": 180.0, "density_kgpm3": 1.2, "az_mps2": -9.8, "static_pa": 1e5}
    return {k: v[:600] + steady.get(k, 0.0) for k, v in swing.items()}


@pytest.mark.parametrize("name", list(deviations(sensor_error_model(NAME), airframe_data(NAME))))
def test_a_correction_does_not_depend_on_those_before(
    columns: dict[str, np.ndarray], name: str
) -> None:
    data = sensor_error_model(NAME)
    none = dict.fromkeys(deviations(data, airframe_data(NAME)), 0.0)
    moved = {**none, name: 0.01}
    worn = Record(0.03, columns)
    for errors in (moved, none, moved):
        back = apply_sensor_errors(worn, errors, data, 17.0)
        fresh = apply_sensor_errors(Record(0.03, columns), errors, data, 17.0)
        for signal, values in fresh.items():
            np.testing.assert_array_equal(back[signal], values)
