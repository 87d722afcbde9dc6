"""Flights of the linear Ultra Stick 25e through Dryden gusts, with the coefficients as truth.

The twin's aircraft is linearised at its trim and written as the templates with coefficients for
parameters; gusts are those of the twin (MIL-F-8785C, second order, with rolling and turning air).
Surfaces are held between samples and known exactly; sensors add white noise at the CG.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from host.aircraft import air, trim
from host.aircraft import file as aircraft
from host.aircraft import local_derivatives as local
from host.aircraft.air import Air
from host.aircraft.attitude import euler
from host.aircraft.gains import dimensional_gains
from host.aircraft.linearisation import linearise
from host.aircraft.mass_properties import AirframeData, Condition, airframe_data
from host.arrays import Array
from host.sysid.aerodynamics.coefficient_template import coefficient_template
from host.sysid.models import LinearModel, Maneuver, Trim, template
from host.sysid.models.state_space_model import MATRICES
from host.twin.flight import pilot
from scipy import linalg

from studies.inputs import steps

AIRCRAFT = "ultrastick25e"
HEIGHT_M = 100.0
DT_S = 0.02
DURATION_S = 20.0
FINE = 20  # gust steps per sample: the twin's 1 kHz
PILOT_DELAY_S = 0.26  # of the twin's pilot, in whole samples
# White noise at the CG: two vanes with MA3 encoders, a count of pitot spread by averaging,
# PS-MPU-6000A at its 44 Hz filter, an attitude filter.
NOISE = {
    "airspeed_mps": 0.1,
    "alpha_rad": np.deg2rad(0.085), "beta_rad": np.deg2rad(0.085),
    "p_radps": np.deg2rad(0.05), "q_radps": np.deg2rad(0.05), "r_radps": np.deg2rad(0.05),
    "theta_rad": np.deg2rad(0.2), "phi_rad": np.deg2rad(0.2),
    "ax_mps2": 0.035, "ay_mps2": 0.035, "az_mps2": 0.035,
}  # fmt: skip

UNIT_S = 0.3  # of the 3-2-1-1s: about the short period
ELEVATOR_RAD, AILERON_RAD, RUDDER_RAD = np.deg2rad([3.0, 4.0, 5.0])
AXES = {
    "longitudinal": ("CL_alpha", "Cm_alpha", "Cm_q"),
    "lateral": ("Cl_p", "Cn_beta", "Cn_r"),
}


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Gusts of one axis as the fit's model writes them, noise per root second.

    `length_m` of the gusts across the path, `angle` drives them as an angle, `along_mps` the gusts
    along the path, `roll_radps` the rolling ones.
    """

    length_m: float
    angle: float
    along_mps: float
    roll_radps: float


@dataclass(frozen=True)
class GustyAircraft:
    """The aircraft of the flights.

    Attributes
    ----------
    models : dict
        Per axis the template in coefficients; what thrust adds to it is known.
    truth : dict
        Per axis the values of its parameters.
    airframe : AirframeData
    airspeed_mps : float
    pilot_gain : dict
        Surface per attitude error of the twin's pilot, rad/rad.
    """

    models: dict[str, LinearModel]
    truth: dict[str, Array]
    airframe: AirframeData
    airspeed_mps: float
    pilot_gain: dict[str, float]


