"""Faults of receiver, relay, fail-safe and supply on the ground."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from host.twin.faults import RECEIVER
from host.twin.ground.ground_fault import GroundFault as F
from host.twin.ground.ground_fault import event, one_of
from host.twin.ground.ground_instrument import GroundFrames, put_rail, working
from host.twin.ground.ground_walk import STEP_S, GroundWalk

SENSE = "mega_drives"


def _channel_lost(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.ident[f"rc_{one_of(walk, RECEIVER)}"] = 0
    return "receiver"


def _receiver_lost(walk: GroundWalk, frames: GroundFrames) -> str:
    for name in RECEIVER:
        frames.ident[f"rc_{name}"] = 0
    return "receiver"


def _transmitter_left_off(walk: GroundWalk) -> str:
    walk.preset = True
    walk.transmitter = np.zeros_like(walk.transmitter)
    return "receiver"


def _glitches(walk: GroundWalk, frames: GroundFrames) -> str:
    system = frames.slow["system"]
    system["rc_glitches"] = np.cumsum(walk.rng.poisson(walk.rng.uniform(5.0, 30.0), len(system)))
    return "receiver"


def _storm(walk: GroundWalk, frames: GroundFrames) -> str:
    return event(walk, frames, "receiver_storm", 40, "receiver", at_s=1.0)


def _failsafe_keeps(walk: GroundWalk) -> str:
    walk.preset = True
    walk.preset_us["throttle"] = float(walk.throttle_us.max())
    return "failsafe"


def _failsafe_holds(walk: GroundWalk, frames: GroundFrames) -> str:
    """The receiver repeats the last pulses of every channel."""
    off = ~walk.transmitter
    first = int(np.argmax(off)) - 1
    for name in RECEIVER:
        for kind in ("rc", "servo"):
            if f"{kind}_{name}" in (frames.ident.dtype.names or ()):
                column = frames.ident[f"{kind}_{name}"]
                column[off] = column[first]
    return "failsafe"


def _failsafe_switch(walk: GroundWalk) -> str:
    walk.preset = True
    walk.preset_us["switch"] = walk.rng.uniform(1000.0, 1300.0)
    return "failsafe"


def _sense(engaged: bool) -> Callable[[GroundWalk, GroundFrames], str]:
    def spoil(walk: GroundWalk, frames: GroundFrames) -> str:
        bit = np.uint16(frames.schema.bit("valid", SENSE))
        ident = frames.ident
        ident["valid"] = ident["valid"] | bit if engaged else ident["valid"] & ~bit
        if not engaged:
            at_s = float(np.argmax(walk.switch_us > 1500.0)) * STEP_S + 0.2
            event(walk, frames, "relay_lost", 0, "relay", at_s=at_s)
        return "relay"

    return spoil


def _welded(walk: GroundWalk, frames: GroundFrames) -> str:
    """Weld the relay's contact when it first closes."""
    bit = np.uint16(frames.schema.bit("valid", SENSE))
    first = int(np.argmax((frames.ident["valid"] & bit) != 0))
    frames.ident["valid"][first:] |= bit
    return "relay"


def _rail_sags(walk: GroundWalk, frames: GroundFrames) -> str:
    system = frames.slow["system"]
    rest_v, supply_v = walk.rng.uniform(4.9, 5.3), system["avcc_mv"] * 1e-3
    drop_v = working(walk, system) * walk.rng.uniform(0.65, 1.3)
    put_rail(system, rest_v - drop_v, supply_v)
    return "supply"


def _rail_low(walk: GroundWalk, frames: GroundFrames) -> str:
    system = frames.slow["system"]
    put_rail(system, walk.rng.uniform(4.0, 4.7), system["avcc_mv"] * 1e-3)
    return "supply"


def _rail_unwired(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.slow["system"]["rail"] = 65535
    return "supply"


def _supply_low(walk: GroundWalk, frames: GroundFrames) -> str:
    put_rail(frames.slow["system"], 5.2, walk.rng.uniform(4.3, 4.68))
    return "supply"


FAULTS: dict[str, F] = {
    "receiver_channel_lost": F("no pulses", after=_channel_lost),
    "receiver_lost": F("no pulses", after=_receiver_lost),
    "receiver_failsafe": F("preset", before=_transmitter_left_off),
    "receiver_glitch": F("wrong pulses", after=_glitches),
    "receiver_storm": F("storm", after=_storm),
    "failsafe_keeps_throttle": F("throttle stays", before=_failsafe_keeps),
    "failsafe_holds": F("holds the last pulses", after=_failsafe_holds),
    "failsafe_switch": F("fail-safe of the switch", before=_failsafe_switch),
    "relay_stuck_direct": F("stuck at direct", after=_sense(engaged=False)),
    "relay_stuck_mega": F("stuck at Mega", after=_sense(engaged=True)),
    "relay_welds": F("stuck at Mega", after=_welded),
    "rail_sags": F("servo rail", after=_rail_sags),
    "rail_low": F("servo rail", after=_rail_low),
    "rail_unwired": F("no voltage", after=_rail_unwired),
    "supply_sag": F("logger's supply", after=_supply_low),
}
