"""Rigid body, six degrees of freedom, quaternion attitude: forces and their integration.

Stevens & Lewis, Aircraft Control and Simulation, chapter 1 and 2, and EQUATIONS.md, eq. 1 and eq.
2; coefficients as in the aircraft file. Classical Runge-Kutta of fourth order with a fixed step,
commands and air held over the step.
"""

from __future__ import annotations

import math

import numpy as np

from host.aircraft.airframe import (
    AILERON,
    CD_ELEVATOR,
    CL_0,
    CL_ALPHA,
    CL_ELEVATOR,
    CL_Q,
    CM_0,
    CM_ALPHA,
    CM_ELEVATOR,
    CM_Q,
    CN_AILERON,
    CN_BETA,
    CN_P,
    CN_R,
    CN_RUDDER,
    CROLL_AILERON,
    CROLL_BETA,
    CROLL_P,
    CROLL_R,
    CROLL_RUDDER,
    CY_AILERON,
    CY_BETA,
    CY_P,
    CY_R,
    CY_RUDDER,
    DOWN,
    EAST,
    ELEVATOR,
    NORTH,
    Q0,
    Q1,
    Q2,
    Q3,
    ROTOR,
    RUDDER,
    STATE_COUNT,
    Airframe,
    Array,
    P,
    Q,
    R,
    U,
    V,
    W,
)  # fmt: skip
from host.aircraft.propulsion import motor_torque, propeller
from host.compiled import compiled_fast

# Below it coefficients and p_hat have no meaning, and forces go to zero with V^2.
LOWEST_AIRSPEED_MPS = 0.5


@compiled_fast
def place(frame: Airframe, alpha_rad: float) -> tuple[int, int, float]:
    """Return the two table rows around an angle of attack and the share of the second, held
    outside."""
    nodes = frame.alpha_nodes_rad
    count = nodes.shape[0]
    i = 0
    while i < count - 2 and alpha_rad > nodes[i + 1]:
        i += 1
    j = min(i + 1, count - 1)
    share = 0.0
    if j > i:
        share = min(max((alpha_rad - nodes[i]) / (nodes[j] - nodes[i]), 0.0), 1.0)
    return i, j, share


@compiled_fast
def aerodynamics(
    frame: Airframe,
    alpha_rad: float,
    beta_rad: float,
    p_hat: float,
    q_hat: float,
    r_hat: float,
    elevator_rad: float,
    aileron_rad: float,
    rudder_rad: float,
) -> tuple[float, float, float, float, float, float]:
    """Return CL, CD (stability axes), CY (body y), Croll, Cm, Cn (body axes, reference point)."""
    i, j, share = place(frame, alpha_rad)
    a, b = frame.derivatives[i], frame.derivatives[j]
    keep = 1.0 - share
    beyond = max(alpha_rad - frame.stall_alpha_high_rad, 0.0) - max(
        frame.stall_alpha_low_rad - alpha_rad, 0.0
    )
    lift = (
        keep * a[CL_0] + share * b[CL_0]
        + (keep * a[CL_ALPHA] + share * b[CL_ALPHA]) * alpha_rad
        + (keep * a[CL_ELEVATOR] + share * b[CL_ELEVATOR]) * elevator_rad
        - frame.stall_lift_perrad2 * beyond * abs(beyond)
    )  # fmt: skip
    drag = (
        frame.cd_0
        + frame.induced_factor * lift * lift
        + (keep * a[CD_ELEVATOR] + share * b[CD_ELEVATOR]) * elevator_rad
        + frame.stall_drag_perrad2 * beyond * beyond
    )
    side = (
        (keep * a[CY_BETA] + share * b[CY_BETA]) * beta_rad
        + (keep * a[CY_P] + share * b[CY_P]) * p_hat
        + (keep * a[CY_R] + share * b[CY_R]) * r_hat
        + (keep * a[CY_AILERON] + share * b[CY_AILERON]) * aileron_rad
        + (keep * a[CY_RUDDER] + share * b[CY_RUDDER]) * rudder_rad
    )
    roll = (
        (keep * a[CROLL_BETA] + share * b[CROLL_BETA]) * beta_rad
        + (keep * a[CROLL_P] + share * b[CROLL_P]) * p_hat
        + (keep * a[CROLL_R] + share * b[CROLL_R]) * r_hat
        + (keep * a[CROLL_AILERON] + share * b[CROLL_AILERON]) * aileron_rad
        + (keep * a[CROLL_RUDDER] + share * b[CROLL_RUDDER]) * rudder_rad
    )
    pitch = (
        keep * a[CM_0] + share * b[CM_0]
        + (keep * a[CM_ALPHA] + share * b[CM_ALPHA]) * alpha_rad
        + (keep * a[CM_Q] + share * b[CM_Q]) * q_hat
        + (keep * a[CM_ELEVATOR] + share * b[CM_ELEVATOR]) * elevator_rad
    )  # fmt: skip
    yaw = (
        (keep * a[CN_BETA] + share * b[CN_BETA]) * beta_rad
        + (keep * a[CN_P] + share * b[CN_P]) * p_hat
        + (keep * a[CN_R] + share * b[CN_R]) * r_hat
        + (keep * a[CN_AILERON] + share * b[CN_AILERON]) * aileron_rad
        + (keep * a[CN_RUDDER] + share * b[CN_RUDDER]) * rudder_rad
    )
    lift_q = (keep * a[CL_Q] + share * b[CL_Q]) * q_hat
    return lift + lift_q, drag, side, roll, pitch, yaw


