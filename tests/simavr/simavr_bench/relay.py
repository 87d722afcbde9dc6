"""The relay that gives the servos to the Mega, held by a charge pump on the heartbeat.

Heartbeat, coupling capacitor, two diodes, reservoir with its bleed resistor, transistor, coil:
every rising edge moves charge, a level that stands still moves none. Figures are those of
hw/relay.md with the threshold that holds longest, not measurements.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

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
        Pin of the spare contact, driven low while engaged.
    coupling_f, reservoir_f, bleed_ohm, diode_volt : float
        The pump.
    on_volt, off_volt : float
        Reservoir voltage at which the coil pulls in and lets go.
    coil_s, transfer_s, bounce_s : float
        From the coil's change to the break of the old contact, to the make of the new one, and how
        long that bounces.
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
    coupling_f: float = 1e-6
    reservoir_f: float = 1e-6
    bleed_ohm: float = 22_000.0
    diode_volt: float = 0.3
    on_volt: float = 1.5
    off_volt: float = 0.8
    coil_s: float = 0.003
    transfer_s: float = 0.005
    bounce_s: float = 0.001
    seed: int = 1
    contacts: list[tuple[int, int]] = field(default_factory=lambda: [(0, RECEIVER)])
    energised: bool = False
    _volt: float = 0.0
    _since: int = 0
    _generation: int = 0
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

    def _reservoir(self, cycle: int) -> float:
        tau = self.bleed_ohm * self.reservoir_f * 16e6
        return self._volt * math.exp(-(cycle - self._since) / tau)

    def volt(self) -> float:
        """Reservoir voltage now."""
        return self._reservoir(self.chip.cycle)

    def _edge(self, level: bool, cycle: int) -> None:
        if not level:
            return
        peak = 5.0 - 2 * self.diode_volt
        volt = self._reservoir(cycle)
        share = self.coupling_f / (self.coupling_f + self.reservoir_f)
        self._volt = volt + max(0.0, peak - volt) * share
        self._since = cycle
        if not self.energised and self._volt >= self.on_volt:
            self._switch(True)
        if self.energised:
            self._generation += 1
            mine = self._generation
            tau = self.bleed_ohm * self.reservoir_f * 16e6
            left = max(0.0, tau * math.log(self._volt / self.off_volt))
            self.chip.at(cycle + math.ceil(left), lambda: self._run_down(mine))

    def _run_down(self, generation: int) -> None:
        if generation == self._generation and self.energised:
            self._switch(False)

    def _switch(self, energised: bool) -> None:
        self.energised = energised
        now = self.chip.cycle
        target = MEGA if energised else RECEIVER
        moves = [(now + cycles(self.coil_s), OPEN)]
        make = now + cycles(self.coil_s + self.transfer_s)
        moves.append((make, target))
        for bounce in np.sort(self._rng.integers(1, max(2, cycles(self.bounce_s)), 2)):
            moves.append((make + int(bounce), OPEN))
            moves.append((make + int(bounce) + cycles(50e-6), target))
        for cycle, state in sorted(moves):
            self.chip.at(cycle, partial(self._contact, cycle, state))

    def _contact(self, cycle: int, state: int) -> None:
        if state != OPEN and state != (MEGA if self.energised else RECEIVER):
            return  # the coil changed its mind before the contact was made
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
