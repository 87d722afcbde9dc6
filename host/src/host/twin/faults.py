"""The faults that a flight card can name, and what each does.

Numbers 1 to 25 are those of the table in `twin/README.md`. Two of them are not in a card as such.
A program that hangs (23) is inside the recorder; a card has its consequence, `watchdog_reset`.
Power cuts at random instants (6) take many flights; a card has one, `power_cut`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from host.aircraft.airframe import Array
from host.wire.schema_text import packed_schema

VANES = ("alpha_a", "alpha_b", "beta_a", "beta_b")
PITOTS = ("dp_a", "dp_b")
POTS = ("pot_elevator", "pot_aileron_left", "pot_aileron_right", "pot_rudder")
RECEIVER = ("aileron", "elevator", "rudder", "throttle", "switch")
GYROS = ("p", "q", "r")
FOREVER_S = 1e9
SUPPLY_V = 5.0
LONGEST_FLOOD_S = 600.0
RESETS = {"brown_out": "brown_out", "watchdog_reset": "watchdog"}  # enum reset_cause
RADIO_BYTEPS = 57_600 / 10
ENDS = {"card_removed": "card_inserted", "supply_sag": "supply", "baro_off": "baro_on",
        "baro_bus_stuck": "baro_bus_free"}  # fmt: skip


@dataclass(frozen=True, slots=True)
class FaultKind:
    """One kind of fault.

    Attributes
    ----------
    number : int
        Its number in the table of `twin/README.md`; 0 for a fault outside it.
    text : str
        What happens, for the list a user reads.
    value : float
        Used where a card gives none.
    channels : tuple of str
        Where it may happen; the first where a card does not say.
    lasts : bool
        Whether it ends after `duration_s`.
    from_start : bool
        Whether it is present from power-on on, so that `at_s` must be 0.
    """

    number: int
    text: str
    value: float = 0.0
    channels: tuple[str, ...] = ()
    lasts: bool = True
    from_start: bool = False


FAULTS = {
    "motor_cut": FaultKind(0, "the motor stops", lasts=False),
    "card_busy": FaultKind(1, "the card is busy for `value` ms at one write", 500.0, lasts=False),
    "card_removed": FaultKind(3, "the card is pulled, and put back after `duration_s`"),
    "card_reject": FaultKind(4, "the card refuses the next `value` blocks", 1.0, lasts=False),
    "card_absent": FaultKind(5, "no card at power-on", from_start=True),
    "card_full": FaultKind(5, "a card without room", from_start=True),
    "card_unformatted": FaultKind(5, "a card without a file system", from_start=True),
    "power_cut": FaultKind(6, "the battery is pulled", lasts=False),
    "baro_bus_stuck": FaultKind(7, "a line of the barometer's bus is held low"),
    "imu_off": FaultKind(10, "the IMU is silent (7: its bus is stuck)"),
    "baro_off": FaultKind(8, "the barometer does not answer"),
    "baro_garbage": FaultKind(
        9, "the barometer's memory is blank: 0xFFFF, or 0 if `value` is 0", 1.0, from_start=True
    ),
    "baro_stuck": FaultKind(9, "the barometer keeps its raw values"),
    "imu_stuck": FaultKind(10, "the IMU sends the same sample again and again, counting on"),
    "imu_garbage": FaultKind(11, "a share `value` of the IMU packets has a wrong bit", 0.01),
    "imu_short": FaultKind(11, "a share `value` of the IMU packets is too short", 0.01),
    "imu_slow": FaultKind(12, "the IMU makes half as many samples"),
    "imu_lost_packets": FaultKind(12, "a share `value` of the IMU packets does not come", 0.05),
    "imu_repeated": FaultKind(12, "a share `value` of the IMU packets comes twice", 0.05),
    "imu_reset": FaultKind(13, "the IMU restarts and is silent for `value` s", 0.3, lasts=False),
    "gyro_saturated": FaultKind(14, "a gyro stands at the end of its range", channels=GYROS),
    "receiver_channel_lost": FaultKind(
        15, "the Mega sees no pulses on one channel", channels=RECEIVER
    ),
    "receiver_lost": FaultKind(16, "the receiver sends no pulses; servos hold, the motor stops"),
    "receiver_failsafe": FaultKind(
        17, "the receiver sends its preset: neutral, idle, switch at `value` us", 900.0
    ),
    "receiver_glitch": FaultKind(
        18, "extra pulses of 50 us to 4 ms behind a share `value` of the frames", 0.3,
        channels=RECEIVER,
    ),
    "receiver_storm": FaultKind(
        18, "edges at `value` Hz on the Mega's side of a line", 10_000.0, channels=RECEIVER
    ),
    "vane_stuck": FaultKind(19, "a vane stands still", channels=VANES),
    "vane_open": FaultKind(19, "a vane's wire is open: 1023 counts", channels=VANES),
    "vane_short": FaultKind(19, "a vane's wire is shorted: 0 counts", channels=VANES),
    "pot_open": FaultKind(19, "a surface pot's wire is open", channels=POTS),
    "pot_short": FaultKind(19, "a surface pot's wire is shorted", channels=POTS),
    "pitot_open": FaultKind(19, "a pitot's wire is open", channels=PITOTS),
    "pitot_short": FaultKind(19, "a pitot's wire is shorted", channels=PITOTS),
    "pitot_blocked": FaultKind(20, "a pitot keeps its pressure", channels=PITOTS),
    "pitot_swapped": FaultKind(20, "the ports of a pitot are swapped", channels=PITOTS),
    "supply_sag": FaultKind(21, "the Mega's 5 V fall to `value` V", 4.4),
    "rail_drop": FaultKind(21, "the servo rail falls to `value` V", 4.0),
    "brown_out": FaultKind(22, "the Mega's supply fails for an instant: reset", lasts=False),
    "watchdog_reset": FaultKind(22, "the Mega's watchdog resets it (23)", lasts=False),
    "gps_off": FaultKind(24, "the GPS is silent"),
    "gps_garbage": FaultKind(24, "one in ten bytes of the GPS is wrong"),
    "gps_no_fix": FaultKind(24, "the GPS has no fix"),
    "gps_far": FaultKind(24, "the GPS gives coordinates of 1e9"),
    "gps_rollover": FaultKind(
        24, "the GPS week ends: time of week 0, week 1024 back", lasts=False
    ),
    "telemetry_blocked": FaultKind(25, "the radio takes no byte (not --firmware avr: its modem has"
        " no line to say so)"),
    "telemetry_flood": FaultKind(25, "the radio sends bytes without a pause (--firmware avr only:"
        " elsewhere an interrupt takes no time)"),
    "settings_damaged": FaultKind(0, "a wrong byte in the stored settings", from_start=True),
    "clock_wrap": FaultKind(0, "the Mega's clock of microseconds wraps", lasts=False),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Fault:
    """Something breaks at `at_s` after power-on; see `FAULTS` for value and channel."""

    kind: str
    at_s: float
    duration_s: float = FOREVER_S
    value: float | None = None
    channel: str = ""

    @property
    def amount(self) -> float:
        """`value`, or the kind's own."""
        return FAULTS[self.kind].value if self.value is None else self.value

    @property
    def place(self) -> int:
        """Index of `channel` among those of the kind, 0 where the card does not say."""
        return FAULTS[self.kind].channels.index(self.channel) if self.channel else 0

    @property
    def end_s(self) -> float:
        """When it ends."""
        return self.at_s + self.duration_s

    def inside(self, t_s: Array) -> NDArray[np.bool_]:
        """Return which of the times (n,) it covers."""
        return np.asarray((t_s >= self.at_s) & (t_s < self.end_s))