@compiled_fast
def rotate_to_body(x: Array, a: float, b: float, c: float) -> tuple[float, float, float]:
    """Turn a vector from north-east-down to body axes by the quaternion in the state."""
    q0, q1, q2, q3 = x[Q0], x[Q1], x[Q2], x[Q3]
    return (
        (q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3) * a
        + 2.0 * (q1 * q2 + q0 * q3) * b
        + 2.0 * (q1 * q3 - q0 * q2) * c,
        2.0 * (q1 * q2 - q0 * q3) * a
        + (q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3) * b
        + 2.0 * (q2 * q3 + q0 * q1) * c,
        2.0 * (q1 * q3 + q0 * q2) * a
        + 2.0 * (q2 * q3 - q0 * q1) * b
        + (q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3) * c,
    )


@compiled_fast
def rotate_to_ned(x: Array, a: float, b: float, c: float) -> tuple[float, float, float]:
    """Turn a vector from body axes to north-east-down."""
    q0, q1, q2, q3 = x[Q0], x[Q1], x[Q2], x[Q3]
    return (
        (q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3) * a
        + 2.0 * (q1 * q2 - q0 * q3) * b
        + 2.0 * (q1 * q3 + q0 * q2) * c,
        2.0 * (q1 * q2 + q0 * q3) * a
        + (q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3) * b
        + 2.0 * (q2 * q3 - q0 * q1) * c,
        2.0 * (q1 * q3 - q0 * q2) * a
        + 2.0 * (q2 * q3 + q0 * q1) * b
        + (q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3) * c,
    )


@compiled_fast
def gust_in_body(x: Array, gust: Array, wind: Array) -> tuple[float, float, float]:
    """Turn a gust along the path through the mean air, to its right and down to body axes.

    The field is frozen (Etkin, Dynamics of Atmospheric Flight, ch. 13): an aircraft that rolls,
    pitches or yaws in it does not turn it.
    """
    north, east, _ = rotate_to_ned(x, x[U], x[V], x[W])
    track = math.atan2(east - wind[1], north - wind[0])
    c, s = math.cos(track), math.sin(track)
    return rotate_to_body(x, c * gust[0] - s * gust[1], s * gust[0] + c * gust[1], gust[2])


