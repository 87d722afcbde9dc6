"""Template models of the aircraft's motion about a trim point.

Longitudinal states are airspeed, alpha, q, theta; lateral ones beta, p, r, phi. Forces are
parameters of specific force along the velocity (D_) and normal to it (Z_, divided by the speed).
Accelerometer equations repeat the same parameters with known gains, which helps to estimate them.
Kinematics and gravity are known numbers. Signals are total quantities: each state equation and each
accelerometer has a bias per maneuver, which holds the trim. `imu_sd_m` makes the position of the
accelerometers a parameter with that prior deviation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from host.constants import GRAVITY_MPS2
from host.errors import IdentificationError
from host.sysid.models.residual_delays import delays_of
from host.sysid.models.state_space_model import (
    AccelerometerOffset,
    DelayGroup,
    LinearModel,
    Parameter,
    Term,
)


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


@dataclass(slots=True)
class _Builder:
    """Collector of the entries of a model by signal names."""

    name: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: dict[str, Parameter] = field(default_factory=dict)
    terms: list[Term] = field(default_factory=list)
    known: dict[tuple[str, str, str], float] = field(default_factory=dict)
    accelerometer_offsets: list[AccelerometerOffset] = field(default_factory=list)

    def add(self, name: str, start: float, places: Iterable[tuple[str, str, float]]) -> None:
        """Add a parameter to entries (row, column) with gains; unknown signals are left out."""
        found = []
        for row, column, gain in places:
            place = self._place(row, column)
            if place is not None and gain != 0.0:
                found.append(Term(*place, name, gain))
        if found:
            self.parameters[name] = Parameter(name, start)
            self.terms += found

    def fix(self, row: str, column: str, value: float) -> None:
        """Set a known entry."""
        if self._place(row, column) is not None:
            kind = "rate" if row.endswith("'") else "output"
            self.known[kind, row.rstrip("'"), column] = value

    def _place(self, row: str, column: str) -> tuple[str, int, int] | None:
        rate = row.endswith("'")
        rows = self.states if rate else self.outputs
        label = row.rstrip("'")
        if label not in rows:
            return None
        if column in self.states:
            return "A" if rate else "C", rows.index(label), self.states.index(column)
        if column in self.inputs:
            return "B" if rate else "D", rows.index(label), self.inputs.index(column)
        return None

    def accelerometer_offset(
        self, output: str, state: str, name: str, gain: float, sd_m: float
    ) -> None:
        """Add an accelerometer's offset from its assumed place, with a prior."""
        if sd_m > 0.0 and output in self.outputs and state in self.states:
            self.parameters[name] = Parameter(
                name, 0.0, lower=-3.0 * sd_m, upper=3.0 * sd_m, prior_sd=sd_m
            )
            self.accelerometer_offsets.append(AccelerometerOffset(output, state, name, gain))

    def build(self, *, delays: tuple[DelayGroup, ...], hold: str) -> LinearModel:
        """Return the model; an output with the name of a state measures it."""
        n, m, p = len(self.states), len(self.inputs), len(self.outputs)
        matrices = {
            "A": np.zeros((n, n)),
            "B": np.zeros((n, m)),
            "C": np.zeros((p, n)),
            "D": np.zeros((p, m)),
        }
        for k, state in enumerate(self.states):
            if state in self.outputs:
                matrices["C"][self.outputs.index(state), k] = 1.0
        for (kind, row, column), value in self.known.items():
            place = self._place(row + ("'" if kind == "rate" else ""), column)
            if place is not None:
                matrices[place[0]][place[1], place[2]] = value
        return LinearModel(
            name=self.name,
            states=self.states,
            inputs=self.inputs,
            outputs=self.outputs,
            A=matrices["A"],
            B=matrices["B"],
            C=matrices["C"],
            D=matrices["D"],
            terms=tuple(self.terms),
            parameters=tuple(self.parameters.values()),
            state_biases=self.states,
            output_biases=tuple(y for y in self.outputs if y not in self.states),
            initial_states=self.states,
            delays=delays_of(self.outputs, delays),
            hold=hold,
            accelerometer_offsets=tuple(self.accelerometer_offsets),
        )


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
    model = _Builder(
        "longitudinal",
        outputs,
        inputs,
        (*outputs, "ax_mps2", "az_mps2") if accelerometers else outputs,
    )
    sine, cosine = float(np.sin(trim.alpha_rad)), float(np.cos(trim.alpha_rad))
    if accelerometers:  # without a_z it is negligible beside the known q
        model.add(
            "Z_q",
            -0.1,
            [
                ("alpha_rad'", "q_radps", 1.0),
                ("ax_mps2", "q_radps", -V * sine),
                ("az_mps2", "q_radps", V * cosine),
            ],
        )
    for label, column, along, normal in (
        ("V", "airspeed_mps", -0.1, -2.0 * g / V**2),
        ("alpha", "alpha_rad", -5.0, -5.0),
        ("de", "elevator_rad", 0.0, -0.5),
        ("dt", "throttle", 3.0, 0.0),
    ):
        model.add(
            f"D_{label}",
            along,
            [
                ("airspeed_mps'", column, 1.0),
                ("ax_mps2", column, cosine),
                ("az_mps2", column, sine),
            ],
        )
        if label != "dt":
            model.add(
                f"Z_{label}",
                normal,
                [
                    ("alpha_rad'", column, 1.0),
                    ("ax_mps2", column, -V * sine),
                    ("az_mps2", column, V * cosine),
                ],
            )
    for label, column, start in (
        ("V", "airspeed_mps", 0.0),
        ("alpha", "alpha_rad", -50.0),
        ("q", "q_radps", -8.0),
        ("de", "elevator_rad", -60.0),
        ("dt", "throttle", 0.0),
    ):
        model.add(f"M_{label}", start, [("q_radps'", column, 1.0)])
    model.fix("airspeed_mps'", "theta_rad", -g * float(np.cos(gamma)))
    model.fix("airspeed_mps'", "alpha_rad", g * float(np.cos(gamma)))
    model.fix("alpha_rad'", "q_radps", 1.0)
    model.fix("alpha_rad'", "theta_rad", -g / V * float(np.sin(gamma)))
    model.fix("alpha_rad'", "alpha_rad", g / V * float(np.sin(gamma)))
    model.fix("theta_rad'", "q_radps", 1.0)
    model.accelerometer_offset("ax_mps2", "q_radps", "imu_z_m", 1.0, imu_sd_m)
    model.accelerometer_offset("az_mps2", "q_radps", "imu_x_m", -1.0, imu_sd_m)
    along, normal = g * float(np.sin(gamma)), -g * float(np.cos(gamma))  # of the trim
    model.fix("ax_mps2", "alpha_rad", -(along * sine + normal * cosine))
    model.fix("az_mps2", "alpha_rad", along * cosine - normal * sine)
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
    model = _Builder(
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
    for label, column, start in (
        ("alpha", "alpha_rad", -50.0),
        ("q", "q_radps", -8.0),
        ("de", "elevator_rad", -60.0),
    ):
        model.add(f"M_{label}", start, [("q_radps'", column, 1.0)])
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
    model = _Builder(
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
    model = _Builder(
        "lateral",
        states,
        ("aileron_rad", "rudder_rad") if rudder else ("aileron_rad",),
        (*states, "ay_mps2") if accelerometers else states,
    )
    _side_force(model, trim, with_rates=accelerometers)
    columns = (
        ("beta", "beta_rad"),
        ("p", "p_radps"),
        ("r", "r_radps"),
        ("da", "aileron_rad"),
        ("dr", "rudder_rad"),
    )
    starts = {
        "L": (-30.0, -10.0, 3.0, 100.0, 0.0),
        "N": (15.0, -1.0, -2.0, 0.0, -20.0),
    }
    for axis, row in (("L", "p_radps'"), ("N", "r_radps'")):
        for (label, column), start in zip(columns, starts[axis], strict=True):
            model.add(f"{axis}_{label}", start, [(row, column, 1.0)])
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
    model = _Builder(
        "dutch-roll",
        states,
        ("rudder_rad",),
        (*states, "ay_mps2") if accelerometers else states,
    )
    _side_force(model, trim, with_rates=False)
    for label, column, start in (
        ("beta", "beta_rad", 15.0),
        ("r", "r_radps", -2.0),
        ("dr", "rudder_rad", -20.0),
    ):
        model.add(f"N_{label}", start, [("r_radps'", column, 1.0)])
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
    """Return the one-state roll model, bank angle measured beside the rate."""
    del trim, accelerometers, imu_sd_m
    states = ("p_radps", "phi_rad")
    model = _Builder("roll", states, ("aileron_rad",), states)
    model.add("L_p", -10.0, [("p_radps'", "p_radps", 1.0)])
    model.add("L_da", 100.0, [("p_radps'", "aileron_rad", 1.0)])
    model.fix("phi_rad'", "p_radps", 1.0)
    return model.build(delays=delays, hold=hold)


def _side_force(model: _Builder, trim: Trim, *, with_rates: bool) -> None:
    V = trim.airspeed_mps
    terms = [("beta", "beta_rad", -0.5), ("da", "aileron_rad", 0.0), ("dr", "rudder_rad", 0.3)]
    if with_rates:  # without a_y they are negligible beside the known -cos(alpha) r
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
