"""What a fault on the ground is, and how each draws where it occurs and how large it is.

A fault alters the motions of the aircraft (`walk`), or the logger's frames of them (`frames`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from host.twin.faults import POTS
from host.twin.ground.ground_instrument import GroundFrames
from host.twin.ground.ground_walk import GroundWalk


@dataclass(frozen=True, slots=True)
class GroundFault:
    """One kind of fault.

    Attributes
    ----------
    cause : str
        A word or two that the reason must have.
    before : callable or None
        Alters the walk before the frames are made; returns the item by which the fault is found.
    after : callable or None
        Alters the frames; returns the item.
    """

    cause: str
    before: Callable[[GroundWalk], str] | None = None
    after: Callable[[GroundWalk, GroundFrames], str] | None = None


def one_of(walk: GroundWalk, names: tuple[str, ...]) -> str:
    return names[int(walk.rng.integers(len(names)))]


def two_of(walk: GroundWalk, names: tuple[str, ...]) -> tuple[str, str]:
    first, second = walk.rng.permutation(len(names))[:2]
    return names[first], names[second]


def counts(value: int, names: tuple[str, ...]) -> Callable[[GroundWalk, GroundFrames], str]:
    """Return an open or shorted wire: counts at an end of the range, marked invalid."""

    def spoil(walk: GroundWalk, frames: GroundFrames) -> str:
        name = one_of(walk, names)
        frames.ident[name] = value
        frames.ident["valid"] &= np.uint16(0xFFFF ^ frames.schema.bit("valid", name))
        return item_of_pot(name)

    return spoil


def item_of_pot(name: str) -> str:
    """Return the item that looks at an analogue channel."""
    return name.removeprefix("pot_").partition("_")[0] if name in POTS else name


def row_after_rest(walk: GroundWalk) -> int:
    """Draw a row after the aircraft's rest and before the item of the radio."""
    return int(walk.rng.integers(walk.rows("imu_turned").stop, walk.rows("supply").start))


def event(
    walk: GroundWalk, frames: GroundFrames, code: str, arg: int, item: str, *, at_s: float
) -> str:
    row = np.zeros(1, frames.slow["event"].dtype)
    row["id"] = frames.schema.by_name["event"].id
    row["t_us"] = int(frames.ident["t_us"][0]) + round(at_s * 1e6)
    row["code"], row["arg"] = frames.schema.number("event", code), arg
    frames.slow["event"] = np.concatenate([frames.slow["event"], row])
    return item
