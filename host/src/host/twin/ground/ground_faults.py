"""Faults of an aircraft on the ground; each draws where it occurs and how large it is.

A fault alters the motions of the aircraft (`walk`), or the logger's frames of them (`frames`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from host.twin.faults import PITOTS, POTS, RECEIVER, VANES
from host.twin.ground.ground_instrument import GroundFrames, put_rail, working
from host.twin.ground.ground_walk import STEP_S, SURFACES, GroundWalk
from host.twin.sensors.analog import nominal

SENSE = "mega_drives"


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


def _one(walk: GroundWalk, names: tuple[str, ...]) -> str:
    return names[int(walk.rng.integers(len(names)))]


def _two(walk: GroundWalk, names: tuple[str, ...]) -> tuple[str, str]:
    first, second = walk.rng.permutation(len(names))[:2]
    return names[first], names[second]


# ---------------------------------------- vanes, pitots
def _vane_slipped(walk: GroundWalk) -> str:
    name = _one(walk, VANES)
    walk.vane_deg[name] += walk.rng.uniform(7.0, 22.0) * walk.rng.choice((-1.0, 1.0))
    return name


def _vane_sticks(walk: GroundWalk) -> str:
    name = _one(walk, VANES)
    walk.vane_deg[name] = np.clip(walk.vane_deg[name], -12.0, walk.rng.uniform(8.0, 30.0))
    return name


def _vane_stuck(walk: GroundWalk) -> str:
    name = _one(walk, VANES)
    walk.vane_deg[name] = np.full_like(walk.vane_deg[name], walk.rng.uniform(-20.0, 20.0))
    return name


def _vane_reversed(walk: GroundWalk) -> str:
    name = _one(walk, VANES)
    walk.vane_deg[name] *= -1.0
    return name


def _vane_short_travel(walk: GroundWalk) -> str:
    name = _one(walk, VANES)
    walk.vane_deg[name] *= walk.rng.uniform(0.66, 0.8)
    return name


def _vanes_swapped(walk: GroundWalk) -> str:
    one, other = _two(walk, VANES)
    vanes = walk.vane_deg
    vanes[one], vanes[other] = vanes[other], vanes[one]
    return min(one, other)


def _pitots_swapped(walk: GroundWalk) -> str:
    walk.blown_pa["a"], walk.blown_pa["b"] = walk.blown_pa["b"], walk.blown_pa["a"]
    return "dp_a"


def _hoses_swapped(walk: GroundWalk) -> str:
    side = _one(walk, ("a", "b"))
    walk.blown_pa[side] = -walk.blown_pa[side]
    return f"dp_{side}"


def _pitot_leaks(walk: GroundWalk) -> str:
    side = _one(walk, ("a", "b"))
    tau_s, pressure = walk.rng.uniform(0.6, 2.5), walk.blown_pa[side]
    first = int(np.argmax(pressure >= 0.99 * pressure.max()))
    since_s = np.maximum(np.arange(len(pressure)) - first, 0) * STEP_S
    walk.blown_pa[side] = pressure * np.exp(-since_s / tau_s)
    return f"dp_{side}"


def _pitot_blocked(walk: GroundWalk) -> str:
    side = _one(walk, ("a", "b"))
    walk.blown_pa[side] = walk.blown_pa[side] * walk.rng.uniform(0.0, 0.05)
    return f"dp_{side}"


def _airspeed_offset(walk: GroundWalk) -> str:
    side = _one(walk, ("a", "b"))
    walk.blown_pa[side] = walk.blown_pa[side] + walk.rng.uniform(20.0, 90.0) * walk.rng.choice(
        (-1.0, 1.0)
    )
    return "airspeed_rest"


def _counts(value: int, names: tuple[str, ...]) -> Callable[[GroundWalk, GroundFrames], str]:
    """Return an open or shorted wire: counts at an end of the range, marked invalid."""

    def spoil(walk: GroundWalk, frames: GroundFrames) -> str:
        name = _one(walk, names)
        frames.ident[name] = value
        frames.ident["valid"] &= np.uint16(0xFFFF ^ frames.schema.bit("valid", name))
        return _of_pot(name)

    return spoil


def _of_pot(name: str) -> str:
    """Return the item that looks at an analogue channel."""
    return name.removeprefix("pot_").partition("_")[0] if name in POTS else name


# ---------------------------------------- surfaces
def _surface_reversed(walk: GroundWalk) -> str:
    surface = _one(walk, SURFACES)
    walk.surface_share[surface] *= -1.0
    return surface


def _channel_reversed(walk: GroundWalk) -> str:
    surface = _one(walk, SURFACES)
    walk.stick[surface] = -walk.stick[surface]
    return surface


def _half_travel(walk: GroundWalk) -> str:
    surface = _one(walk, SURFACES)
    walk.surface_share[surface] *= walk.rng.uniform(0.4, 0.7)
    return surface


def _dual_rate(walk: GroundWalk) -> str:
    surface = _one(walk, SURFACES)
    walk.stick[surface] = walk.stick[surface] * walk.rng.uniform(0.42, 0.58)
    return surface


def _channels_swapped(walk: GroundWalk) -> str:
    one, other = _two(walk, SURFACES)
    walk.stick[one], walk.stick[other] = walk.stick[other], walk.stick[one]
    return min(one, other, key=SURFACES.index)


def _surface_dead(walk: GroundWalk) -> str:
    surface = _one(walk, SURFACES)
    walk.surface_share[surface] *= walk.rng.uniform(0.0, 0.1)
    return surface


def _pot_stuck(walk: GroundWalk, frames: GroundFrames) -> str:
    name = _one(walk, POTS)
    frames.ident[name] = frames.ident[name][0]
    return _of_pot(name)


def _pots_swapped(walk: GroundWalk, frames: GroundFrames) -> str:
    one, other = _two(walk, tuple(name for name in POTS if name != "pot_aileron_right"))
    ident = frames.ident
    ident[one], ident[other] = ident[other].copy(), ident[one].copy()
    return min(_of_pot(one), _of_pot(other), key=SURFACES.index)


def _pot_reversed(walk: GroundWalk, frames: GroundFrames) -> str:
    name = _one(walk, POTS)
    frames.ident[name] = 8 * round(nominal()[name][0]) - frames.ident[name]
    return _of_pot(name)


# ---------------------------------------- IMU
def _imu_tilted(walk: GroundWalk) -> str:
    walk.turn_deg = walk.turn_deg.copy()
    walk.turn_deg[int(walk.rng.integers(2))] += walk.rng.uniform(8.0, 25.0) * walk.rng.choice(
        (-1.0, 1.0)
    )
    return "imu"


def _imu_frozen(walk: GroundWalk, frames: GroundFrames) -> str:
    first = _row_after_rest(walk)
    for name in ("p", "q", "r", "ax", "ay", "az"):
        frames.ident[name][first:] = frames.ident[name][first]
    return "imu"


def _imu_off(walk: GroundWalk, frames: GroundFrames) -> str:
    first = _row_after_rest(walk)
    for name in ("p", "q", "r", "ax", "ay", "az"):
        frames.ident[name][first:] = -32768
    return "imu"


def _imu_damaged(walk: GroundWalk, frames: GroundFrames) -> str:
    system, share = frames.slow["system"], walk.rng.uniform(0.01, 0.05)
    name = _one(walk, ("imu_bad_packets", "imu_lost"))
    bad = np.cumsum(walk.rng.binomial(200, share, len(system)))
    system[name] = bad
    system["imu_packets"] -= bad.astype(np.uint16)
    return "imu"


def _imu_restarts(walk: GroundWalk, frames: GroundFrames) -> str:
    first = _row_after_rest(walk)
    for name in ("p", "q", "r", "ax", "ay", "az"):
        frames.ident[name][first : first + 6] = -32768
    return _event(walk, frames, "imu_restarted", 0, "imu", at_s=first * STEP_S)


def _imu_slow(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.slow["system"]["imu_packets"] //= 2
    return "imu"


def _accelerometer_weak(walk: GroundWalk, frames: GroundFrames) -> str:
    factor = walk.rng.choice((0.5, 0.85, 1.12, 2.0))
    for name in ("ax", "ay", "az"):
        frames.ident[name] = np.clip(np.round(frames.ident[name] * factor), -32000, 32000)
    return "imu"


def _gyro_zero(walk: GroundWalk, frames: GroundFrames) -> str:
    raw = walk.rng.uniform(1.7, 8.0) * 65.5 * walk.rng.choice((-1.0, 1.0))
    frames.ident[_one(walk, ("p", "q", "r"))] += np.int16(raw)
    return "gyros"


def _gyro_dead(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.ident[_one(walk, ("p", "q", "r"))] = int(walk.rng.integers(-20, 20))
    return "gyros"


def _gyro_saturated(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.ident[_one(walk, ("p", "q", "r"))] = 32767
    bit = frames.schema.bit("valid", "imu_unsaturated")
    frames.ident["valid"] &= np.uint16(0xFFFF ^ bit)
    return "imu"


def _gyro_deaf(walk: GroundWalk, frames: GroundFrames) -> str:
    """Leave the noise of a gyro and take away its rate."""
    name, ident = _one(walk, ("p", "q", "r")), frames.ident
    ident[name] = np.round(walk.rng.normal(0.0, 3.3, len(ident)))
    return "imu_turned"


def _gyro_reversed(walk: GroundWalk, frames: GroundFrames) -> str:
    name = _one(walk, ("p", "q", "r"))
    frames.ident[name] = -frames.ident[name]
    return "imu_turned"


def _gyros_swapped(walk: GroundWalk, frames: GroundFrames) -> str:
    """Turn the IMU on its floor: x and y of gyros and accelerometers are exchanged."""
    ident = frames.ident
    for one, other in (("p", "q"), ("ax", "ay")):
        ident[one], ident[other] = ident[other].copy(), ident[one].copy()
    return "imu_turned"


# ---------------------------------------- receiver, relay, fail-safe, supply
def _channel_lost(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.ident[f"rc_{_one(walk, RECEIVER)}"] = 0
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
    return _event(walk, frames, "receiver_storm", 40, "receiver", at_s=1.0)


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
            _event(walk, frames, "relay_lost", 0, "relay", at_s=at_s)
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


# ---------------------------------------- GPS, barometer, card, logger, radio
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
    first = _row_after_rest(walk) // 4
    gps["itow_ms"][first:] = gps["itow_ms"][first]
    return "gps"


def _gps_garbage(walk: GroundWalk, frames: GroundFrames) -> str:
    system = frames.slow["system"]
    system["gps_errors"] = np.cumsum(walk.rng.poisson(walk.rng.uniform(4.0, 12.0), len(system)))
    return "gps"


def _silent(name: str, item: str, *, late: bool) -> Callable[[GroundWalk, GroundFrames], str]:
    def spoil(walk: GroundWalk, frames: GroundFrames) -> str:
        rows = frames.slow[name]
        frames.slow[name] = rows[: _row_after_rest(walk) // 4 if late else 0]
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
    first = _row_after_rest(walk)
    fault_row = first // 20
    bit = np.uint8(0xFF ^ frames.schema.bit("sensors", "card"))
    frames.slow["system"]["sensors"][fault_row:] &= bit
    return _event(walk, frames, "card_removed", 0, "card", at_s=first * STEP_S - 0.5)


def _other_aircraft(walk: GroundWalk, frames: GroundFrames) -> str:
    frames.slow["config"]["aircraft"] = b"kadetlt40"
    return "logger"


def _reset(walk: GroundWalk, frames: GroundFrames) -> str:
    first = _row_after_rest(walk) // 20
    frames.slow["system"]["uptime_s"][first:] = np.arange(len(frames.slow["system"]) - first)
    return "logger"


def _settings_default(walk: GroundWalk, frames: GroundFrames) -> str:
    return _event(walk, frames, "settings_default", 1, "logger", at_s=0.5)


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


def _row_after_rest(walk: GroundWalk) -> int:
    """Draw a row after the aircraft's rest and before the item of the radio."""
    return int(walk.rng.integers(walk.rows("imu_turned").stop, walk.rows("supply").start))