def without_recorder(faults: Sequence[Fault]) -> list[Fault]:
    """Return the faults that only a recorder shows, not the aircraft, its vanes, pitots or pots."""
    outside = ("motor_cut", "receiver_lost", "receiver_failsafe")
    return [
        fault
        for fault in faults
        if fault.kind not in outside and fault.kind.split("_")[0] not in ("vane", "pot", "pitot")
    ]


@dataclass(frozen=True, slots=True)
class Action:
    """Something done to the recorder's world at one instant, as the chip simulator names it."""

    at_s: float
    what: str
    value: float = 0.0


def recorder_actions(faults: Sequence[Fault]) -> list[Action]:
    """Return, in order of time, what faults of card, supply and barometer do to the recorder.

    All other faults are in the signals at its pins (`stimuli`).
    """
    found = []
    for fault in faults:
        if fault.kind in ("card_busy", "card_reject", "card_removed"):
            found.append(Action(fault.at_s, fault.kind, fault.amount))
        elif fault.kind in RESETS:
            cause = packed_schema().number("reset_cause", RESETS[fault.kind])
            found.append(Action(fault.at_s, "reset", cause))
        elif fault.kind == "supply_sag":
            found.append(Action(fault.at_s, "supply", fault.amount))
        elif fault.kind in ("baro_off", "baro_bus_stuck"):
            found.append(Action(fault.at_s, fault.kind))
        elif fault.kind == "telemetry_blocked":
            found.append(Action(fault.at_s, fault.kind, fault.end_s))
        elif fault.kind == "telemetry_flood":
            end_s = min(fault.end_s, fault.at_s + LONGEST_FLOOD_S)
            found.append(Action(fault.at_s, fault.kind, (end_s - fault.at_s) * RADIO_BYTEPS))
        if fault.kind in ENDS and fault.end_s < FOREVER_S:
            found.append(Action(fault.end_s, ENDS[fault.kind], SUPPLY_V))
    return sorted(found, key=lambda action: action.at_s)
