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
MEDIAN_TO_SIGMA = 1.4826  # standard deviation of a normal distribution over its median deviation
EVEN_SD = 1.0 / math.sqrt(3.0)  # standard deviation of an even distribution over its half-width
# Weights fall beyond as many deviations; 95 % efficient on normal residuals: Huber, Robust
# Statistics, 1981.
HUBER_LIMIT = 1.345
# Posterior over prior deviation where data and what was known before have the same information, by
# Bayes' rule for normal distributions: below it the data tell.
POSTERIOR_PRIOR_RATIO = math.sqrt(0.5)
CERTAIN_SD = 3.0  # deviations that chance exceeds once in 370 times
SIGNIFICANCE = 0.01  # of a test: how often chance may reject what is right (Fisher's 1 %)
ENTANGLED = 0.9  # correlation of two estimates: what is wrong of one is wrong of both
# Residuals and paths are judged in means over this long: of quicker samples an AR model of low
# order cannot separate slow gusts from white noise, and a trainer moves far below 10 Hz.
BLOCK_S = 0.05
DRIFT_POWERS = 4  # of time, constant to cubic: they take up drift, gusts do not look like them
STEEPEST_SINE = 0.5  # of a path; a steeper one is an error of the velocity down
# 95 % half-width over an estimate, or over what would contribute 5 % of its row: up to the first it
# is trusted, up to the second used with care. Everything that judges a width reads these two.
TRUST_SHARE, CARE_SHARE = 0.10, 0.30
# Share of an equation's largest contribution: a smaller parameter is measured against what would
# contribute as much.
SMALL_SHARE = 0.05
