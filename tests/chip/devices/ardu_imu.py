"""The ArduIMU as master of the hardware TWI: its original packets and our own firmware's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from functools import partial

import numpy as np
from host.wire.packets import packet
from host.wire.schema_text import packed_schema
from simavr_bench.chip import Chip, cycles

SEQUENCED, FIRST, SECOND = (packet(n) for n in ("imu", "original_imu_1", "original_imu_2"))
RATES, FORCES, ANGLES = ("p", "q", "r"), ("ax", "ay", "az"), ("phi", "theta", "psi")
RESTARTED = packed_schema().bit("imu_flags", "restarted")


class MasterDeath(IntEnum):
    """How a master goes silent in the middle of a packet."""

    LIVES = 0
    LETS_GO = 1
    HOLDS_SDA = 2
    HOLDS_SCL = 3


@dataclass(frozen=True, slots=True)
class ImuSample:
    """Raw numbers of one sample in the packet's own steps, i16 each."""

    rates: tuple[int, int, int] = (0, 0, 0)
    specific_force: tuple[int, int, int] = (0, 0, -8192)
    angles_cdeg: tuple[int, int, int] = (0, 0, 0)


@dataclass(frozen=True, slots=True)
class SentSample:
    """What went out: sequence number, cycle of the sample, its values, packet numbers."""

    sequence: int
    cycle: int
    sample: ImuSample
    packets: tuple[int, ...]
    spoilt: bool


