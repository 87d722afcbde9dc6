"""Constant coefficients in a flight whose airspeed and attitude vary: departures as inputs.

A linear model holds at one airspeed. Flown, forces follow V^2, damping V, gravity turns with the
attitude and body rates couple. All of that is a product of what was measured and of the model's own
parameters (or of known numbers), so it is written as further inputs: (V^n / V0^n - 1) times the
deviation of the column a parameter acts on, with the parameter's own gain, and what kinematics,
gravity and inertia say beyond their linear part. The model stays linear in its states, its
parameters become those of V0 exactly, and every estimator can fit it.

EQUATIONS.md, eq. 8.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.errors import IdentificationError
from host.sysid.aerodynamics.left_out_terms import LeftOutTerm, acting_terms
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel, Parameter, Term
from host.sysid.models.templates import Trim, template

RATES = ("p_radps", "q_radps", "r_radps")
MEASURED = (
    "airspeed_mps", "alpha_rad", "beta_rad", *RATES, "phi_rad", "theta_rad",
    "ax_mps2", "ay_mps2", "az_mps2",
)  # fmt: skip
# Smoothing of airspeed, whose noise would multiply every term: as long as the data allow. In calm
# air 0.1 s leaves as much of it in N_dr as all other noise together.
SMOOTH_S = (0.05, 0.1, 0.2, 0.4)
# What follows lift, with a parameter of its own: name, row, column, and what multiplies the column.
# Drag is a parabola in lift, of which the template has not that of pitching; dihedral, roll by
# yawing and yaw by rolling follow it (Etkin & Reid, Dynamics of Flight, 3rd ed., app. B).
LIFT_TERMS: dict[str, tuple[tuple[str, str, str, str], ...]] = {
    "longitudinal": (
        ("D_alpha_alpha", "airspeed_mps", "alpha_rad", "alpha"),
        ("D_q", "airspeed_mps", "q_radps", ""),
    ),
    "short-period": (),
    "lateral": (
        ("L_beta_lift", "p_radps", "beta_rad", "lift"),
        ("L_r_lift", "p_radps", "r_radps", "lift"),
        ("N_beta_lift", "r_radps", "beta_rad", "lift"),
        ("N_p_lift", "r_radps", "p_radps", "lift"),
    ),
    "dutch-roll": (),
    "roll": (),
}
# What airspeed does to a motion it is no state of: the propeller's torque does not grow with V^2,
# what holds against it in trim does (left out, Cn_r is 4 % off in still air).
AIRSPEED_TERMS: dict[str, tuple[tuple[str, str], ...]] = {
    "longitudinal": (),
    "short-period": (),
    "lateral": (("Y_V", "beta_rad"), ("L_V", "p_radps"), ("N_V", "r_radps")),
    "dutch-roll": (),
    "roll": (),
}


@dataclass(frozen=True)
class VaryingModel:
    """A template with departures from its linear form among its inputs.

    Attributes
    ----------
    base : LinearModel
        Template, in derivatives or coefficients, without delays.
    axis : str
        Its name.
    trim : Trim
        What the parameters belong to.
    airframe : AirframeData or None
        Inertia, for what rates do to each other; without, that is left out.
    spin_kgm2ps : tuple of float
        Angular momentum of the rotor along x and z.
    left_out : tuple of LeftOutTerm
        Terms of a reduced template, as parameters behind its own.
    thrust : tuple of LeftOutTerm
        What measured thrust does, likewise.
    normal_mps2 : float or None
        Specific force normal to the path that the parameters belong to (`mean_normal`); None: the
        mean of each maneuver.
    """

    base: LinearModel
    axis: str
    trim: Trim
    airframe: AirframeData | None
    spin_kgm2ps: tuple[float, float] = (0.0, 0.0)
    left_out: tuple[LeftOutTerm, ...] = ()
    thrust: tuple[LeftOutTerm, ...] = ()
    normal_mps2: float | None = None

    def __post_init__(self) -> None:
        if self.axis not in LIFT_TERMS:
            raise IdentificationError(
                f"departures of '{self.axis}', known are those of {' and '.join(LIFT_TERMS)}"
            )

    @property
    def scaled(self) -> tuple[tuple[str, int], ...]:
        """Columns that airspeed scales, with the power it does so by."""
        found: list[tuple[str, int]] = []
        for term in self.base.terms:
            key = self._scaling(term)
            if key[1] > 0 and key not in found:
                found.append(key)
        return tuple(found)

    @property
    def added_terms(self) -> tuple[LeftOutTerm, ...]:
        """Terms of measured columns that the template has not."""
        return (*self.left_out, *self.thrust)

    @property
    def forces(self) -> tuple[str, ...]:
        """Outputs that measure a specific force."""
        return tuple(y for y in self.base.outputs if y in MEASURED[-3:])

    @property
    def model(self) -> LinearModel:
        """The template with the departures as inputs, its own parameters first."""
        base, scaled = self.base, self.scaled
        by_lift, airspeed = LIFT_TERMS[self.axis], AIRSPEED_TERMS[self.axis]
        n, m, p = len(base.states), len(base.inputs), len(base.outputs)
        terms = list(base.terms)
        for term in base.terms:
            key = self._scaling(term)
            if key[1] > 0:
                matrix = "B" if term.matrix in "AB" else "D"
                place = m + scaled.index(key)
                terms.append(Term(matrix, term.row, place, term.parameter, term.gain))
        rests = m + len(scaled) + n + len(self.forces)
        first = rests + len(by_lift) + (len(airspeed) > 0)
        size = first + len(self.added_terms)
        B, D = np.zeros((n, size)), np.zeros((p, size))
        B[:, :m], D[:, :m] = base.B, base.D
        B[:, m + len(scaled) : m + len(scaled) + n] = np.eye(n)
        for k, force in enumerate(self.forces):
            D[base.outputs.index(force), m + len(scaled) + n + k] = 1.0
        for k, (name, row, _, _) in enumerate(by_lift):
            terms += acting_terms(base, self.trim, name, row, rests + k)
        for name, row in airspeed:
            terms += acting_terms(base, self.trim, name, row, first - 1)
        for k, extra in enumerate(self.added_terms):
            terms += acting_terms(base, self.trim, extra.name, extra.row, first + k, extra.gain)
        return replace(
            base,
            name=f"{base.name}, airspeed varying",
            inputs=self._input_names(),
            B=B,
            D=D,
            terms=tuple(terms),
            parameters=(
                *base.parameters,
                *(Parameter(name) for name, _, _, _ in by_lift),
                *(Parameter(name) for name, _ in airspeed),
                *(Parameter(t.name) for t in self.added_terms),
            ),
        )

    def _input_names(self) -> tuple[str, ...]:
        """Return the names of the columns of `maneuver`, in their order."""
        base = self.base
        return (
            *base.inputs,
            *(f"{column} by V^{power}" for column, power in self.scaled),
            *(f"rest of {name}" for name in (*base.states, *self.forces)),
            *(
                f"{column} by {by} on {row}" if by else f"{column} on {row}"
                for _, row, column, by in LIFT_TERMS[self.axis]
            ),
            *(("airspeed over its trim",) if AIRSPEED_TERMS[self.axis] else ()),
            *(t.input_name for t in self.added_terms),
        )

    def _moving(self, values: Array) -> Array:
        """Return an input between its samples: its mean, held; on a line what a reduced template
        leaves out, for half a sample of that puts N_r 2 % off."""
        on_line = bool(self.left_out) and self.base.hold == "foh"
        return values if on_line else _neighbour_means(values)

    def maneuver(
        self, columns: Mapping[str, Array], dt_s: float, name: str = "maneuver"
    ) -> Maneuver:
        """Return the samples of one maneuver in the columns of `model`.

        Parameters
        ----------
        columns : mapping
            SI, each (samples,): surfaces, airspeed, flow angles, rates, bank, pitch, specific
            forces at the CG.
        dt_s : float
        name : str

        Raises
        ------
        IdentificationError
            If a column is missing.
        """
        missing = [c for c in (*MEASURED, *self.base.inputs) if c not in columns]
        if missing:
            raise IdentificationError(f"{name}: departures need {', '.join(missing)}")
        ratio = _without_noise(columns["airspeed_mps"], dt_s) / self.trim.airspeed_mps
        inputs = [columns[c] for c in self.base.inputs]
        inputs += self._scaled_columns(columns, ratio)
        inputs += [self._moving(_deviation(rest)) for rest in self._nonlinear_rates(columns, ratio)]
        inputs += [_deviation(rest) for rest in self._nonlinear_forces(columns, ratio)]
        inputs += self._lift_columns(columns, ratio, dt_s)
        if AIRSPEED_TERMS[self.axis]:
            inputs.append(self._moving(ratio - 1.0))
        inputs += [self._moving(_deviation(columns[t.column])) for t in self.added_terms]
        outputs = np.column_stack([columns[y] for y in self.base.outputs])
        return Maneuver(dt_s, np.column_stack(inputs), outputs, name=name)

    def _scaled_columns(self, columns: Mapping[str, Array], ratio: Array) -> list[Array]:
        """Return what airspeed changes of each column whose effect grows with it."""
        found = []
        for column, power in self.scaled:
            change = (ratio**power - 1.0) * _deviation(columns[column])
            found.append(change if column in self.base.inputs else self._moving(change))
        return found

    def _lift_columns(self, columns: Mapping[str, Array], ratio: Array, dt_s: float) -> list[Array]:
        """Return what lift changes of each column whose effect follows it."""
        found = []
        for _, _, column, by in LIFT_TERMS[self.axis]:
            own = _deviation(columns[column])
            if by == "lift":
                power = 1 if column in RATES else 2
                own = own * ratio**power * self._change_of_lift(columns, ratio, dt_s)
            elif by == "alpha":
                own = own * _deviation(columns["alpha_rad"])
            found.append(self._moving(_deviation(own)))
        return found

    def _change_of_lift(self, columns: Mapping[str, Array], ratio: Array, dt_s: float) -> Array:
        """Return the lift coefficient over that of the trim, less one."""
        normal = _without_noise(_normal(columns), dt_s) / ratio**2
        own = float(np.mean(normal))
        return normal / (own if self.normal_mps2 is None else self.normal_mps2) - 1.0

    def _known(self) -> Array:
        """Return kinematics and gravity of the template."""
        return template(self.axis, self.trim, hold=self.base.hold).A

    def _scaling(self, term: Term) -> tuple[str, int]:
        """Return the column a term acts on and the power of V it grows with beyond constant."""
        base = self.base
        column = (base.states if term.matrix in "AC" else base.inputs)[term.column]
        if column == "airspeed_mps":
            return column, 0
        power = 1 if column in RATES else 2
        turning = term.matrix in "AB" and base.states[term.row] in ("alpha_rad", "beta_rad")
        return column, power - 1 if turning else power

    def _nonlinear_rates(self, columns: Mapping[str, Array], ratio: Array) -> list[Array]:
        """Return, per state, what its rate has beyond aerodynamics and the linear kinematics."""
        whole = self._kinematics(columns, self.trim.airspeed_mps * ratio)
        known = self._known()
        states = np.column_stack([columns[s] for s in self.base.states])
        return [whole[s] - states @ known[k] for k, s in enumerate(self.base.states)]

    def _kinematics(self, columns: Mapping[str, Array], airspeed: Array) -> dict[str, Array]:
        alpha, beta, phi, theta = (
            columns[c] for c in ("alpha_rad", "beta_rad", "phi_rad", "theta_rad")
        )
        p, q, r = (columns[c] for c in RATES)
        ax, az = columns["ax_mps2"], columns["az_mps2"]
        sa, ca, sb, cb = np.sin(alpha), np.cos(alpha), np.sin(beta), np.cos(beta)
        gx = -GRAVITY_MPS2 * np.sin(theta)
        gy = GRAVITY_MPS2 * np.cos(theta) * np.sin(phi)
        gz = GRAVITY_MPS2 * np.cos(theta) * np.cos(phi)
        # The linear model has the lift of its trim by V^2; this maneuver's turns the path by V.
        ratio = airspeed / self.trim.airspeed_mps
        own = np.mean((az * ca - ax * sa) / ratio**2)
        lift = (own - 2.0 * self._lift_by_airspeed) * (ratio - 1.0)
        turning = q * np.sin(phi) + r * np.cos(phi)
        return {
            "airspeed_mps": (gx * ca + gz * sa) * cb + gy * sb,
            "alpha_rad": lift / self.trim.airspeed_mps
            + (gz * ca - gx * sa) / (airspeed * cb)
            + q
            - np.tan(beta) * (p * ca + r * sa),
            "theta_rad": q * np.cos(phi) - r * np.sin(phi),
            "beta_rad": (gy * cb - sb * ((ax + gx) * ca + (az + gz) * sa)) / airspeed
            + p * sa
            - r * ca,
            "phi_rad": p + np.tan(theta) * turning,
            **self._inertial(p, q, r),
        }

    @property
    def _trim_lift(self) -> float:
        """Specific force normal to the path in the steady flight that the template is about."""
        return -GRAVITY_MPS2 * float(np.cos(self.trim.theta_rad - self.trim.alpha_rad))

    @property
    def _lift_by_airspeed(self) -> float:
        """Return the lift whose change by airspeed the template has: none without that state."""
        return self._trim_lift if "airspeed_mps" in self.base.states else 0.0

    def _inertial(self, p: Array, q: Array, r: Array) -> dict[str, Array]:
        """Return angular accelerations that rates and the rotor make."""
        a, (hx, hz) = self.airframe, self.spin_kgm2ps
        if a is None:
            return dict.fromkeys(RATES, np.zeros(len(p)))
        x = -(a.izz_kgm2 - a.iyy_kgm2) * q * r + a.ixz_kgm2 * p * q - q * hz
        y = (a.izz_kgm2 - a.ixx_kgm2) * p * r - a.ixz_kgm2 * (p**2 - r**2) - r * hx + p * hz
        z = -(a.iyy_kgm2 - a.ixx_kgm2) * p * q - a.ixz_kgm2 * q * r + q * hx
        det = a.ixx_kgm2 * a.izz_kgm2 - a.ixz_kgm2**2
        return {
            "p_radps": (a.izz_kgm2 * x + a.ixz_kgm2 * z) / det,
            "q_radps": y / a.iyy_kgm2,
            "r_radps": (a.ixz_kgm2 * x + a.ixx_kgm2 * z) / det,
        }

    def _nonlinear_forces(self, columns: Mapping[str, Array], ratio: Array) -> list[Array]:
        """Return, per specific force, its second order in airspeed and in the turning of lift."""
        alpha, ax, az = columns["alpha_rad"], columns["ax_mps2"], columns["az_mps2"]
        along = ax * np.cos(alpha) + az * np.sin(alpha)
        normal = az * np.cos(alpha) - ax * np.sin(alpha)
        # ax = along cos - normal sin, az = along sin + normal cos, to second order; the mean lift
        # turned by half a squared angle is 0.04 m/s2 at 5 degrees.
        angle, f, n = _deviation(alpha), _deviation(along), _deviation(normal)
        sine, cosine = np.sin(self.trim.alpha_rad), np.cos(self.trim.alpha_rad)
        bent = -0.5 * angle**2
        f0, n0 = np.mean(along), np.mean(normal)
        by_rotation = {
            "ax_mps2": -angle * (cosine * n + sine * f) + bent * (cosine * f0 - sine * n0),
            "az_mps2": angle * (cosine * f - sine * n) + bent * (sine * f0 + cosine * n0),
        }
        # A maneuver flown faster than the trim has its lift by less angle of attack, and so less of
        # it by airspeed; left out, az has 5 times its noise along the inputs in calm air.
        own = np.mean(normal / ratio**2) - self._lift_by_airspeed
        by_airspeed = {"ax_mps2": -2.0 * own * sine, "az_mps2": 2.0 * own * cosine}
        return [
            (ratio - 1.0) ** 2 * np.mean(columns[y])
            + (ratio - 1.0) * by_airspeed.get(y, 0.0)
            + by_rotation.get(y, 0.0)
            for y in self.forces
        ]


def mean_normal(cuts: Sequence[Mapping[str, Array]], trim: Trim) -> float:
    """Return the mean specific force normal to the path at the airspeed of a trim, m/s2.

    Parameters
    ----------
    cuts : sequence of mapping
        All columns of each maneuver.
    trim : Trim
    """
    normal = np.concatenate([_normal(c) for c in cuts])
    airspeed = np.concatenate([c["airspeed_mps"] for c in cuts])
    return float(np.mean(normal) * trim.airspeed_mps**2 / np.mean(airspeed**2))


def _normal(columns: Mapping[str, Array]) -> Array:
    alpha = columns["alpha_rad"]
    return np.asarray(columns["az_mps2"] * np.cos(alpha) - columns["ax_mps2"] * np.sin(alpha))


def _without_noise(values: Array, dt_s: float) -> Array:
    """Return values under the bell of `SMOOTH_S` that predicts each best from all others.

    Leave-one-out errors are those of the fit over one less the weight of a value in its own mean
    (Stone, J. R. Statist. Soc. B 36, 1974).
    """
    smoothed, error = [], []
    for width_s in SMOOTH_S:
        bell = _bell(width_s / dt_s)
        reach = len(bell) // 2
        smoothed.append(np.convolve(np.pad(values, reach, mode="edge"), bell, mode="valid"))
        error.append(float(np.mean((values - smoothed[-1]) ** 2)) / (1.0 - bell[reach]) ** 2)
    return np.asarray(smoothed[int(np.argmin(error))])


def _bell(samples: float) -> Array:
    """Return weights of a normal curve of this deviation; importing scipy for it takes 0.04 s."""
    reach = int(4.0 * samples + 0.5)
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / samples) ** 2)
    return np.asarray(bell / np.sum(bell))


def _deviation(values: Array) -> Array:
    return np.asarray(values - np.mean(values), dtype=np.float64)


def _neighbour_means(values: Array) -> Array:
    """Return means of neighbours: an input is held over the sample that follows it."""
    result = np.array(values, dtype=np.float64)
    result[:-1] = 0.5 * (values[:-1] + values[1:])
    return result