@cache
def gusty_aircraft(airspeed_mps: float | None = None) -> GustyAircraft:
    """Return the Ultra Stick 25e at an airspeed, that of its trim without."""
    plane = aircraft.load(AIRCRAFT)
    frame = plane.airframe()
    V = plane.scalar("trim.airspeed_mps") if airspeed_mps is None else airspeed_mps
    steady = trim.solve(frame, V)
    alpha, theta = steady.alpha_rad, float(euler(steady.state[6:10])[1])
    at = np.zeros(8)
    at[0], at[5:] = alpha, steady.command[:3]
    known = local.local_derivatives(frame, at, width_rad=1e-5)
    airframe = airframe_data(AIRCRAFT)
    condition = Condition(V, 0.5 * steady.density_kgpm3 * V**2)
    linear = linearise(frame, steady)
    ca, sa = np.cos(alpha), np.sin(alpha)
    along = np.eye(4)
    along[:2, :2] = [[ca, sa], [-sa / V, ca / V]]  # u, w to V, alpha
    side = np.diag([1.0 / V, 1.0, 1.0, 1.0])  # v to beta
    models, truth = {}, {}
    for axis, A, B, change in (
        ("longitudinal", linear.longitudinal_a, linear.longitudinal_b, along),
        ("lateral", linear.lateral_a, linear.lateral_b, side),
    ):
        base = template(axis, Trim(V, alpha, theta), hold="zoh")
        true_A, true_B = change @ A @ np.linalg.inv(change), change @ B
        base = _with_known_thrust(base, true_A, true_B, known, airframe, condition)
        model = coefficient_template(base, airframe, condition)
        dimensional = dict(
            zip((p.name for p in base.parameters), _entries(base, true_A, true_B), strict=True)
        )
        truth[axis] = np.array(
            [known[p.name] if p.name in known else dimensional[p.name] for p in model.parameters]
        )
        models[axis] = model.with_start(truth[axis])
    bank, pitch = pilot.gains(frame, steady)
    return GustyAircraft(
        models, truth, airframe, V, {"longitudinal": float(pitch), "lateral": float(bank)}
    )


def _entries(base: LinearModel, A: Array, B: Array) -> Array:
    """Return the parameters that give a template these matrices."""
    values = []
    for parameter in base.parameters:
        term = next(t for t in base.terms if t.parameter == parameter.name and t.matrix in "AB")
        whole, fixed = (A, base.A) if term.matrix == "A" else (B, base.B)
        gap = whole[term.row, term.column] - fixed[term.row, term.column]
        values.append(float(gap) / term.gain)
    return np.array(values)


def _with_known_thrust(
    base: LinearModel,
    A: Array,
    B: Array,
    known: Mapping[str, float],
    airframe: AirframeData,
    condition: Condition,
) -> LinearModel:
    """Write into the known part of a template what coefficients do not make up: thrust."""
    gains = dimensional_gains(airframe, condition)
    matrices = {label: np.array(getattr(base, label)) for label in MATRICES}
    for parameter, value in zip(base.parameters, _entries(base, A, B), strict=True):
        made_of = gains.get(parameter.name)
        if made_of is None:
            continue
        rest = value - sum(gain * known[name] for name, gain in made_of.items())
        for term in base.terms:
            if term.parameter == parameter.name:
                matrices[term.matrix][term.row, term.column] += term.gain * rest
    return replace(base, A=matrices["A"], B=matrices["B"], C=matrices["C"], D=matrices["D"])


def spectrum(axis: str, intensity_mps: float) -> Spectrum:
    """Return the twin's gusts as inputs of the model of one axis."""
    plane = gusty_aircraft()
    V, b = plane.airspeed_mps, plane.airframe.span_m
    t = air.turbulence(Air(turbulence_mps=intensity_mps), HEIGHT_M)
    vertical = axis == "longitudinal"
    length, sigma = (t.length_w_m, t.sigma_w_mps) if vertical else (t.length_u_m, t.sigma_u_mps)
    return Spectrum(
        length_m=length,
        angle=sigma / V * float(np.sqrt(V / length)),
        along_mps=t.sigma_u_mps * float(np.sqrt(2.0 * V / t.length_u_m)),
        # MIL-F-8785C, 3.7.5: a first-order lag of the span.
        roll_radps=t.sigma_w_mps
        * float(np.sqrt(0.8 * np.pi / V))
        * (np.pi / (4.0 * b)) ** (1.0 / 6.0)
        / t.length_w_m ** (1.0 / 3.0)
        * (np.pi * V / (4.0 * b)),
    )


def program(axis: str) -> Array:
    """Return the program of the surfaces of one axis, (samples, inputs)."""

    def run(at_s: float, size: float, unit_s: float = UNIT_S) -> Array:
        pattern = [(at_s - 1.0, 0.0)]
        pattern += [(n * unit_s, s * size) for n, s in ((3, 1), (2, -1), (1, 1), (1, -1))]
        return steps(pattern, DT_S, DURATION_S)

    if axis == "longitudinal":
        return run(1.0, ELEVATOR_RAD) - run(7.0, ELEVATOR_RAD) + run(13.0, ELEVATOR_RAD)
    aileron = run(1.0, AILERON_RAD) - run(11.0, AILERON_RAD)
    rudder = run(6.0, RUDDER_RAD, 1.2 * UNIT_S) - run(15.0, RUDDER_RAD, 1.2 * UNIT_S)
    return np.hstack([aileron, rudder])


