"""Truth models of the studies: Nelson's NAVION and the damaged copy of it in table 3.1.

Nelson, Flight Stability and Automatic Control, NAVION at sea level, Mach 0.158 (176 ft/s); the
model is his example with M_wdot folded in, turned from w to alpha and from feet to metres.
"""

from __future__ import annotations

import numpy as np
from host.arrays import Array
from host.sysid.models import LinearModel, Parameter, Term, free_model

FOOT_M = 0.3048
SPEED_FTPS = 176.0
STATES = ("u_mps", "alpha_rad", "q_radps", "theta_rad")
INPUTS = ("elevator_rad",)

# Rows of Nelson's w-form, ft and s: [X_u X_w 0 -g; Z_u Z_w u0 0; M_u M_w M_q 0; 0 0 1 0]
_A_FEET = np.array(
    [
        [-0.045, 0.036, 0.0, -32.2],
        [-0.369, -2.02, SPEED_FTPS, 0.0],
        [0.0019, -0.0396, -2.948, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ]
)
# Z_de = -CL_de qbar S / m; M_de = Cm_de qbar S c / Iy + M_wdot Z_de, of his appendix B
_Z_DE_FTPS2 = -0.355 * 36.8 * 184.0 / (2750.0 / 32.2)
_M_DE = -0.923 * 36.8 * 184.0 * 5.7 / 3000.0 - 0.0051 * _Z_DE_FTPS2
_B_FEET = np.array([[0.0], [_Z_DE_FTPS2], [_M_DE], [0.0]])

# Units of the state: ft/s to m/s, w/u0 to alpha
_TURN = np.diag([FOOT_M, 1.0 / SPEED_FTPS, 1.0, 1.0])

TABLE_31_A = np.array(
    [
        [-0.045, -0.036, 0.0, -30.0],
        [-0.369, -2.02, 1.0, 0.0],
        [0.0019, -0.0396, -20.948, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ]
)
TABLE_31_B = np.array([[0.56], [-0.8], [-0.5], [-0.7]])


def navion() -> tuple[Array, Array]:
    """Return A and B of the NAVION in m/s, rad and rad/s."""
    inverse = np.linalg.inv(_TURN)
    return _TURN @ _A_FEET @ inverse, _TURN @ _B_FEET


def navion_structured() -> LinearModel:
    """Return the model with nine physical derivatives free.

    Kinematics, gravity, and the zeros Nelson states (no X_de, no Z_q) are known.
    """
    A, B = navion()
    free = {
        "X_u": ("A", 0, 0),
        "X_alpha": ("A", 0, 1),
        "Z_u": ("A", 1, 0),
        "Z_alpha": ("A", 1, 1),
        "M_u": ("A", 2, 0),
        "M_alpha": ("A", 2, 1),
        "M_q": ("A", 2, 2),
        "Z_de": ("B", 1, 0),
        "M_de": ("B", 2, 0),
    }
    fixed_A, fixed_B = A.copy(), B.copy()
    parameters = []
    for name, (matrix, row, column) in free.items():
        known = fixed_A if matrix == "A" else fixed_B
        parameters.append(Parameter(name, float(known[row, column])))
        known[row, column] = 0.0
    return LinearModel(
        name="NAVION, structured",
        states=STATES,
        inputs=INPUTS,
        outputs=STATES,
        A=fixed_A,
        B=fixed_B,
        C=np.eye(4),
        D=np.zeros((4, 1)),
        terms=tuple(Term(*place, name) for name, place in free.items()),
        parameters=tuple(parameters),
        initial_states=STATES,
    )


def navion_free() -> LinearModel:
    """Return the model of the original program: A and B free, started at zero."""
    return free_model("NAVION, free", STATES, INPUTS)