def _event(
    walk: GroundWalk, frames: GroundFrames, code: str, arg: int, item: str, *, at_s: float
) -> str:
    row = np.zeros(1, frames.slow["event"].dtype)
    row["id"] = frames.schema.by_name["event"].id
    row["t_us"] = int(frames.ident["t_us"][0]) + round(at_s * 1e6)
    row["code"], row["arg"] = frames.schema.number("event", code), arg
    frames.slow["event"] = np.concatenate([frames.slow["event"], row])
    return item


F = GroundFault
GROUND_FAULTS: dict[str, GroundFault] = {
    "vane_stuck": F("stuck", before=_vane_stuck),
    "vane_sticks": F("sticks", before=_vane_sticks),
    "vane_slipped": F("slipped", before=_vane_slipped),
    "vane_reversed": F("wrong direction", before=_vane_reversed),
    "vane_short_travel": F("travels", before=_vane_short_travel),
    "vanes_swapped": F("swapped", before=_vanes_swapped),
    "vane_open": F("open or shorted", after=_counts(4092, VANES)),
    "vane_short": F("open or shorted", after=_counts(0, VANES)),
    "pitots_swapped": F("swapped", before=_pitots_swapped),
    "pitot_swapped": F("hoses", before=_hoses_swapped),
    "pitot_leaks": F("leaks", before=_pitot_leaks),
    "pitot_blocked": F("blocked", before=_pitot_blocked),
    "pitot_open": F("open or shorted", after=_counts(4092, PITOTS)),
    "pitot_short": F("open or shorted", after=_counts(0, PITOTS)),
    "airspeed_offset": F("at rest", before=_airspeed_offset),
    "surface_reversed": F("against its stick", before=_surface_reversed),
    "channel_reversed": F("reverse the channel", before=_channel_reversed),
    "half_travel": F("travel", before=_half_travel),
    "dual_rate": F("dual rate", before=_dual_rate),
    "channels_swapped": F("swapped", before=_channels_swapped),
    "surface_dead": F("hardly did", before=_surface_dead),
    "pot_stuck": F("dead", after=_pot_stuck),
    "pot_open": F("open or shorted", after=_counts(4092, POTS)),
    "pot_short": F("open or shorted", after=_counts(0, POTS)),
    "pots_swapped": F("swapped", after=_pots_swapped),
    "pot_reversed": F("pot's sign", after=_pot_reversed),
    "imu_tilted": F("tilted", before=_imu_tilted),
    "imu_stuck": F("frozen", after=_imu_frozen),
    "imu_off": F("stale", after=_imu_off),
    "imu_damaged": F("damaged or lost", after=_imu_damaged),
    "imu_reset": F("restarted", after=_imu_restarts),
    "imu_slow": F("packets a second", after=_imu_slow),
    "accelerometer": F("accelerometer", after=_accelerometer_weak),
    "gyro_zero": F("at rest", after=_gyro_zero),
    "gyro_dead": F("dead axis", after=_gyro_dead),
    "gyro_saturated": F("range's end", after=_gyro_saturated),
    "gyro_deaf": F("", after=_gyro_deaf),
    "gyro_reversed": F("wrong direction", after=_gyro_reversed),
    "imu_mounted_turned": F("", after=_gyros_swapped),
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
