"""What a coefficient fit makes of columns: the rotor's history, corrections asked for again."""

import numpy as np
import pytest
from host.aircraft.mass_properties import airframe_data
from host.aircraft.powerplant import START_RADPS, SUBSTEPS, powerplant
from host.instrument.deviations import deviations, sensor_error_model
from host.sysid.coefficients.fit import COLUMNS
from host.sysid.compatibility.signals import Record, apply_sensor_errors

NAME = "ultrastick25e"


def test_rotor_history_is_the_rotor_step_by_step() -> None:
    plant, dt_s = powerplant(NAME), 0.03
    rng = np.random.default_rng(1)
    throttle, speed = rng.uniform(-0.1, 1.1, 200), rng.uniform(0.0, 25.0, 200)
    density = rng.uniform(1.1, 1.25, 200)
    spin, rows = START_RADPS, []
    for sample in zip(throttle.tolist(), speed.tolist(), density.tolist(), strict=True):
        for _ in range(SUBSTEPS):
            push, load, torque = plant.step(spin, *sample)
            spin = max(spin + dt_s / SUBSTEPS * (torque - load) / plant.rotor_kgm2, 0.0)
        rows.append((push, spin, torque))
    found = plant.run(throttle, speed, density, dt_s)
    np.testing.assert_allclose(np.stack(found), np.transpose(rows), rtol=1e-9, atol=1e-9)


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