@dataclass(slots=True)
class ArduImu:
    """Sends samples to the chip.

    Parameters
    ----------
    chip : Chip
        The slave.
    original : bool
        Two packets without check to 42 and 27, else one sequenced packet to 43.
    rate_hz : float
        Samples per second of the IMU's own clock.
    scl_hz : float
        Bus clock.
    clock_ppm : float
        The IMU's clock runs fast by this much.
    delay_us : float
        From sample to START.
    source : callable
        Gives the sample for a time in seconds.
    seed : int
        For faults.

    Attributes
    ----------
    silent : bool
        Sends nothing.
    flip_fraction, short_fraction, repeat_fraction, twice_fraction : float
        Part of the packets with one flipped bit, cut short, with the previous sequence number, or
        sent twice.
    flags, aux_kind, aux : int, int, tuple
        Fields of the sequenced packet.
    aux_source : callable or None
        Gives ``aux_kind`` and ``aux`` for a sequence number, in place of the fixed ones.
    sent : list of SentSample
        Everything sent.
    """

    chip: Chip
    original: bool = False
    rate_hz: float = 100.0
    scl_hz: float = 100_000.0
    clock_ppm: float = 0.0
    delay_us: float = 300.0
    source: Callable[[float], ImuSample] = lambda time_s: ImuSample()
    seed: int = 1
    silent: bool = False
    flip_fraction: float = 0.0
    short_fraction: float = 0.0
    repeat_fraction: float = 0.0
    twice_fraction: float = 0.0
    flags: int = 0
    aux_kind: int = 0
    aux: tuple[int, int, int] = (0, 0, 0)
    aux_source: Callable[[int], tuple[int, tuple[int, int, int]]] | None = None
    sent: list[SentSample] = field(default_factory=list)
    _rng: np.random.Generator = field(init=False)
    _number: int = 0
    _first: int = 0
    _run: int = 0
    _start: int = 0
    _dies: MasterDeath = MasterDeath.LIVES
    _dies_after: int = 0

    def __post_init__(self) -> None:
        """Seed the faults."""
        self._rng = np.random.default_rng(self.seed)

    def start(self, *, at_cycle: int | None = None, number: int = 0) -> ArduImu:
        """Sample from a cycle on (now by default), the first with a number; gives itself."""
        self._start = self.chip.cycle if at_cycle is None else at_cycle
        self._number = 0
        self._first = number
        self._run += 1
        self.chip.at(self._start, partial(self._sample, self._run))
        return self

    def die(self, how: MasterDeath, *, after_bytes: int) -> None:
        """Break off the next packet after so many data bytes and stay silent."""
        self._dies, self._dies_after = how, after_bytes

    def revive(self) -> None:
        """Let the lines go and send again."""
        self.chip.twi_hold(sda=False, scl=False)
        self.silent = False

    def restart(self, off_s: float) -> None:
        """Reset it: silent for a time, then counting from 0 with the flag `restarted` for 1 s."""
        self.silent = True
        begin = self.chip.cycle + cycles(off_s)

        def boot() -> None:
            self.silent = False
            self.flags |= RESTARTED
            self.start()

        self.chip.at(begin, boot)
        self.chip.at(begin + cycles(1.0), self._settled)

    def _settled(self) -> None:
        self.flags &= ~RESTARTED

    def _period(self) -> float:
        return 16e6 / (self.rate_hz * (1 + self.clock_ppm * 1e-6))

    def _sample(self, run: int) -> None:
        if run != self._run:
            return  # it was started anew
        now = self.chip.cycle
        self._number += 1
        due = self._start + round(self._number * self._period())
        self.chip.at(due, partial(self._sample, run))
        if self.silent:
            return
        sample = self.source(now / 16e6)
        sequence = (self._first + self._number - 1) & 0xFF
        if self.repeat_fraction and self._rng.random() < self.repeat_fraction:
            sequence = (sequence - 1) & 0xFF
        packets = (
            self._original(sample) if self.original else self._sequenced(sequence, now, sample)
        )
        if self.twice_fraction and self._rng.random() < self.twice_fraction:
            packets = [*packets, *packets]
        numbers, spoilt = [], False
        at = now + cycles(self.delay_us * 1e-6)
        for address, data in packets:
            spoilt_data = self._spoil(data)
            spoilt = spoilt or spoilt_data != data or self._dies != MasterDeath.LIVES
            numbers.append(
                self.chip.twi_send(
                    address, spoilt_data, at_cycle=at, scl_hz=self.scl_hz,
                    dies=int(self._dies), dies_after=self._dies_after,
                )
            )  # fmt: skip
            if self._dies != MasterDeath.LIVES:
                self._dies = MasterDeath.LIVES
                self.silent = True
                break
        self.sent.append(SentSample(sequence, now, sample, tuple(numbers), spoilt))

    def _spoil(self, data: bytes) -> bytes:
        if self.flip_fraction and self._rng.random() < self.flip_fraction:
            bit = int(self._rng.integers(len(data) * 8))
            changed = bytearray(data)
            changed[bit // 8] ^= 1 << (bit % 8)
            return bytes(changed)
        if self.short_fraction and self._rng.random() < self.short_fraction:
            return data[: int(self._rng.integers(1, len(data)))]
        return data

    def _sequenced(self, sequence: int, now: int, sample: ImuSample) -> list[tuple[int, bytes]]:
        time_us = int((now - self._start) / 16 * (1 + self.clock_ppm * 1e-6)) & 0xFFFFFFFF
        aux_kind, aux = self.aux_kind, self.aux
        if self.aux_source is not None:
            aux_kind, aux = self.aux_source(sequence)
        row = SEQUENCED.rows(1)
        row["seq"], row["flags"], row["aux_kind"] = sequence, self.flags, aux_kind
        row["t_us"], row["age"] = time_us, round(self.delay_us / SEQUENCED.scale("age"))
        values = (*sample.rates, *sample.specific_force, *sample.angles_cdeg)
        for name, value in zip((*RATES, *FORCES, *ANGLES), values, strict=True):
            row[name] = value
        row["aux"] = aux
        return [(SEQUENCED.address, SEQUENCED.sealed(row)[0])]

    def _original(self, sample: ImuSample) -> list[tuple[int, bytes]]:
        # Original firmware: 2000 deg/s scale (16.4 LSB against 65.5), minus specific force.
        angles = [a / 100 for a in sample.angles_cdeg]
        rates = [r * 16.4 / 65.5 for r in sample.rates]
        x, y, z = (-float(a) for a in sample.specific_force)
        first, second = FIRST.rows(1), SECOND.rows(1)
        first[0] = (*angles, *rates, x, y)
        second[0] = (z, 25.05, 121.5, 30.0, 0.0, 0.0, 1.0, 8.0)
        return [(FIRST.address, FIRST.sealed(first)[0]), (SECOND.address, SECOND.sealed(second)[0])]