@compiled_fast
def derivative(
    frame: Airframe, x: Array, command: Array, air: Array, density_kgpm3: float, out: Array
) -> None:
    """Write the state's time derivative (17,) and behind it specific force at the CG, thrust (21,).

    Parameters
    ----------
    frame : Airframe
    x : (17,) array
        State, `airframe.STATES`.
    command : (4,) array
        `airframe.COMMANDS`.
    air : (9,) array
        Wind north, east, down (m/s); gust u, v, w (m/s) and p, q, r (rad/s) in body axes, as
        motion of the air.
    density_kgpm3 : float
    out : (21,) array
    """
    wind_u, wind_v, wind_w = rotate_to_body(x, air[0], air[1], air[2])
    ua = x[U] - wind_u - air[3]
    va = x[V] - wind_v - air[4]
    wa = x[W] - wind_w - air[5]
    p, q, r = x[P], x[Q], x[R]
    pa, qa, ra = p - air[6], q - air[7], r - air[8]
    speed = math.sqrt(ua * ua + va * va + wa * wa)
    fx = fy = fz = mx = my = mz = thrust = load = 0.0
    hx = frame.rotor_inertia_kgm2 * x[ROTOR] * frame.thrust_axis[0]
    hz = frame.rotor_inertia_kgm2 * x[ROTOR] * frame.thrust_axis[2]
    drive = 0.0
    if frame.free > 0.0 and frame.linear == 0.0:
        drive = motor_torque(frame, command[3], x[ROTOR])
        cx, cy, cz = frame.cg_m[0], frame.cg_m[1], frame.cg_m[2]
        if speed > LOWEST_AIRSPEED_MPS:
            alpha = math.atan2(wa, ua)
            beta = math.asin(va / speed)
            qbar_s = 0.5 * density_kgpm3 * speed * speed * frame.wing_area_m2
            half = 0.5 / speed
            lift, drag, side, roll, pitch, yaw = aerodynamics(
                frame, alpha, beta, pa * frame.span_m * half, qa * frame.chord_m * half,
                ra * frame.span_m * half, x[ELEVATOR], x[AILERON], x[RUDDER],
            )  # fmt: skip
            sa, ca = math.sin(alpha), math.cos(alpha)
            fx = qbar_s * (-drag * ca + lift * sa)
            fy = qbar_s * side
            fz = qbar_s * (-drag * sa - lift * ca)
            # Moments about the CG from those about the reference point: M - cg x F.
            mx = qbar_s * frame.span_m * roll - (cy * fz - cz * fy)
            my = qbar_s * frame.chord_m * pitch - (cz * fx - cx * fz)
            mz = qbar_s * frame.span_m * yaw - (cx * fy - cy * fx)
        ax, az = frame.thrust_axis[0], frame.thrust_axis[2]
        thrust, load = propeller(frame, x[ROTOR], ua * ax + wa * az, density_kgpm3)
        tx, tz = thrust * ax, thrust * az
        lx, ly, lz = frame.hub_m[0] - cx, frame.hub_m[1] - cy, frame.hub_m[2] - cz
        # Minus the motor torque acts on the stator, so on the airframe; the air's acts on the
        # rotor.
        mx += ly * tz - drive * ax
        my += lz * tx - lx * tz
        mz += -ly * tx - drive * az
        fx += tx
        fz += tz
    # Gyroscopic moment of the rotor: - omega x h (EQUATIONS.md, eq. 2).
    mx -= q * hz
    my -= r * hx - p * hz
    mz -= -q * hx

    ixx, iyy, izz, ixz = frame.ixx_kgm2, frame.iyy_kgm2, frame.izz_kgm2, frame.ixz_kgm2
    # Euler's equations with a product of inertia Ixz (EQUATIONS.md, eq. 2).
    ex = mx - (izz - iyy) * q * r + ixz * p * q
    ez = mz - (iyy - ixx) * p * q - ixz * q * r
    det = ixx * izz - ixz * ixz
    out[P] = (izz * ex + ixz * ez) / det
    out[Q] = (my - (ixx - izz) * p * r - ixz * (p * p - r * r)) / iyy
    out[R] = (ixz * ex + ixx * ez) / det
    sx, sy, sz = fx / frame.mass_kg, fy / frame.mass_kg, fz / frame.mass_kg
    if frame.linear > 0.0:
        for k in range(U, R + 1):
            out[k] = (
                frame.steady_force_mps2[k]
                + frame.slopes[k, 0] * (ua - frame.steady[0])
                + frame.slopes[k, 1] * va
                + frame.slopes[k, 2] * (wa - frame.steady[1])
                + frame.slopes[k, 3] * pa
                + frame.slopes[k, 4] * qa
                + frame.slopes[k, 5] * ra
                + frame.controls[k, 0] * (x[ELEVATOR] - frame.steady[2])
                + frame.controls[k, 1] * x[AILERON]
                + frame.controls[k, 2] * x[RUDDER]
                + frame.controls[k, 3] * (command[3] - frame.steady[3])
            )
        sx, sy, sz = out[U], out[V], out[W]
    # EQUATIONS.md, eq. 1.
    gx, gy, gz = rotate_to_body(x, 0.0, 0.0, frame.gravity_mps2)
    out[U] = sx + gx + r * x[V] - q * x[W]
    out[V] = sy + gy + p * x[W] - r * x[U]
    out[W] = sz + gz + q * x[U] - p * x[V]

    # Quaternion kinematics (Stevens & Lewis, ch. 1).
    out[Q0] = 0.5 * (-x[Q1] * p - x[Q2] * q - x[Q3] * r)
    out[Q1] = 0.5 * (x[Q0] * p + x[Q2] * r - x[Q3] * q)
    out[Q2] = 0.5 * (x[Q0] * q - x[Q1] * r + x[Q3] * p)
    out[Q3] = 0.5 * (x[Q0] * r + x[Q1] * q - x[Q2] * p)
    out[NORTH], out[EAST], out[DOWN] = rotate_to_ned(x, x[U], x[V], x[W])

    for k in range(3):
        limit = frame.surface_limit_rad[k]
        target = min(max(command[k], -limit), limit)
        rate = frame.servo_bandwidth_radps * (target - x[ELEVATOR + k])
        out[ELEVATOR + k] = min(max(rate, -frame.servo_rate_radps), frame.servo_rate_radps)
    out[ROTOR] = (drive - load) / frame.rotor_inertia_kgm2
    out[STATE_COUNT] = sx
    out[STATE_COUNT + 1] = sy
    out[STATE_COUNT + 2] = sz
    out[STATE_COUNT + 3] = thrust


