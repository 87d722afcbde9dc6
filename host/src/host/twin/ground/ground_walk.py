"""The motions of a preflight walk, item by item, drawn as people differ.

True values at the radio's 20 rows a second; errors of the instrument are not in here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from host.aircraft.airframe import Array
from host.aircraft.file import Aircraft
from host.constants import DEG_PER_RAD
from host.twin.faults import VANES
from host.twin.flight.pilot import SWITCH_DIRECT_US
from host.twin.flight.stick_commands import IDLE_US, NEUTRAL_US, THROW_US

STEP_S = 0.05
STOP_DEG = 60.0  # of the vane's housing, hw/mechanics/vane.toml limit_deg
SWITCH_MEGA_US = 1900.0
SURFACES = ("elevator", "aileron", "rudder")
# Preset of a receiver that is set up: neutral, idle, the switch so that the logger knows
# (firmware/settings.toml, input_switch).
PRESET_US = {**dict.fromkeys(SURFACES, NEUTRAL_US), "throttle": IDLE_US, "switch": 880.0}
ROLL, PITCH, YAW = range(3)
# How a pilot proves the hold of a card (hw/test-inputs.md): right wing down, then nose up, and of
# each the surface whose stick is at its end against it.
SIGN_S, PROOF_S = 4.0, 5.5  # aileron and rudder at their ends enable the card; a tilt
PROOFS = (("aileron", ROLL, -1.0), ("elevator", PITCH, 1.0))


@dataclass(slots=True)
class GroundWalk:
    """One walk; arrays have a row every `STEP_S`.

    Attributes
    ----------
    aircraft : Aircraft
    rng : numpy Generator
        Draws everything of this walk, of its instrument and of its fault.
    windows : list of (str, int, int)
        Item, first row, row behind its last.
    vane_deg : dict of str to (n,) array
    blown_pa : dict of str to (n,) array
        By side, ``a`` and ``b``.
    turn_deg : (3, n) array
        Roll, pitch, yaw.
    stick : dict of str to (n,) array
        Elevator, aileron, rudder: share of full throw in the surface's positive sense.
    throttle_us, switch_us : (n,) array
    transmitter : (n,) array of bool
    preset : bool
        Whether the receiver sends preset pulses while the transmitter is off; else none.
    preset_us : dict of str to float
        Those pulses.
    surface_share : dict of str to float
        Share of its travel that a surface moves, with a sign.
    """

    aircraft: Aircraft
    rng: np.random.Generator
    windows: list[tuple[str, int, int]] = field(default_factory=list)
    vane_deg: dict[str, Array] = field(default_factory=dict)
    blown_pa: dict[str, Array] = field(default_factory=dict)
    turn_deg: Array = field(default_factory=lambda: np.zeros((3, 0)))
    stick: dict[str, Array] = field(default_factory=dict)
    throttle_us: Array = field(default_factory=lambda: np.zeros(0))
    switch_us: Array = field(default_factory=lambda: np.zeros(0))
    transmitter: np.ndarray[tuple[int], np.dtype[np.bool_]] = field(
        default_factory=lambda: np.zeros(0, bool)
    )
    preset: bool = True
    preset_us: dict[str, float] = field(default_factory=lambda: dict(PRESET_US))
    surface_share: dict[str, float] = field(default_factory=lambda: dict.fromkeys(SURFACES, 1.0))

    @property
    def t_s(self) -> Array:
        """Time of each row."""
        return np.arange(len(self.throttle_us), dtype=np.float64) * STEP_S

    def rows(self, item: str) -> slice:
        """Return the rows of an item's window."""
        return next(slice(a, b) for name, a, b in self.windows if name == item)

    def limit_deg(self, surface: str) -> float:
        """Return the travel of a surface by the aircraft file."""
        return self.aircraft.scalar(f"surfaces.{surface}_limit_rad") * DEG_PER_RAD


def ground_walk(aircraft: Aircraft, seed: int, held: Sequence[str] = ()) -> GroundWalk:
    """Draw a walk.

    Parameters
    ----------
    aircraft : Aircraft
    seed : int
    held : sequence of str
        Surfaces whose hold is proven at the end, behind the sign that enables the card.
    """
    walk = GroundWalk(aircraft, np.random.default_rng([seed, 61]))
    rng, lasts = walk.rng, _durations(walk.rng)
    if held:
        lasts["hold"] = SIGN_S + PROOF_S * len(held)
    ends = np.cumsum([round(seconds / STEP_S) for seconds in lasts.values()])
    starts = np.r_[0, ends[:-1]]
    walk.windows = [(n, int(a), int(b)) for n, a, b in zip(lasts, starts, ends, strict=True)]
    count = int(ends[-1])
    walk.turn_deg = np.zeros((3, count))
    for at, (axis, angle) in enumerate(((PITCH, 25.0), (ROLL, 25.0), (YAW, 30.0))):
        reach, begin_s = angle * rng.uniform(0.85, 1.4), 0.6 + 2.6 * at
        moves = ((0.0, 0.0), (1.0, reach), (1.3, reach), (2.3, 0.0))
        walk.turn_deg[axis] = _moved(walk, "imu_turned", moves, begin_s)
    for name in VANES:
        walk.vane_deg[name] = _lifted(walk, name)
    for side in "ab":
        walk.blown_pa[side] = _blown(walk, f"dp_{side}")
    for surface in SURFACES:
        walk.stick[surface] = _full_stick(walk, surface) + _stirred(walk)
    walk.throttle_us = np.full(count, IDLE_US)
    walk.switch_us = np.full(count, SWITCH_DIRECT_US)
    walk.transmitter = np.ones(count, bool)
    walk.preset = bool(rng.random() < 0.6)
    _switch(walk)
    _transmitter_off(walk)
    if held:
        _prove(walk, held)
    return walk


