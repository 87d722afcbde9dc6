"""Flights of the non-linear Ultra Stick 25e through the gusts of `gusts`: the same cases, flown.

The twin's own equations of motion with all three gust components, rolling and turning air, the
propeller and its spin, coefficients that depend on the angle of attack. Program, rates, pilot and
sensor noise are those of the linear flights, sensors sit at the CG, surfaces are exact. The axis
under test is open loop or with the pilot; the other axis is the pilot's in either case, or the
aircraft would be on its back after twenty seconds. Airspeed varies by several percent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from host.aircraft import air, trim
from host.aircraft import file as aircraft
from host.aircraft import local_derivatives as local
from host.aircraft.air import Air, gust_step
from host.aircraft.airframe import (
    AILERON,
    ELEVATOR,
    Q0,
    ROTOR,
    RUDDER,
    STATE_COUNT,
    Airframe,
    Array,
    P,
    Q,
    R,
)
from host.aircraft.attitude import euler
from host.aircraft.rigid_body import derivative, gust_in_body, step
from host.compiled import compiled_fast
from host.sysid.aerodynamics.varying_airspeed import VaryingModel
from host.sysid.models import Maneuver, Trim
from host.twin.flight import pilot

from studies.gusts import (
    AIRCRAFT,
    AXES,
    DT_S,
    DURATION_S,
    FINE,
    HEIGHT_M,
    NOISE,
    PILOT_DELAY_S,
    gusty_aircraft,
    program,
)

BEFORE_S = 60.0  # of gusts, before the aircraft meets them
TRUTH_EVERY = 10  # samples between two looks at the local derivatives


@dataclass(frozen=True)
class NonlinearFlight:
    """One maneuver, its mean airspeed as measured, and the derivatives that are its truth.

    Those are the mean of the local ones along the flight.
    """

    maneuver: Maneuver
    airspeed_mps: float
    columns: dict[str, Array]
    truth: dict[str, float]


@cache
def _steady() -> tuple[Airframe, trim.Trim]:
    plane = aircraft.load(AIRCRAFT)
    frame = plane.airframe()
    return frame, trim.solve(frame, plane.scalar("trim.airspeed_mps"))


@cache
def varying(axis: str, airspeed_mps: float | None = None) -> VaryingModel:
    """Return the model of one axis with the departures a flight has from it.

    Parameters
    ----------
    axis : str
    airspeed_mps : float, optional
        Where departures are none: the nearer to the flight's mean the less they leave to the terms
        of second order. That of the trim without.
    """
    frame, steady = _steady()
    if airspeed_mps is not None:
        steady = trim.solve(frame, airspeed_mps)
    plane = gusty_aircraft(airspeed_mps)
    spin = frame.rotor_inertia_kgm2 * float(steady.state[ROTOR])
    theta = float(euler(steady.state[Q0 : Q0 + 4])[1])
    return VaryingModel(
        plane.models[axis],
        axis,
        Trim(plane.airspeed_mps, steady.alpha_rad, theta),
        plane.airframe,
        (spin * float(frame.thrust_axis[0]), spin * float(frame.thrust_axis[2])),
    )


@compiled_fast
def _advance(
    frame: Airframe,
    gusts: air.Turbulence,
    x: Array,
    filters: Array,
    moving: Array,
    command: Array,
    noise: Array,
    density_kgpm3: float,
    step_s: float,
    work: Array,
) -> None:
    """Fly one sample, its commands held; `noise` has a row per step."""
    gust = np.empty(6)
    for k in range(noise.shape[0]):
        u, v, w = x[0] - moving[3], x[1] - moving[4], x[2] - moving[5]
        speed = np.sqrt(u * u + v * v + w * w)
        step(frame, x, command, moving, density_kgpm3, step_s, work)
        gust_step(gusts, filters, noise[k], speed, frame.span_m, step_s, gust)
        moving[3], moving[4], moving[5] = gust_in_body(x, gust, moving)
        moving[6:] = gust[3:]


def _fly(
    axis: str, intensity_mps: float, rng: np.random.Generator, *, with_pilot: bool
) -> tuple[Array, Array, Array]:
    """Return states, motion of the air and specific forces (samples, ...) of one maneuver."""
    frame, steady = _steady()
    gusts = air.turbulence(Air(turbulence_mps=intensity_mps), HEIGHT_M)
    step_s, samples = DT_S / FINE, round(DURATION_S / DT_S)
    filters, moving, work = np.zeros(air.GUST_STATES), np.zeros(9), np.zeros((5, STATE_COUNT + 4))
    for row in rng.standard_normal((round(BEFORE_S / step_s), 4)):
        gust_step(gusts, filters, row, steady.airspeed_mps, frame.span_m, step_s, moving[3:])
    moving[3:6] = gust_in_body(steady.state, moving[3:6].copy(), moving)
    noise = rng.standard_normal((samples, FINE, 4))
    test, late = program(axis), round(PILOT_DELAY_S / DT_S)
    bank_gain, pitch_gain = pilot.gains(frame, steady)
    rest = euler(steady.state[Q0 : Q0 + 4])
    states, airs = np.zeros((samples, STATE_COUNT)), np.zeros((samples, 9))
    forces, out = np.zeros((samples, 3)), np.empty(STATE_COUNT + 4)
    x = steady.state.copy()
    for k in range(samples):
        command = steady.command.copy()
        if axis == "longitudinal":
            command[0] += test[k, 0]
        else:
            command[1:3] += test[k]
        if k >= late:
            phi, theta, _ = euler(states[k - late, Q0 : Q0 + 4])
            if with_pilot or axis == "lateral":
                command[0] -= pitch_gain * (theta - rest[1])
            if with_pilot or axis == "longitudinal":
                command[1] -= bank_gain * (phi - rest[0])
        x[ELEVATOR : RUDDER + 1] = command[:3]
        derivative(frame, x, command, moving, steady.density_kgpm3, out)
        states[k], airs[k], forces[k] = x, moving, out[STATE_COUNT : STATE_COUNT + 3]
        _advance(
            frame, gusts, x, filters, moving, command, noise[k], steady.density_kgpm3, step_s, work
        )
    return states, airs, forces


def _columns(states: Array, airs: Array, forces: Array) -> dict[str, Array]:
    flow = states[:, :3] - airs[:, 3:6]
    airspeed = np.linalg.norm(flow, axis=1)
    phi, theta, _ = euler(states[:, Q0 : Q0 + 4])
    return {
        "airspeed_mps": airspeed,
        "alpha_rad": np.arctan2(flow[:, 2], flow[:, 0]),
        "beta_rad": np.arcsin(flow[:, 1] / airspeed),
        "p_radps": states[:, P],
        "q_radps": states[:, Q],
        "r_radps": states[:, R],
        "phi_rad": phi,
        "theta_rad": theta,
        "ax_mps2": forces[:, 0],
        "ay_mps2": forces[:, 1],
        "az_mps2": forces[:, 2],
        "elevator_rad": states[:, ELEVATOR],
        "aileron_rad": states[:, AILERON],
        "rudder_rad": states[:, RUDDER],
    }


def _truth(columns: dict[str, Array]) -> dict[str, float]:
    """Return the mean along the flight of the local derivatives: the tables bend in alpha."""
    frame, _ = _steady()
    c = {name: values[::TRUTH_EVERY] for name, values in columns.items()}
    half = 0.5 / c["airspeed_mps"]
    at = np.column_stack(
        [
            c["alpha_rad"],
            c["beta_rad"],
            c["p_radps"] * frame.span_m * half,
            c["q_radps"] * frame.chord_m * half,
            c["r_radps"] * frame.span_m * half,
            *(c[name] for name in ("elevator_rad", "aileron_rad", "rudder_rad")),
        ]
    )
    found = [local.local_derivatives(frame, row, width_rad=1e-3) for row in at]
    return {name: float(np.mean([f[name] for f in found])) for name in found[0]}


def fly_nonlinear(
    axis: str, intensity_mps: float, seeds: Sequence[int], *, with_pilot: bool
) -> list[NonlinearFlight]:
    """Return one maneuver of 20 s per seed.

    Parameters
    ----------
    axis : str
        ``longitudinal`` or ``lateral``.
    intensity_mps : float
        Standard deviation of the vertical gust.
    seeds : sequence of int
        Seeds of gusts and sensor noise.
    with_pilot : bool
        Whether the pilot corrects bank or pitch of the axis under test too.
    """
    result = []
    for seed in seeds:
        rng = np.random.default_rng([20261122, list(AXES).index(axis), seed])
        columns = _columns(*_fly(axis, intensity_mps, rng, with_pilot=with_pilot))
        truth = _truth(columns)
        for name, deviation in NOISE.items():
            columns[name] = columns[name] + deviation * rng.standard_normal(len(columns[name]))
        label = f"{axis}, gusts of {intensity_mps} m/s, seed {seed}"
        mean = float(np.mean(columns["airspeed_mps"]))
        maneuver = varying(axis, mean).maneuver(columns, DT_S, label)
        result.append(NonlinearFlight(maneuver, mean, columns, truth))
    return result
