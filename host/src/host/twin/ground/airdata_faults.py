"""Faults of vanes and pitots on the ground."""

from __future__ import annotations

import numpy as np

from host.twin.faults import PITOTS, VANES
from host.twin.ground.ground_fault import GroundFault as F
from host.twin.ground.ground_fault import counts, one_of, two_of
from host.twin.ground.ground_walk import STEP_S, GroundWalk


def _vane_slipped(walk: GroundWalk) -> str:
    name = one_of(walk, VANES)
    walk.vane_deg[name] += walk.rng.uniform(7.0, 22.0) * walk.rng.choice((-1.0, 1.0))
    return name


def _vane_sticks(walk: GroundWalk) -> str:
    name = one_of(walk, VANES)
    walk.vane_deg[name] = np.clip(walk.vane_deg[name], -12.0, walk.rng.uniform(8.0, 30.0))
    return name


def _vane_stuck(walk: GroundWalk) -> str:
    name = one_of(walk, VANES)
    walk.vane_deg[name] = np.full_like(walk.vane_deg[name], walk.rng.uniform(-20.0, 20.0))
    return name


def _vane_reversed(walk: GroundWalk) -> str:
    name = one_of(walk, VANES)
    walk.vane_deg[name] *= -1.0
    return name


def _vane_short_travel(walk: GroundWalk) -> str:
    name = one_of(walk, VANES)
    walk.vane_deg[name] *= walk.rng.uniform(0.66, 0.8)
    return name


def _vanes_swapped(walk: GroundWalk) -> str:
    one, other = two_of(walk, VANES)
    vanes = walk.vane_deg
    vanes[one], vanes[other] = vanes[other], vanes[one]
    return min(one, other)


def _pitots_swapped(walk: GroundWalk) -> str:
    walk.blown_pa["a"], walk.blown_pa["b"] = walk.blown_pa["b"], walk.blown_pa["a"]
    return "dp_a"


def _hoses_swapped(walk: GroundWalk) -> str:
    side = one_of(walk, ("a", "b"))
    walk.blown_pa[side] = -walk.blown_pa[side]
    return f"dp_{side}"


def _pitot_leaks(walk: GroundWalk) -> str:
    side = one_of(walk, ("a", "b"))
    tau_s, pressure = walk.rng.uniform(0.6, 2.5), walk.blown_pa[side]
    first = int(np.argmax(pressure >= 0.99 * pressure.max()))
    since_s = np.maximum(np.arange(len(pressure)) - first, 0) * STEP_S
    walk.blown_pa[side] = pressure * np.exp(-since_s / tau_s)
    return f"dp_{side}"


def _pitot_blocked(walk: GroundWalk) -> str:
    side = one_of(walk, ("a", "b"))
    walk.blown_pa[side] = walk.blown_pa[side] * walk.rng.uniform(0.0, 0.05)
    return f"dp_{side}"


def _airspeed_offset(walk: GroundWalk) -> str:
    side = one_of(walk, ("a", "b"))
    walk.blown_pa[side] = walk.blown_pa[side] + walk.rng.uniform(20.0, 90.0) * walk.rng.choice(
        (-1.0, 1.0)
    )
    return "airspeed_rest"


FAULTS: dict[str, F] = {
    "vane_stuck": F("stuck", before=_vane_stuck),
    "vane_sticks": F("sticks", before=_vane_sticks),
    "vane_slipped": F("slipped", before=_vane_slipped),
    "vane_reversed": F("wrong direction", before=_vane_reversed),
    "vane_short_travel": F("travels", before=_vane_short_travel),
    "vanes_swapped": F("swapped", before=_vanes_swapped),
    "vane_open": F("open or shorted", after=counts(4092, VANES)),
    "vane_short": F("open or shorted", after=counts(0, VANES)),
    "pitots_swapped": F("swapped", before=_pitots_swapped),
    "pitot_swapped": F("hoses", before=_hoses_swapped),
    "pitot_leaks": F("leaks", before=_pitot_leaks),
    "pitot_blocked": F("blocked", before=_pitot_blocked),
    "pitot_open": F("open or shorted", after=counts(4092, PITOTS)),
    "pitot_short": F("open or shorted", after=counts(0, PITOTS)),
    "airspeed_offset": F("at rest", before=_airspeed_offset),
}