def _durations(rng: np.random.Generator) -> dict[str, float]:
    """Return how long each item takes; the first is the aircraft left alone."""
    still = {"still": rng.uniform(7.0, 9.0), "imu_turned": rng.uniform(9.0, 10.0)}
    vanes = {name: rng.uniform(4.6, 5.6) for name in VANES}
    pitots = {f"dp_{side}": rng.uniform(6.0, 7.0) for side in "ab"}
    sticks = {surface: rng.uniform(4.2, 5.0) for surface in SURFACES}
    rest = {"supply": 12.0, "relay": 7.5, "failsafe": 10.0, "radio": 31.0}
    return still | vanes | pitots | sticks | rest


def _moved(
    walk: GroundWalk, item: str, moves: Sequence[tuple[float, float]], begin_s: float
) -> Array:
    """Return a quantity moved by hand in an item's window: (seconds, value), straight between."""
    rows = walk.rows(item)
    count = walk.windows[-1][2]
    seconds, values = np.array(moves).T
    at_s = rows.start * STEP_S + begin_s + seconds
    return np.asarray(np.interp(np.arange(count) * STEP_S, at_s, values))


def _lifted(walk: GroundWalk, name: str) -> Array:
    """Return the angle of a vane that is lifted to both stops of its housing and let go."""
    rng = walk.rng
    before, after = rng.uniform(-8.0, 8.0, 2)
    up, down = STOP_DEG + rng.uniform(-1.5, 1.5), -STOP_DEG + rng.uniform(-1.5, 1.5)
    go, hold = rng.uniform(0.4, 0.9), rng.uniform(0.2, 0.5)
    times = np.cumsum([0.0, go, hold, go, hold, 0.3])
    values = (before, up, up, down, down, after)
    return _moved(walk, name, list(zip(times, values, strict=True)), rng.uniform(0.4, 0.9))


def _blown(walk: GroundWalk, item: str) -> Array:
    """Return the pressure in a pitot that is blown into through a hose, pinched and let go."""
    rng = walk.rng
    peak, lost = rng.uniform(120.0, 700.0), rng.uniform(0.0, 0.08)
    times = np.cumsum([0.0, rng.uniform(0.2, 0.6), rng.uniform(2.3, 3.5), rng.uniform(0.03, 0.15)])
    values = (0.0, peak, peak * (1.0 - lost), 0.0)
    return _moved(walk, item, list(zip(times, values, strict=True)), rng.uniform(0.5, 1.2))


def _full_stick(walk: GroundWalk, surface: str) -> Array:
    """Return the motion of a stick to one end, to the other, and back."""
    rng = walk.rng
    one, other = rng.uniform(0.97, 1.0, 2)
    go, hold = rng.uniform(0.25, 0.6), rng.uniform(0.25, 0.5)
    times = np.cumsum([0.0, go, hold, go, hold, 0.3])
    values = (0.0, one, one, -other, -other, 0.0)
    return _moved(walk, surface, list(zip(times, values, strict=True)), rng.uniform(0.4, 0.9))


def _stirred(walk: GroundWalk) -> Array:
    """Return the motion of a stick while all are stirred and the supply is watched."""
    rng, rows = walk.rng, walk.rows("supply")
    out = np.zeros(walk.windows[-1][2])
    t_s = np.arange(rows.stop - rows.start) * STEP_S
    busy = (t_s > 1.0) & (t_s < t_s[-1] - 0.5)
    turns = rng.uniform(0.7, 1.4) * t_s + rng.random()
    out[rows] = np.where(busy, rng.uniform(0.6, 1.0) * np.sin(2.0 * np.pi * turns), 0.0)
    return out


def _switch(walk: GroundWalk) -> None:
    first = walk.rows("relay").start + round(walk.rng.uniform(1.2, 2.0) / STEP_S)
    walk.switch_us[first : first + round(walk.rng.uniform(2.0, 3.0) / STEP_S)] = SWITCH_MEGA_US


def _transmitter_off(walk: GroundWalk) -> None:
    """Throttle up, transmitter off, throttle back, on again."""
    rng, rows = walk.rng, walk.rows("failsafe")
    up_us = IDLE_US + 2.0 * THROW_US * rng.uniform(0.2, 0.5)
    off_s = rng.uniform(1.4, 3.0)
    on_s = off_s + rng.uniform(3.0, 4.0)
    moves = ((0.0, IDLE_US), (0.5, up_us), (on_s - 0.6, up_us), (on_s - 0.3, IDLE_US))
    walk.throttle_us = _moved(walk, "failsafe", moves, 0.4)
    t_s = np.arange(len(walk.throttle_us)) * STEP_S - rows.start * STEP_S - 0.4
    walk.transmitter = ~((t_s > off_s) & (t_s < on_s))


def _prove(walk: GroundWalk, held: Sequence[str]) -> None:
    """Enable the card, then tilt the aircraft for each surface, its stick at the end against it."""
    reach = ((0.0, 0.0), (0.3, 1.0), (SIGN_S - 0.5, 1.0), (SIGN_S - 0.2, 0.0))
    for surface, way in (("aileron", 1.0), ("rudder", -1.0)):
        walk.stick[surface] += way * _moved(walk, "hold", reach, 0.0)
    moves = ((0.0, 0.0), (0.8, 1.0), (PROOF_S - 1.0, 1.0), (PROOF_S - 0.3, 0.0))
    at_s = SIGN_S
    for surface, axis, way in PROOFS:
        if surface in held:
            tilt = _moved(walk, "hold", moves, at_s)
            walk.turn_deg[axis] += walk.rng.uniform(20.0, 30.0) * tilt
            walk.stick[surface] += way * tilt
            at_s += PROOF_S
