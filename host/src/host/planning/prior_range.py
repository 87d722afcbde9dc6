"""Aircraft drawn from what is known of one before its first flight.

A design that is best for the nominal aircraft may tell little of the one that flies: it is made
for, and judged on, aircraft drawn from the prior's range. How far a coefficient may be off is
said by the 95 % interval that identification wrote with it (`host identify --save-aircraft`),
else by its kind: handbook methods and vortex lattices of conventional aircraft are 10 to 30 % off
(Roskam, Airplane Design, part VI; Klein & Morelli, Aircraft System Identification, ch. 5).
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from host.aircraft.airframe import COEFFICIENTS, Array
from host.aircraft.file import Aircraft
from host.aircraft.linear_dynamics import LinearDynamics
from host.aircraft.prior.prior_table import PriorTable
from host.constants import NORMAL_95
from host.sysid.answer.aircraft_export import AXES, CONTROLS

# One standard deviation, share of the value: by what a coefficient multiplies.
SHARES = {
    "alpha": 0.10, "beta": 0.20, "q": 0.20, "p": 0.15, "r": 0.25,
    "elevator": 0.15, "aileron": 0.15, "rudder": 0.20,
}  # fmt: skip
CROSS_SHARE = 0.30  # of one axis by another: dihedral effect, adverse yaw
CROSS = ("croll_beta", "croll_r", "croll_rudder", "cn_p", "cn_aileron")
MATRIX_SHARE = 0.15  # of an entry of published or identified matrices
LARGEST = 0.6  # no draw changes a sign
_INTERVAL = re.compile(r"identified, .*: ([-+.\deE]+) \+- ([-+.\deE]+) \(95 %\)")


def share(aircraft: Aircraft, name: str) -> float:
    """Return one standard deviation of a coefficient, as a share of its value.

    Parameters
    ----------
    aircraft : Aircraft
    name : str
        As in `host.aircraft.airframe.COEFFICIENTS`.
    """
    said = _INTERVAL.search(aircraft.sources.get(f"aerodynamics.{name}", ""))
    if said is not None and float(said[1]) != 0.0:
        return float(said[2]) / NORMAL_95 / abs(float(said[1]))
    if name in CROSS:
        return CROSS_SHARE
    return SHARES.get(name.partition("_")[2], 0.0)


def random_aircraft(aircraft: Aircraft, seed: int) -> Aircraft:
    """Return an aircraft of the prior's range.

    Parameters
    ----------
    aircraft : Aircraft
    seed : int
    """
    rng = np.random.default_rng([seed, 5])
    if aircraft.straight is not None:
        return replace(aircraft, straight=_random_dynamics(aircraft.straight, rng))
    vectors = dict(aircraft.vectors)
    for name in COEFFICIENTS:
        by = 1.0 + np.clip(share(aircraft, name) * rng.standard_normal(), -LARGEST, LARGEST)
        vectors[f"aerodynamics.{name}"] = by * vectors[f"aerodynamics.{name}"]
    return replace(aircraft, vectors=vectors)


def _random_dynamics(straight: LinearDynamics, rng: np.random.Generator) -> LinearDynamics:
    def moved(matrix: Array) -> Array:
        # Row 2 of pitch, rows 1 and 2 of roll and yaw: moments, which turning axes are not in.
        by = 1.0 + np.clip(MATRIX_SHARE * rng.standard_normal(matrix.shape), -LARGEST, LARGEST)
        by[[0, 3]] = 1.0
        if matrix.shape[1] == 4:
            by[:, 3] = 1.0
        return np.asarray(matrix * by)

    longitudinal = moved(straight.longitudinal_a)
    longitudinal[1] = straight.longitudinal_a[1]
    return replace(
        straight,
        longitudinal_a=longitudinal,
        lateral_a=moved(straight.lateral_a),
        longitudinal_b=moved(straight.longitudinal_b),
        lateral_b=moved(straight.lateral_b),
    )


def with_prior(
    aircraft: Aircraft, prior: PriorTable, alpha_rad: float
) -> tuple[Aircraft, list[str]]:
    """Return the aircraft with coefficients that a vortex lattice or a handbook gave.

    Parameters
    ----------
    aircraft : Aircraft
        With coefficients; keeps what the prior does not say.
    prior : PriorTable
        As `host.aircraft.prior.prior_file.read_prior` reads it.
    alpha_rad : float
        Angle of attack at trim.

    Returns
    -------
    Aircraft, list of str
        And the names that were replaced.
    """
    vectors, replaced = dict(aircraft.vectors), []
    for name, value in prior.at(alpha_rad).items():
        axis, _, label = name.partition("_")
        key = f"aerodynamics.{AXES.get(axis, axis)}_{CONTROLS.get(label, label)}"
        if axis in AXES and key in vectors:
            vectors[key] = np.full_like(vectors[key], value)
            replaced.append(name)
    return replace(aircraft, vectors=vectors), replaced
