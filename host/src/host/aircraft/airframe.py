"""The compiled kernels' view of an aircraft: plain numbers, no units beyond SI, no sources."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


# Columns of Airframe.derivatives, in the order of COEFFICIENTS.
COEFFICIENTS = (
    "cl_0", "cl_alpha", "cl_q", "cl_elevator",
    "cm_0", "cm_alpha", "cm_q", "cm_elevator",
    "cd_elevator",
    "cy_beta", "cy_p", "cy_r", "cy_aileron", "cy_rudder",
    "croll_beta", "croll_p", "croll_r", "croll_aileron", "croll_rudder",
    "cn_beta", "cn_p", "cn_r", "cn_aileron", "cn_rudder",
)  # fmt: skip
(
    CL_0, CL_ALPHA, CL_Q, CL_ELEVATOR,
    CM_0, CM_ALPHA, CM_Q, CM_ELEVATOR,
    CD_ELEVATOR,
    CY_BETA, CY_P, CY_R, CY_AILERON, CY_RUDDER,
    CROLL_BETA, CROLL_P, CROLL_R, CROLL_AILERON, CROLL_RUDDER,
    CN_BETA, CN_P, CN_R, CN_AILERON, CN_RUDDER,
) = range(len(COEFFICIENTS))  # fmt: skip

# State of the motion. Velocity is inertial, in body axes; position in north, east, down from the
# launch point.
STATES = (
    "u_mps", "v_mps", "w_mps",
    "p_radps", "q_radps", "r_radps",
    "q0", "q1", "q2", "q3",
    "north_m", "east_m", "down_m",
    "elevator_rad", "aileron_rad", "rudder_rad",
    "rotor_radps",
)  # fmt: skip
U, V, W, P, Q, R, Q0, Q1, Q2, Q3, NORTH, EAST, DOWN, ELEVATOR, AILERON, RUDDER, ROTOR = range(
    len(STATES)
)
STATE_COUNT = len(STATES)

# Commands: what the servos and the speed controller are asked for.
COMMANDS = ("elevator_rad", "aileron_rad", "rudder_rad", "throttle")
COMMAND_COUNT = len(COMMANDS)


NOTHING: Array = np.zeros((1, 1))


class Airframe(NamedTuple):
    """What the equations of motion need to know about one aircraft, as it really is."""

    mass_kg: float
    ixx_kgm2: float
    iyy_kgm2: float
    izz_kgm2: float
    ixz_kgm2: float
    cg_m: Array  # CG from the aerodynamic reference point
    wing_area_m2: float
    span_m: float
    chord_m: float
    alpha_nodes_rad: Array
    derivatives: Array  # (nodes, coefficients)
    cd_0: float
    induced_factor: float
    stall_alpha_low_rad: float
    stall_alpha_high_rad: float
    stall_lift_perrad2: float
    stall_drag_perrad2: float
    propeller_diameter_m: float
    ct_polynomial: Array
    cp_polynomial: Array
    advance_ratio_max: float
    rotor_inertia_kgm2: float
    motor_power_polynomial_w: Array
    motor_torque_max_nm: float
    friction_torque_nm: float
    brake_torque_nm: float
    stopped_drag_area_m2: float
    thrust_axis: Array  # unit vector of positive thrust, body axes
    hub_m: Array  # from the nominal CG
    servo_bandwidth_radps: float
    servo_rate_radps: float
    surface_limit_rad: Array  # elevator, aileron, rudder
    gravity_mps2: float
    free: float  # 0 switches every aerodynamic and propulsive force off
    # A linear aircraft: accelerations of u v w p q r, without gravity and kinematics, as straight
    # lines about a steady flight; 0: coefficients and propeller above.
    linear: float = 0.0
    steady: Array = NOTHING[0]  # u, w (m/s), elevator (rad), throttle
    steady_force_mps2: Array = NOTHING[0]  # (6,)
    slopes: Array = NOTHING  # (6, 6) by u v w p q r
    controls: Array = NOTHING  # (6, 4) by COMMANDS
