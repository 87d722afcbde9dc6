"""Aircraft of one type, each built a little differently, and what its owner knows of it.

Drawn for each: mass, inertia and CG as built (its file has them within the tolerances), sizes of
tail, fin, ailerons and wing (no file has them). A battery is never twice in the same place.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from host.aircraft.airframe import Airframe
from host.aircraft.file import MEASURED, MEASURED_IF_THERE, Aircraft, load, read_document
from host.aircraft.local_derivatives import local_derivatives
from host.aircraft.trim import solve
from host.instrument.instrument_errors import InstrumentErrors, instrument_errors
from numpy.typing import NDArray

TYPE = "ultrastick25e"
# Standard deviations between aircraft, as shares; of the CG, m.
BUILT = {"mass": 0.04, "inertia": 0.06, "cg": 0.005}
SIZES = {"tail": 0.06, "fin": 0.08, "aileron": 0.06, "wing": 0.03}
BATTERY_M = 0.004  # standard deviation of the CG from flight to flight
# Nine tenths of Cm_q and all of the elevator are the tail's; Cm_q = -2 a_t V_h l/c (Etkin & Reid,
# Dynamics of Flight, 3rd ed., ch. 5), and downwash leaves 0.6 of alpha.
_DOWNWASH_LEAVES = 0.6
_MEMBERS = {
    "tail": ("cl_q", "cl_elevator", "cm_q", "cm_elevator"),
    "fin": ("cy_beta", "cy_r", "cy_rudder", "cn_beta", "cn_r", "cn_rudder"),
    "aileron": ("croll_aileron",),
    "wing": ("cl_alpha", "croll_p", "croll_r"),
}
_OF_AIRCRAFT = ("mass_share", "cg_m", "inertia_share")


@dataclass(frozen=True)
class BuiltAircraft:
    """One aircraft of the type.

    Attributes
    ----------
    plane : Aircraft
        As it is, but for what its file is wrong by.
    document : dict
        Its file: measured on the ground, without aerodynamics.
    """

    plane: Aircraft
    document: dict[str, Any]

    def loaded(self, battery_m: float) -> Aircraft:
        """Return the aircraft with its battery that far from its place, forward positive."""
        cg = self.plane.vector("mass.cg_m") + np.array([battery_m, 0.0, 0.0])
        return replace(self.plane, vectors={**self.plane.vectors, "mass.cg_m": cg})


def built(name: str, rng: np.random.Generator) -> BuiltAircraft:
    """Return an aircraft of the type.

    Parameters
    ----------
    name : str
    rng : numpy Generator
    """
    base = load(TYPE)
    mass, inertia = (1.0 + BUILT[k] * rng.standard_normal() for k in ("mass", "inertia"))
    scalars = dict(base.scalars)
    for key in ("mass_kg", "ixx_kgm2", "iyy_kgm2", "izz_kgm2", "ixz_kgm2"):
        scalars[f"mass.{key}"] *= mass if key == "mass_kg" else mass * inertia
    cg = np.array([BUILT["cg"] * rng.standard_normal(), 0.0, 0.0])
    sizes = {size: float(sd * rng.standard_normal()) for size, sd in SIZES.items()}
    plane = replace(base, scalars=scalars, vectors={**resized(base, sizes), "mass.cg_m": cg})
    document: dict[str, Any] = copy.deepcopy(dict(read_document(TYPE)))
    kept = ("format", "name", "title", *MEASURED, *MEASURED_IF_THERE)
    document = {key: value for key, value in document.items() if key in kept}
    document |= {"kind": "measured", "name": name}
    document["mass"] |= {
        k: scalars[f"mass.{k}"] for k in document["mass"] if k[-2:] in ("kg", "m2")
    }
    document["mass"]["cg_m"] = cg.tolist()
    return BuiltAircraft(plane, document)


def resized(base: Aircraft, sizes: dict[str, float]) -> dict[str, NDArray[np.float64]]:
    """Return the aircraft's tables with surfaces larger by these shares."""
    vectors = {name: v.copy() for name, v in base.vectors.items()}
    arm = base.scalar("geometry.elevator_arm_m") / base.scalar("geometry.chord_m")
    tail = -_DOWNWASH_LEAVES * base.vector("aerodynamics.cm_q") / (2.0 * arm)
    for size, share in sizes.items():
        for name in _MEMBERS[size]:
            vectors[f"aerodynamics.{name}"] *= 1.0 + share
    vectors["aerodynamics.cm_alpha"] -= sizes["tail"] * tail
    vectors["aerodynamics.cl_alpha"] += sizes["tail"] * tail / arm
    return vectors


def fleet_errors(plane: Aircraft) -> InstrumentErrors:
    """Return the errors of an instrument; what an aircraft's file is wrong by stays so."""
    errors = instrument_errors(plane)
    same = {name: replace(errors[name], drawn="instrument") for name in _OF_AIRCRAFT}
    return InstrumentErrors({**errors.named, **same})


def true_derivatives(frame: Airframe) -> dict[str, float]:
    """Return the local derivatives of trimmed flight about the CG of a frame."""
    trim = solve(frame, load(TYPE).scalar("trim.airspeed_mps"))
    at = np.array([trim.alpha_rad, 0.0, 0.0, 0.0, 0.0, *trim.command[:3]])
    return local_derivatives(frame, at)


def population(
    count: int, seed: int, cg_m: tuple[float, float, float]
) -> dict[str, tuple[float, float, float]]:
    """Return of each derivative the type's mean, the spread between aircraft and that between
    flights of one, about a CG; from so many drawn aircraft."""
    rng = np.random.default_rng(seed)
    nominal = load(TYPE).airframe()
    aircraft, flights = [], []
    for _ in range(count):
        frame = built("", rng).plane.airframe()
        aircraft.append(true_derivatives(frame._replace(cg_m=np.array(cg_m))))
        battery = np.array([BATTERY_M * rng.standard_normal(), 0.0, 0.0])
        flights.append(true_derivatives(nominal._replace(cg_m=np.array(cg_m) + battery)))
    return {
        name: (
            float(np.mean([one[name] for one in aircraft])),
            float(np.std([one[name] for one in aircraft])),
            float(np.std([one[name] for one in flights])),
        )
        for name in aircraft[0]
    }
