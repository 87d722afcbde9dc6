"""A linear aircraft: dimensional matrices about one steady flight, for the equations of motion.

Gravity, attitude and path are those of a rigid body; only the forces and moments of air and motor
are linear. At its steady flight such an aircraft has exactly the A and B it was made from.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from host.aircraft.airframe import Airframe, Array
from host.constants import GRAVITY_MPS2

LONGITUDINAL, LATERAL = (0, 2, 4), (1, 3, 5)  # of u v w p q r


@dataclass(frozen=True, slots=True)
class LinearDynamics:
    """x' = A x + B u about level flight.

    Attributes
    ----------
    u_mps, w_mps : float
        Velocity in steady flight, body axes.
    elevator_rad, throttle : float
        There.
    longitudinal_a, longitudinal_b : (4, 4), (4, 2) arrays
        States u, w, q, theta; inputs elevator, throttle. SI, radians.
    lateral_a, lateral_b : (4, 4), (4, 2) arrays
        States v, p, r, phi; inputs aileron, rudder.
    """

    u_mps: float
    w_mps: float
    elevator_rad: float
    throttle: float
    longitudinal_a: Array
    longitudinal_b: Array
    lateral_a: Array
    lateral_b: Array

    def fitted(self, frame: Airframe) -> Airframe:
        """Return the airframe with these derivatives in place of its coefficients and propeller.

        The equations of motion add gravity and the turning of the axes themselves. So the columns
        of theta and phi are dropped and W0, U0 taken out: u' = X_u u + X_w w + (X_q - W0) q and so
        on.
        """
        slopes, controls = np.zeros((6, 6)), np.zeros((6, 4))
        slopes[np.ix_(LONGITUDINAL, LONGITUDINAL)] = self.longitudinal_a[:3, :3]
        slopes[np.ix_(LATERAL, LATERAL)] = self.lateral_a[:3, :3]
        slopes[0, 4] += self.w_mps
        slopes[2, 4] -= self.u_mps
        slopes[1, 3] -= self.w_mps
        slopes[1, 5] += self.u_mps
        controls[np.ix_(LONGITUDINAL, (0, 3))] = self.longitudinal_b[:3]
        controls[np.ix_(LATERAL, (1, 2))] = self.lateral_b[:3]
        alpha = math.atan2(self.w_mps, self.u_mps)
        lift = GRAVITY_MPS2 * np.array([math.sin(alpha), 0.0, -math.cos(alpha), 0.0, 0.0, 0.0])
        return frame._replace(
            linear=1.0,
            steady=np.array([self.u_mps, self.w_mps, self.elevator_rad, self.throttle]),
            steady_force_mps2=lift,
            slopes=slopes,
            controls=controls,
        )
