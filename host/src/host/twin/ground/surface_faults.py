"""Faults of surfaces, their channels and pots on the ground."""

from __future__ import annotations

from host.twin.faults import POTS
from host.twin.ground.ground_fault import GroundFault as F
from host.twin.ground.ground_fault import counts, item_of_pot, one_of, two_of
from host.twin.ground.ground_instrument import GroundFrames
from host.twin.ground.ground_walk import SURFACES, GroundWalk
from host.twin.sensors.analog import nominal


def _surface_reversed(walk: GroundWalk) -> str:
    surface = one_of(walk, SURFACES)
    walk.surface_share[surface] *= -1.0
    return surface


def _channel_reversed(walk: GroundWalk) -> str:
    surface = one_of(walk, SURFACES)
    walk.stick[surface] = -walk.stick[surface]
    return surface


def _half_travel(walk: GroundWalk) -> str:
    surface = one_of(walk, SURFACES)
    walk.surface_share[surface] *= walk.rng.uniform(0.4, 0.7)
    return surface


def _dual_rate(walk: GroundWalk) -> str:
    surface = one_of(walk, SURFACES)
    walk.stick[surface] = walk.stick[surface] * walk.rng.uniform(0.42, 0.58)
    return surface


def _channels_swapped(walk: GroundWalk) -> str:
    one, other = two_of(walk, SURFACES)
    walk.stick[one], walk.stick[other] = walk.stick[other], walk.stick[one]
    return min(one, other, key=SURFACES.index)


def _surface_dead(walk: GroundWalk) -> str:
    surface = one_of(walk, SURFACES)
    walk.surface_share[surface] *= walk.rng.uniform(0.0, 0.1)
    return surface


def _pot_stuck(walk: GroundWalk, frames: GroundFrames) -> str:
    name = one_of(walk, POTS)
    frames.ident[name] = frames.ident[name][0]
    return item_of_pot(name)


def _pots_swapped(walk: GroundWalk, frames: GroundFrames) -> str:
    one, other = two_of(walk, tuple(name for name in POTS if name != "pot_aileron_right"))
    ident = frames.ident
    ident[one], ident[other] = ident[other].copy(), ident[one].copy()
    return min(item_of_pot(one), item_of_pot(other), key=SURFACES.index)


def _pot_reversed(walk: GroundWalk, frames: GroundFrames) -> str:
    name = one_of(walk, POTS)
    frames.ident[name] = 8 * round(nominal()[name][0]) - frames.ident[name]
    return item_of_pot(name)


FAULTS: dict[str, F] = {
    "surface_reversed": F("against its stick", before=_surface_reversed),
    "channel_reversed": F("reverse the channel", before=_channel_reversed),
    "half_travel": F("travel", before=_half_travel),
    "dual_rate": F("dual rate", before=_dual_rate),
    "channels_swapped": F("swapped", before=_channels_swapped),
    "surface_dead": F("hardly did", before=_surface_dead),
    "pot_stuck": F("dead", after=_pot_stuck),
    "pot_open": F("open or shorted", after=counts(4092, POTS)),
    "pot_short": F("open or shorted", after=counts(0, POTS)),
    "pots_swapped": F("swapped", after=_pots_swapped),
    "pot_reversed": F("pot's sign", after=_pot_reversed),
}
