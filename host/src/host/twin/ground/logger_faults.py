"""Faults of GPS, barometer, card, logger and radio on the ground."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from host.twin.ground.ground_fault import GroundFault as F
from host.twin.ground.ground_fault import event, row_after_rest
from host.twin.ground.ground_instrument import GroundFrames
from host.twin.ground.ground_walk import STEP_S, GroundWalk


def _gps_no_fix(walk: GroundWalk, frames: GroundFrames) -> str:
    gps = frames.slow["gps"]
    gps["fix"] = int(walk.rng.integers(0, 3))
    gps["satellites"] = walk.rng.integers(0, 4)
    return "gps"


def _gps_few(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.slow["gps"]["satellites"] = walk.rng.integers(3, 6)
    return "gps"


def _gps_far(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.slow["gps"]["latitude"] = 1_000_000_000
    return "gps"


def _gps_frozen(walk: GroundWalk, frames: GroundFrames) -> str:
    gps = frames.slow["gps"]
    first = row_after_rest(walk) // 4
    gps["itow_ms"][first:] = gps["itow_ms"][first]
    return "gps"


def _gps_garbage(walk: GroundWalk, frames: GroundFrames) -> str:
    system = frames.slow["system"]
    system["gps_errors"] = np.cumsum(walk.rng.poisson(walk.rng.uniform(4.0, 12.0), len(system)))
    return "gps"


def _silent(name: str, item: str, *, late: bool) -> Callable[[GroundWalk, GroundFrames], str]:
    def spoil(walk: GroundWalk, frames: GroundFrames) -> str:
        rows = frames.slow[name]
        frames.slow[name] = rows[: row_after_rest(walk) // 4 if late else 0]
        return item

    return spoil


def _baro_stuck(walk: GroundWalk, frames: GroundFrames) -> str:
    for name in ("raw_pressure", "static_pressure"):
        frames.slow["baro"][name] = frames.slow["baro"][name][0]
    return "baro"


def _baro_garbage(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.slow["baro"]["static_pressure"] = int(walk.rng.choice((0, 200_000, 4_000_000_000)))
    return "baro"


def _baro_errors(walk: GroundWalk, frames: GroundFrames) -> str:
    system = frames.slow["system"]
    system["baro_errors"] = np.cumsum(walk.rng.poisson(walk.rng.uniform(4.0, 20.0), len(system)))
    return "baro"


def _card_not_ready(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.slow["system"]["sensors"] &= np.uint8(0xFF ^ frames.schema.bit("sensors", "card"))
    return "card"


def _card_errors(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.slow["system"]["card_errors"] = int(walk.rng.integers(1, 40))
    return "card"


def _card_pulled(walk: GroundWalk, frames: GroundFrames) -> str:
    first = row_after_rest(walk)
    fault_row = first // 20
    bit = np.uint8(0xFF ^ frames.schema.bit("sensors", "card"))
    frames.slow["system"]["sensors"][fault_row:] &= bit
    return event(walk, frames, "card_removed", 0, "card", at_s=first * STEP_S - 0.5)


def _other_aircraft(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.slow["config"]["aircraft"] = b"kadetlt40"
    return "logger"


def _reset(walk: GroundWalk, frames: GroundFrames) -> str:
    first = row_after_rest(walk) // 20
    frames.slow["system"]["uptime_s"][first:] = np.arange(len(frames.slow["system"]) - first)
    return "logger"


def _settings_default(walk: GroundWalk, frames: GroundFrames) -> str:
    return event(walk, frames, "settings_default", 1, "logger", at_s=0.5)


def _radio_weak(walk: GroundWalk, frames: GroundFrames) -> str:
    rows, rng = walk.rows("radio"), walk.rng
    frames.kept[rows] &= rng.random(rows.stop - rows.start) >= rng.uniform(0.15, 0.5)
    return "radio"


def _radio_dead(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.kept[walk.rows("radio").start :] = False
    return "radio"


def _radio_bursts(walk: GroundWalk, frames: GroundFrames) -> str:
    rows, rng = walk.rows("radio"), walk.rng
    for begin in np.arange(rows.start + 20, rows.stop - 40, rng.uniform(60.0, 100.0)):
        frames.kept[int(begin) : int(begin + rng.uniform(12.0, 30.0))] = False
    return "radio"


FAULTS: dict[str, F] = {
    "gps_off": F("nothing heard", after=_silent("gps", "gps", late=False)),
    "gps_lost": F("stale", after=_silent("gps", "gps", late=True)),
    "gps_frozen": F("stale", after=_gps_frozen),
    "gps_no_fix": F("no fix", after=_gps_no_fix),
    "gps_few": F("satellites only", after=_gps_few),
    "gps_far": F("cannot be", after=_gps_far),
    "gps_garbage": F("damaged", after=_gps_garbage),
    "baro_off": F("nothing heard", after=_silent("baro", "baro", late=False)),
    "baro_lost": F("stale", after=_silent("baro", "baro", late=True)),
    "baro_stuck": F("stale", after=_baro_stuck),
    "baro_garbage": F("cannot be", after=_baro_garbage),
    "baro_bus_stuck": F("errors a second", after=_baro_errors),
    "card_not_ready": F("no file is ready", after=_card_not_ready),
    "card_removed": F("removed", after=_card_pulled),
    "card_errors": F("card errors", after=_card_errors),
    "other_aircraft": F("kadetlt40", after=_other_aircraft),
    "reset": F("reset during", after=_reset),
    "settings_damaged": F("settings are damaged", after=_settings_default),
    "radio_weak": F("rows lost", after=_radio_weak),
    "radio_dead": F("nothing came", after=_radio_dead),
    "radio_bursts": F("rows lost", after=_radio_bursts),
}
