"""The recorder in one loop with an aircraft: what it adds to the servos is flown at once.

For a flight card that holds axes. The aircraft is flown up to the next frame of the receiver or the
next sample of the IMU; then the recorder runs up to where the one behind it can reach it. Pitots,
vanes, pressure and GPS, which the law of the hold does not hear, come from a flight before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from host.aircraft.airframe import Array
from host.twin.flight.fly import RC_PERIOD_S, STEP_S, FlightRecord
from host.twin.flight.pilot import SWITCH_ARMED_US
from host.twin.recorder.sitl import Recording, closed, give_stimuli, ready
from host.twin.recorder.stimuli import Stimuli
from host.twin.sensors.imu_stream import ImuPacket, ImuSender, transfer
from host.twin.sensors.mega_clock import ticks
from host.twin.sensors.receiver import frame_edges
from host.wire.flight_card import AXES
from host.wire.packets import packet

FRAME_STEPS = round(RC_PERIOD_S / STEP_S)
APART_STEPS = 500  # in a turn while no row can run
KEPT_FRAMES = 10  # of the receiver: a servo's pulse follows a stick's by one or two


class ClosedLoop:
    """One flight of the recorder; `power_on` is the logger that `fly` takes.

    Attributes
    ----------
    packets : list of ImuPacket
        What the IMU sent.
    """

    def __init__(
        self, given: Stimuli, *, rate_hz: int, aircraft: str, flight_card: bytes, seed: int = 0
    ) -> None:
        self._given, self._seed = given, seed
        self._sitl, self._image = ready(given, rate_hz, aircraft, (), flight_card)
        self.packets: list[ImuPacket] = []
        self._frames = self._samples = 0

    def power_on(self, record: FlightRecord, added_us: Array) -> Callable[[int], int]:
        """Power on in this flight; see `fly.LoopedLogger`."""
        nothing = replace(self._given, edges=self._given.edges[:0], packets=[])
        give_stimuli(self._sitl, nothing, self._given.duration)
        self._sitl.power_on()
        self._record, self._added = record, added_us
        self._sender = ImuSender(record, np.random.default_rng([record.seed, 11]))
        self._needs = np.ceil(self._sender.at_s / STEP_S).astype(np.int64) + 1
        self._step_ticks = ticks(record, record.t_s)
        self._armed = np.flatnonzero(record.schedule.orders.switch_us == SWITCH_ARMED_US)
        self._sticks = np.zeros((0, 2, len(AXES)), dtype=np.int64)
        return self._follow

    def recording(self) -> Recording:
        """Return what was recorded: the battery is pulled where the flight ended."""
        try:
            return closed(self._sitl, self._image, self._given, self._given.duration, (),
                          self._seed)  # fmt: skip
        finally:
            self._sitl.close()

    def _follow(self, done: int) -> int:
        self._give(done)
        steps, samples = len(self._step_ticks), len(self._needs)
        frame = self._frames * FRAME_STEPS
        known = [self._given.duration]
        known += [int(self._step_ticks[frame])] if frame < steps else []
        known += [int(self._sender.starts[self._samples])] if self._samples < samples else []
        self._sitl.run_until(min(known) - 1)
        n = int(np.searchsorted(self._armed, done))
        armed = int(self._armed[n]) if n < len(self._armed) else steps
        if armed > done:
            return min(done + APART_STEPS, armed)
        turn = min(frame + 1, int(self._needs[self._samples]) if self._samples < samples else steps)
        self._add(done, turn)
        return turn

    def _give(self, done: int) -> None:
        """Give what the motion of so many steps has made."""
        frames = -(-done // FRAME_STEPS)
        if frames > self._frames:
            edges = frame_edges(self._record, slice(self._frames, frames))
            self._sitl.add_edges(edges["at"], edges["levels"])
            at = edges["at"].reshape(frames - self._frames, -1, 2).transpose(0, 2, 1)
            self._sticks = np.concatenate([self._sticks, at[:, :, : len(AXES)]])[-KEPT_FRAMES:]
            self._frames = frames
        samples = int(np.searchsorted(self._needs, done, side="right"))
        if samples > self._samples:
            sealed = packet("imu").sealed(self._sender.rows(samples))
            starts = self._sender.starts[self._samples : samples].tolist()
            self._sitl.add_packets(starts, packet("imu").address, sealed)
            self.packets += [transfer(at, data) for at, data in zip(starts, sealed, strict=True)]
            self._samples = samples

    def _add(self, first: int, last: int) -> None:
        """Fill the additions of the steps first..last from the servo pulses that have ended."""
        start, output, width = (found[-4 * KEPT_FRAMES :] for found in self._sitl.pulses())
        for k in range(len(AXES)):
            mine = output == k
            rise, fall = self._sticks[:, 0, k], self._sticks[:, 1, k]
            at = start[mine]
            place = np.maximum(np.searchsorted(fall, at, side="right") - 1, 0)
            difference = 0.5 * (width[mine] - (fall - rise)[place])
            newest = np.searchsorted(
                at + width[mine], self._step_ticks[first:last], side="right"
            )  # fmt: skip
            if len(at):
                self._added[first:last, k] = np.where(
                    newest > 0, difference[np.maximum(newest - 1, 0)], 0.0
                )
