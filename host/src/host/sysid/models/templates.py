"""Template models of the aircraft's motion about a trim point.

Longitudinal states are airspeed, alpha, q, theta; lateral ones beta, p, r, phi. Forces are
parameters of specific force along the velocity (D_) and normal to it (Z_, divided by the speed).
Accelerometer equations repeat the same parameters with known gains, which helps to estimate them.
Kinematics and gravity are known numbers. Signals are total quantities: each state equation and each
accelerometer has a bias per maneuver, which holds the trim. `imu_sd_m` makes the position of the
accelerometers a parameter with that prior deviation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from host.constants import GRAVITY_MPS2
from host.errors import IdentificationError
from host.sysid.models.model_builder import ModelBuilder
from host.sysid.models.state_space_model import DelayGroup, LinearModel


@dataclass(frozen=True, slots=True)
class Trim:
    """The condition a template is linearised about: airspeed (m/s), alpha and theta (rad).

    An airspeed of NaN is not known: then there are only templates that need none.
    """

    airspeed_mps: float
    alpha_rad: float = 0.0
    theta_rad: float = 0.0

    def __post_init__(self) -> None:
        if not (np.isnan(self.airspeed_mps) or 0.0 < self.airspeed_mps < np.inf):
            raise IdentificationError(
                f"trim airspeed {self.airspeed_mps:.4g} m/s, expected a positive number"
            )

    @property
    def known(self) -> bool:
        """Whether the airspeed is known."""
        return bool(np.isfinite(self.airspeed_mps))


def longitudinal(
    trim: Trim,
    *,
    accelerometers: bool = True,
    throttle: bool = False,
    imu_sd_m: float = 0.0,
    delays: tuple[DelayGroup, ...] = (),
    hold: str = "foh",
) -> LinearModel:
    """Return the four-state longitudinal model.

    EQUATIONS.md, eq. 7, linearised in wind axes; the accelerometers measure
    a_x = f cos(alpha) - n sin(alpha) and a_z = f sin(alpha) + n cos(alpha), with the specific force
    f along and n normal to the velocity.
    """
    V, g = trim.airspeed_mps, GRAVITY_MPS2
    gamma = trim.theta_rad - trim.alpha_rad
    outputs = ("airspeed_mps", "alpha_rad", "q_radps", "theta_rad")
    inputs = ("elevator_rad", "throttle") if throttle else ("elevator_rad",)
    model = ModelBuilder(
        "longitudinal",
        outputs,
        inputs,
        (*outputs, "ax_mps2", "az_mps2") if accelerometers else outputs,
    )
    sine, cosine = float(np.sin(trim.alpha_rad)), float(np.cos(trim.alpha_rad))
    tangential = (("airspeed_mps'", 1.0), ("ax_mps2", cosine), ("az_mps2", sine))
    normal = (("alpha_rad'", 1.0), ("ax_mps2", -V * sine), ("az_mps2", V * cosine))
    forces = [
        ("Z_q", "q_radps", -0.1, normal),
        ("D_V", "airspeed_mps", -0.1, tangential),
        ("Z_V", "airspeed_mps", -2.0 * g / V**2, normal),
        ("D_alpha", "alpha_rad", -5.0, tangential),
        ("Z_alpha", "alpha_rad", -5.0, normal),
        ("D_de", "elevator_rad", 0.0, tangential),
        ("Z_de", "elevator_rad", -0.5, normal),
        ("D_dt", "throttle", 3.0, tangential),
    ]
    # Without a_z the lift by q is negligible against the known q.
    for name, column, start, rows in forces if accelerometers else forces[1:]:
        model.add(name, start, [(row, column, gain) for row, gain in rows])
    moments = (
        ("V", "airspeed_mps", 0.0),
        ("alpha", "alpha_rad", -50.0),
        ("q", "q_radps", -8.0),
        ("de", "elevator_rad", -60.0),
        ("dt", "throttle", 0.0),
    )
    model.add_row("M", "q_radps'", moments)
    model.fix("airspeed_mps'", "theta_rad", -g * float(np.cos(gamma)))
    model.fix("airspeed_mps'", "alpha_rad", g * float(np.cos(gamma)))
    model.fix("alpha_rad'", "q_radps", 1.0)
    model.fix("alpha_rad'", "theta_rad", -g / V * float(np.sin(gamma)))
    model.fix("alpha_rad'", "alpha_rad", g / V * float(np.sin(gamma)))
    model.fix("theta_rad'", "q_radps", 1.0)
    model.accelerometer_offset("ax_mps2", "q_radps", "imu_z_m", 1.0, imu_sd_m)
    model.accelerometer_offset("az_mps2", "q_radps", "imu_x_m", -1.0, imu_sd_m)
    f, n = g * float(np.sin(gamma)), -g * float(np.cos(gamma))  # of the trim
    model.fix("ax_mps2", "alpha_rad", -(f * sine + n * cosine))
    model.fix("az_mps2", "alpha_rad", f * cosine - n * sine)
    return model.build(delays=delays, hold=hold)


def short_period(
    trim: Trim,
    *,
    accelerometers: bool = True,
    imu_sd_m: float = 0.0,
    delays: tuple[DelayGroup, ...] = (),
    hold: str = "foh",
) -> LinearModel:
    """Return the two-state short-period model at constant speed (EQUATIONS.md, eq. 7)."""
    V = trim.airspeed_mps
    cosine = float(np.cos(trim.alpha_rad))
    states = ("alpha_rad", "q_radps")
    model = ModelBuilder(
        "short-period",
        states,
        ("elevator_rad",),
        (*states, "az_mps2") if accelerometers else states,
    )
    forces = [("alpha", "alpha_rad", -5.0), ("de", "elevator_rad", -0.5)]
    if accelerometers:
        forces.append(("q", "q_radps", -0.1))
    for label, column, start in forces:
        model.add(
            f"Z_{label}", start, [("alpha_rad'", column, 1.0), ("az_mps2", column, V * cosine)]
        )
    moments = (
        ("alpha", "alpha_rad", -50.0),
        ("q", "q_radps", -8.0),
        ("de", "elevator_rad", -60.0),
    )
    model.add_row("M", "q_radps'", moments)
    model.fix("alpha_rad'", "q_radps", 1.0)
    model.fix("az_mps2", "alpha_rad", GRAVITY_MPS2 * float(np.sin(trim.alpha_rad)))
    model.accelerometer_offset("az_mps2", "q_radps", "imu_x_m", -1.0, imu_sd_m)
    return model.build(delays=delays, hold=hold)


def phugoid(
    trim: Trim,
    *,
    accelerometers: bool = False,
    imu_sd_m: float = 0.0,
    delays: tuple[DelayGroup, ...] = (),
    hold: str = "foh",
) -> LinearModel:
    """Return the two-state phugoid model, alpha quasi-steady (EQUATIONS.md, eq. 7)."""
    del accelerometers, imu_sd_m  # in slow motion they measure only gravity
    model = ModelBuilder(
        "phugoid",
        ("airspeed_mps", "theta_rad"),
        ("elevator_rad",),
        ("airspeed_mps", "theta_rad"),
    )
    V = trim.airspeed_mps
    model.add("D_V", -0.1, [("airspeed_mps'", "airspeed_mps", 1.0)])
    model.add("D_de", 0.0, [("airspeed_mps'", "elevator_rad", 1.0)])
    model.add("G_V", 2.0 * GRAVITY_MPS2 / V**2, [("theta_rad'", "airspeed_mps", 1.0)])
    model.add("G_de", 0.0, [("theta_rad'", "elevator_rad", 1.0)])
    model.fix("airspeed_mps'", "theta_rad", -GRAVITY_MPS2)
    return model.build(delays=delays, hold=hold)


def lateral(
    trim: Trim,
    *,
    accelerometers: bool = True,
    rudder: bool = True,
    imu_sd_m: float = 0.0,
    delays: tuple[DelayGroup, ...] = (),
    hold: str = "foh",
) -> LinearModel:
    """Return the four-state lateral model (EQUATIONS.md, eq. 7)."""
    states = ("beta_rad", "p_radps", "r_radps", "phi_rad")
    model = ModelBuilder(
        "lateral",
        states,
        ("aileron_rad", "rudder_rad") if rudder else ("aileron_rad",),
        (*states, "ay_mps2") if accelerometers else states,
    )
    _side_force(model, trim, with_rates=accelerometers)
    moments = (
        ("beta", "beta_rad", -30.0, 15.0),
        ("p", "p_radps", -10.0, -1.0),
        ("r", "r_radps", 3.0, -2.0),
        ("da", "aileron_rad", 100.0, 0.0),
        ("dr", "rudder_rad", 0.0, -20.0),
    )
    model.add_row("L", "p_radps'", [(label, column, start) for label, column, start, _ in moments])
    model.add_row("N", "r_radps'", [(label, column, start) for label, column, _, start in moments])
    model.fix("phi_rad'", "p_radps", 1.0)
    model.fix("phi_rad'", "r_radps", float(np.tan(trim.theta_rad)))
    model.accelerometer_offset("ay_mps2", "p_radps", "imu_z_m", -1.0, imu_sd_m)
    model.accelerometer_offset("ay_mps2", "r_radps", "imu_x_m", 1.0, imu_sd_m)
    return model.build(delays=delays, hold=hold)


def dutch_roll(
    trim: Trim,
    *,
    accelerometers: bool = True,
    imu_sd_m: float = 0.0,
    delays: tuple[DelayGroup, ...] = (),
    hold: str = "foh",
) -> LinearModel:
    """Return the two-state dutch-roll model (wings held level)."""
    states = ("beta_rad", "r_radps")
    model = ModelBuilder(
        "dutch-roll",
        states,
        ("rudder_rad",),
        (*states, "ay_mps2") if accelerometers else states,
    )
    _side_force(model, trim, with_rates=False)
    moments = (("beta", "beta_rad", 15.0), ("r", "r_radps", -2.0), ("dr", "rudder_rad", -20.0))
    model.add_row("N", "r_radps'", moments)
    model.accelerometer_offset("ay_mps2", "r_radps", "imu_x_m", 1.0, imu_sd_m)
    return model.build(delays=delays, hold=hold)


def roll(
    trim: Trim,
    *,
    accelerometers: bool = False,
    imu_sd_m: float = 0.0,
    delays: tuple[DelayGroup, ...] = (),
    hold: str = "foh",
) -> LinearModel:
    """Return the one-state roll model, bank angle measured with the rate."""
    del trim, accelerometers, imu_sd_m
    states = ("p_radps", "phi_rad")
    model = ModelBuilder("roll", states, ("aileron_rad",), states)
    model.add("L_p", -10.0, [("p_radps'", "p_radps", 1.0)])
    model.add("L_da", 100.0, [("p_radps'", "aileron_rad", 1.0)])
    model.fix("phi_rad'", "p_radps", 1.0)
    return model.build(delays=delays, hold=hold)


def _side_force(model: ModelBuilder, trim: Trim, *, with_rates: bool) -> None:
    V = trim.airspeed_mps
    terms = [("beta", "beta_rad", -0.5), ("da", "aileron_rad", 0.0), ("dr", "rudder_rad", 0.3)]
    if with_rates:  # without a_y they are negligible against the known -cos(alpha) r
        terms[1:1] = [("p", "p_radps", 0.0), ("r", "r_radps", 0.0)]
    for label, column, start in terms:
        model.add(f"Y_{label}", start, [("beta_rad'", column, 1.0), ("ay_mps2", column, V)])
    model.fix("beta_rad'", "p_radps", float(np.sin(trim.alpha_rad)))
    model.fix("beta_rad'", "r_radps", -float(np.cos(trim.alpha_rad)))
    model.fix("beta_rad'", "phi_rad", GRAVITY_MPS2 / V * float(np.cos(trim.theta_rad)))


TEMPLATES: dict[str, Callable[..., LinearModel]] = {
    "longitudinal": longitudinal,
    "lateral": lateral,
    "short-period": short_period,
    "phugoid": phugoid,
    "roll": roll,
    "dutch-roll": dutch_roll,
}


# Rates and angles alone: airspeed stands in no equation but those of the accelerometers.
WITHOUT_AIRSPEED = ("short-period", "dutch-roll", "roll")


def template(name: str, trim: Trim, **options: object) -> LinearModel:
    """Return a template by name.

    Raises
    ------
    IdentificationError
        If there is no such template, or it needs an airspeed that is not known.
    """
    if name not in TEMPLATES:
        raise IdentificationError(f"no template '{name}'; there are {', '.join(TEMPLATES)}")
    if not trim.known and name not in WITHOUT_AIRSPEED:
        raise IdentificationError(
            f"{name} needs airspeed_mps, which the data do not have; name its column in a map"
            f" (argument mapping), or fit {', '.join(WITHOUT_AIRSPEED)}"
        )
    return TEMPLATES[name](trim, **options)
