"""The rotor's history over a whole record, against its single steps."""

import numpy as np
from host.aircraft.powerplant import START_RADPS, SUBSTEPS, powerplant

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
