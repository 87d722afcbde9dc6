"""The delay of a command, in records of two rates, a servo behind it."""

from pathlib import Path

import numpy as np
import pytest
from host.sysid.estimators import fit_output_error
from host.sysid.models import LinearModel, Maneuver, read_model
from host.sysid.numerics import output_problem

from tests.host.sysid.held import assert_held

TEXT = """\
kind = "equations"
inputs = ["elevator_rad"]
hold = "zoh"
[rates]
alpha_rad = "q_radps + Z_alpha*alpha_rad + Z_de*surface"
q_radps = "M_alpha*alpha_rad + M_q*q_radps + M_de*surface"
surface = "min(max_rate, max(-max_rate, bandwidth*(elevator_rad - surface)))"
[outputs]
alpha_rad = "alpha_rad"
q_radps = "q_radps"
[parameters]
Z_alpha = -2.0
Z_de = -0.1
M_alpha = -30.0
M_q = -3.0
M_de = -35.0
max_rate = { start = 1.5, lower = 0.1 }
bandwidth = { start = 30.0, lower = 3.0, upper = 100.0 }
[starts]
surface = "elevator_rad"
[[delays]]
name = "servo_s"
outputs = ["elevator_rad"]
prior_sd_s = 0.02
"""
TRUTH = [-2.4, -0.18, -38.0, -3.6, -42.0, 0.9, 22.0, 0.04]
FINE = 10


def _record(model: LinearModel, dt_s: float, seed: int, truth: list[float]) -> Maneuver:
    rng, t = np.random.default_rng(seed), np.arange(0.0, 9.0, dt_s / FINE)
    command = np.zeros(len(t))
    for start_s, end_s, size in (
        (2.0, 3.2, 0.8),
        (3.2, 4.0, -1.2),
        (4.0, 4.4, 1.1),
        (4.4, 4.8, -1.1),
    ):
        command[(t > start_s - 1e-6) & (t < end_s - 1e-6)] = 0.08 * size
    fine = Maneuver(dt_s / FINE, command[:, None], np.zeros((len(t), 2)))
    found = output_problem(model, [fine]).outputs(np.array([*truth, 0.0, 0.0, 0.0]))
    assert found is not None
    y = found[0].T[::FINE]
    noise = rng.standard_normal(y.shape) * [0.003, 0.008]
    return Maneuver(dt_s, command[::FINE, None], y + noise)


@pytest.mark.parametrize("late_s", [0.04, 0.03])
def test_two_rates_find_the_servo(late_s: float, tmp_path: Path) -> None:
    """Late by whole samples and by three quarters of one: a quicker servo makes up for a part."""
    path = tmp_path / "servo.toml"
    path.write_text(TEXT, encoding="utf-8")
    model, truth = read_model(path), [*TRUTH[:-1], late_s]
    records = [_record(model, 0.02, 1, truth), _record(model, 0.04, 2, truth)]
    found = fit_output_error(model, records, coloured_noise=False, multiple_starts=False)
    assert found.value("servo_s") == pytest.approx(late_s, abs=0.003)
    assert_held(found, dict(zip(found.names, truth, strict=False)), times=1.5)
