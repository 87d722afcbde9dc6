"""The relay that gives the servos to the Mega, held by a charge pump on the heartbeat.

Figures are those of hw/relay.md, with the gate threshold that holds longest; not measurements. The
sense line stands for the two sense contacts in parallel.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from simavr_bench.charge_pump import ChargePump
from simavr_bench.chip import Chip, cycles

OPEN, RECEIVER, MEGA = 0, 1, 2


@dataclass(slots=True)
class ChargePumpRelay:
    """Relay, pump and servo lines.

    Parameters
    ----------
    chip : Chip
        The Mega.
    heartbeat : str
        Pin of the heartbeat.
    servos : mapping of str to tuple(str, str)
        For each servo the receiver's pin and the Mega's output pin.
    sense : str or None
        Pin of the sense contacts, driven low while engaged.
    pump : ChargePump
        From the heartbeat to the gate.
    on_volt, off_volt : float
        Gate voltage at which the coil pulls in, and at which it lets go: as its transistor's
        threshold, at either end of its data sheet, or the worse end for each.
    operate_s, release_s : float
        From the coil's current to the break of the old contact; with the diode across the coil
        letting go takes longer.
    transfer_s, bounce_s : float
        From that break to the make of the new contact, and how long that bounces.
    seed : int
        For the bounces.

    Attributes
    ----------
    contacts : list of tuple(int, int)
        Cycle and state from then on: 0 open, 1 receiver, 2 Mega.
    """

    chip: Chip
    heartbeat: str
    servos: Mapping[str, tuple[str, str]]
    sense: str | None = None
    pump: ChargePump = field(default_factory=ChargePump)
    on_volt: float = 1.5
    off_volt: float = 0.8
    operate_s: float = 0.003
    release_s: float = 0.007
    transfer_s: float = 0.005
    bounce_s: float = 0.001
    seed: int = 1
    contacts: list[tuple[int, int]] = field(default_factory=lambda: [(0, RECEIVER)])
    energised: bool = False
    _since: int = 0
    _edges: int = 0
    _movement: int = 0
    _made: int = RECEIVER
    _rng: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        """Watch the pins."""
        self._rng = np.random.default_rng(self.seed)
        self.chip.on_pin(self.heartbeat, self._edge)
        self.chip.watch(self.heartbeat)
        for receiver, mega in self.servos.values():
            self.chip.watch(receiver, mega)
            self.chip.pull(mega, False)  # the relay's own pull-down: an idle output is no pulse
        self._show_sense(False)

    def volt(self) -> float:
        """Gate voltage now."""
        return self.pump.at((self.chip.cycle - self._since) / 16e6)[1]

    def _edge(self, level: bool, cycle: int) -> None:
        self.pump.edge(level, (cycle - self._since) / 16e6)
        self._since = cycle
        self._edges += 1
        if self.energised:
            return  # _look_again is on its way
        rise_s = self.pump.rises_above(self.on_volt)
        if rise_s is not None:
            mine = self._edges
            self.chip.at(cycle + cycles(rise_s), lambda: self._pull_in(mine))

    def _pull_in(self, edges: int) -> None:
        if edges != self._edges or self.energised:
            return  # another edge came first
        self._switch(True)
        self._look_again()

    def _look_again(self) -> None:
        """Let go if the gate is down, else come back when it would be if no edge came."""
        left_s = self.pump.falls_below(self.off_volt) - (self.chip.cycle - self._since) / 16e6
        if left_s <= 0:
            self._switch(False)
        else:
            self.chip.at(self.chip.cycle + max(1, cycles(left_s)), self._look_again)

    def _switch(self, energised: bool) -> None:
        """Move the armature; what is left of a movement under way, its bounce too, is cancelled."""
        self.energised = energised
        self._movement += 1
        now = self.chip.cycle
        target = MEGA if energised else RECEIVER
        if self._made != OPEN and self.contacts[-1][1] == OPEN:
            self._close(now, self._made)  # it was bouncing
        if self._made == target:
            return  # it had not left yet
        make = now + cycles((self.operate_s if energised else self.release_s) + self.transfer_s)
        moves = [(make, target)]
        if self._made != OPEN:
            moves.append((make - cycles(self.transfer_s), OPEN))
        for bounce in np.sort(self._rng.integers(1, max(2, cycles(self.bounce_s)), 2)):
            moves.append((make + int(bounce), OPEN))
            moves.append((make + int(bounce) + cycles(50e-6), target))
        for cycle, state in sorted(moves):
            self.chip.at(cycle, partial(self._contact, self._movement, cycle, make, state))

    def _contact(self, movement: int, cycle: int, make: int, state: int) -> None:
        if movement != self._movement:
            return
        if cycle <= make:
            self._made = state
        self._close(cycle, state)

    def _close(self, cycle: int, state: int) -> None:
        self.contacts.append((cycle, state))
        self._show_sense(state == MEGA)

    def _show_sense(self, engaged: bool) -> None:
        if self.sense is not None:
            self.chip.drive(self.sense, False if engaged else None)

    @property
    def engaged(self) -> bool:
        """Whether the Mega's contact is closed now."""
        return self.contacts[-1][1] == MEGA

    def servo_pulses(self, name: str) -> NDArray[np.int64]:
        """Pulses a servo sees behind the contacts.

        Parameters
        ----------
        name : str
            Servo.

        Returns
        -------
        NDArray[np.int64], shape (n, 2)
            Start and end cycle of every pulse that is over; a contact that opens within a pulse
            ends it.
        """
        receiver, mega = (self._levels(pin) for pin in self.servos[name])
        contact = np.array(self.contacts, np.int64)
        times = np.unique(np.concatenate((receiver[0], mega[0], contact[:, 0])))
        state = contact[np.searchsorted(contact[:, 0], times, side="right") - 1, 1]
        level = np.where(state == RECEIVER, _at(receiver, times), 0)
        level = np.where(state == MEGA, _at(mega, times), level)
        change = np.flatnonzero(np.diff(np.concatenate(([0], level))))
        rises = times[change[level[change] == 1]]
        falls = times[change[level[change] == 0]]
        falls = falls[falls > rises[0]] if len(rises) else falls[:0]
        count = min(len(rises), len(falls))
        return np.column_stack((rises[:count], falls[:count]))

    def _levels(self, pin: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        when, level = self.chip.edges(pin)
        return (
            np.concatenate(([0], when.astype(np.int64))),
            np.concatenate(([0], level.astype(np.int64))),
        )


def _at(
    edges: tuple[NDArray[np.int64], NDArray[np.int64]], times: NDArray[np.int64]
) -> NDArray[np.int64]:
    level: NDArray[np.int64] = edges[1][np.searchsorted(edges[0], times, side="right") - 1]
    return level
