"""Force and moment coefficients come from rates and accelerations: no angle stands in them."""

import numpy as np
from host.aircraft.mass_properties import airframe_data
from host.aircraft.powerplant import powerplant
from host.arrays import Array
from host.sysid.coefficients import standard_model
from host.sysid.coefficients.aero_equations import KINEMATIC, Equation, FlightHistory, equations
from host.sysid.reconstruction import Record

NAME = "ultrastick25e"

SAMPLES = 64
SIGNALS = (
    "p", "q", "r", "pd", "qd", "rd", "V", "ax", "ay", "az", "qbar", "alpha", "beta",
    "de", "da", "dr",
)  # fmt: skip
ERRORS = (
    "mass_share", "ixx_share", "iyy_share", "izz_share", "thrust_share", "cg_x_m", "cg_y_m",
    "cg_z_m", "density_share",
)  # fmt: skip


def seen_with(phi_rad: Array, theta_rad: Array) -> dict[str, Equation]:
    random = np.random.default_rng(4)
    signals = {name: 1.0 + 0.1 * random.standard_normal(SAMPLES) for name in SIGNALS}
    thrust, spin, drive = (random.standard_normal(SAMPLES) for _ in range(3))
    return equations(
        standard_model(), Record(0.01, dict(signals)), signals, dict.fromkeys(ERRORS, 0.01),
        FlightHistory(
            thrust, spin, drive, phi_rad, theta_rad, signals["V"] - 1.0, signals["V"], (0.0, 0.0)
        ),
        airframe_data(NAME), powerplant(NAME), 0.05,
    ).by_name  # fmt: skip


def test_force_and_moment_equations_hold_no_attitude() -> None:
    t = np.linspace(0.0, 1.0, SAMPLES)
    level, tumbling = seen_with(0.0 * t, 0.0 * t), seen_with(2.0 * t, -1.0 * t)
    for name, equation in level.items():
        same = np.array_equal(equation.response, tumbling[name].response)
        assert same is (name not in KINEMATIC), name
        for term, values in equation.regressors.items():
            np.testing.assert_array_equal(values, tumbling[name].regressors[term])