def gust_signals(intensity_mps: float, rng: np.random.Generator) -> Array:
    """Return motion of the air u v w p q r at 1 kHz over one maneuver, (steps, 6)."""
    plane = gusty_aircraft()
    step = DT_S / FINE
    before, count = round(60.0 / step), round(DURATION_S / step)
    noise = rng.standard_normal((before + count, 4))
    turbulence = air.turbulence(Air(turbulence_mps=intensity_mps), HEIGHT_M)
    moving = air.gusts(turbulence, noise, plane.airspeed_mps, plane.airframe.span_m, step)
    return moving[before:]


def fly(
    axis: str, intensity_mps: float, seeds: Sequence[int], *, with_pilot: bool
) -> list[Maneuver]:
    """Return one maneuver of 20 s per seed, all flown together.

    Parameters
    ----------
    axis : str
        ``longitudinal`` or ``lateral``.
    intensity_mps : float
        Standard deviation of the vertical gust.
    seeds : sequence of int
        Seeds of gusts and sensor noise; a flight does not depend on its neighbours.
    with_pilot : bool
        Whether the twin's pilot corrects bank or pitch on top of the test input.
    """
    plane = gusty_aircraft()
    model, V = plane.models[axis], plane.airspeed_mps
    A, B, C, D = model.matrices(plane.truth[axis])
    n, step = len(model.states), DT_S / FINE
    streams = [np.random.default_rng([20261121, list(AXES).index(axis), k]) for k in seeds]
    moving = np.stack([gust_signals(intensity_mps, rng) for rng in streams], axis=1)
    if axis == "longitudinal":
        acts = {"airspeed_mps": -moving[..., 0], "alpha_rad": -moving[..., 2] / V,
                "q_radps": -moving[..., 4]}  # fmt: skip
    else:
        acts = {"beta_rad": -moving[..., 1] / V, "p_radps": -moving[..., 3],
                "r_radps": -moving[..., 5]}  # fmt: skip
    gust = np.zeros((*moving.shape[:2], n))
    for state, signal in acts.items():
        gust[..., model.states.index(state)] = signal
    block = np.zeros((n + B.shape[1] + n, n + B.shape[1] + n))
    block[:n] = np.hstack([A, B, A - model.A])  # forces feel the air, kinematics do not
    F = linalg.expm(block * step)[:n]
    seen = C - model.C
    for k, state in enumerate(model.states):
        if state in ("airspeed_mps", "alpha_rad", "beta_rad"):
            seen[:, k] = C[:, k]
    test = program(axis)
    attitude = model.states.index("theta_rad" if axis == "longitudinal" else "phi_rad")
    late = round(PILOT_DELAY_S / DT_S)
    x = np.zeros((len(seeds), n))
    samples = len(test)
    states = np.zeros((samples, len(seeds), n))
    inputs = np.repeat(test[:, None, :], len(seeds), axis=1)
    for k in range(samples):
        states[k] = x
        if with_pilot and k >= late:
            inputs[k, :, 0] -= plane.pilot_gain[axis] * states[k - late, :, attitude]
        push = inputs[k] @ F[:, n : n + B.shape[1]].T
        for fine in range(FINE):
            x = x @ F[:, :n].T + push + gust[k * FINE + fine] @ F[:, n + B.shape[1] :].T
    y = states @ C.T + inputs @ D.T + gust[::FINE] @ seen.T
    deviation = np.array([NOISE[name] for name in model.outputs])
    result = []
    for column, (seed, rng) in enumerate(zip(seeds, streams, strict=True)):
        noise = rng.standard_normal(y[:, 0].shape)
        result.append(
            Maneuver(DT_S, inputs[:, column], y[:, column] + deviation * noise,
                     name=f"{axis}, gusts of {intensity_mps} m/s, seed {seed}")
        )  # fmt: skip
    return result
