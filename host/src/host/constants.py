"""Numbers that physics, geometry and statistics give, each typed once in the package."""

from __future__ import annotations

import math

# Standard acceleration of free fall: 3rd General Conference on Weights and Measures, 1901.
GRAVITY_MPS2 = 9.80665
DEG_PER_RAD = 180.0 / math.pi
RAD_PER_DEG = math.pi / 180.0
EARTH_RADIUS_M = 6_371_000.0  # mean, of a sphere: Moritz, Geodetic Reference System 1980
METRES_PER_DEG = RAD_PER_DEG * EARTH_RADIUS_M  # of latitude
# Standard deviations to either side of a normal distribution's mean that hold 95 % of it.
NORMAL_95 = 1.96
# 95 % half-width over an estimate, or over what would contribute 5 % of its row: up to the first it
# is trusted, up to the second used with care. Everything that judges a width reads these two.
TRUST_SHARE, CARE_SHARE = 0.10, 0.30
