"""Every fault of an aircraft on the ground, and a walk with one of them."""

from __future__ import annotations

from collections.abc import Callable

from host.twin.ground import (
    airdata_faults,
    imu_faults,
    logger_faults,
    receiver_faults,
    surface_faults,
)
from host.twin.ground.ground_fault import GroundFault
from host.twin.ground.ground_instrument import GroundFrames
from host.twin.ground.ground_walk import GroundWalk

GROUND_FAULTS: dict[str, GroundFault] = {
    name: fault
    for part in (airdata_faults, surface_faults, imu_faults, receiver_faults, logger_faults)
    for name, fault in part.FAULTS.items()
}


def broken_walk(
    fault: GroundFault, walk: GroundWalk, make: Callable[[GroundWalk], GroundFrames]
) -> tuple[str, GroundFrames]:
    """Return the item by which a fault is found, and the frames of a walk with it.

    Parameters
    ----------
    fault : GroundFault
    walk : GroundWalk
        Altered.
    make : callable
        `ground_instrument.ground_frames`.
    """
    item = fault.before(walk) if fault.before is not None else ""
    frames = make(walk)
    if fault.after is not None:
        item = fault.after(walk, frames)
    return item, frames