@compiled_fast
def step(
    frame: Airframe,
    x: Array,
    command: Array,
    air: Array,
    density_kgpm3: float,
    step_s: float,
    work: Array,
) -> None:
    """Advance the state in place by one step; `work` is (5, 21), row 0 keeps the derivative at
    the start."""
    n = STATE_COUNT
    derivative(frame, x, command, air, density_kgpm3, work[0])
    for i in range(n):
        work[4, i] = x[i] + 0.5 * step_s * work[0, i]
    derivative(frame, work[4], command, air, density_kgpm3, work[1])
    for i in range(n):
        work[4, i] = x[i] + 0.5 * step_s * work[1, i]
    derivative(frame, work[4], command, air, density_kgpm3, work[2])
    for i in range(n):
        work[4, i] = x[i] + step_s * work[2, i]
    derivative(frame, work[4], command, air, density_kgpm3, work[3])
    for i in range(n):
        x[i] += step_s / 6.0 * (work[0, i] + 2.0 * work[1, i] + 2.0 * work[2, i] + work[3, i])
    norm = math.sqrt(x[Q0] ** 2 + x[Q1] ** 2 + x[Q2] ** 2 + x[Q3] ** 2)
    for i in range(Q0, Q3 + 1):
        x[i] /= norm
    x[ROTOR] = max(x[ROTOR], 0.0)


@compiled_fast
def run(
    frame: Airframe,
    start: Array,
    commands: Array,
    air: Array,
    density_kgpm3: float,
    step_s: float,
) -> tuple[Array, Array]:
    """Integrate open loop.

    Parameters
    ----------
    frame : Airframe
    start : (17,) array
    commands : (steps, 4) array
        Held over each step.
    air : (9,) array
        Wind and gust, constant.
    density_kgpm3, step_s : float

    Returns
    -------
    states : (steps + 1, 17) array
    forces : (steps, 4) array
        Specific force x, y, z at the CG (m/s2) and thrust (N) at the start of each step.
    """
    steps = commands.shape[0]
    states = np.empty((steps + 1, STATE_COUNT))
    forces = np.empty((steps, 4))
    x = start.copy()
    work = np.empty((5, STATE_COUNT + 4))
    states[0] = x
    for i in range(steps):
        step(frame, x, commands[i], air, density_kgpm3, step_s, work)
        states[i + 1] = x
        forces[i] = work[0, STATE_COUNT:]
    return states, forces
