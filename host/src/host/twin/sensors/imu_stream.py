"""The IMU's packets on its bus, as its firmware sends them, and how they fail."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from host.aircraft.airframe import Array
from host.twin.faults import Fault
from host.twin.flight.fly import FlightRecord
from host.twin.sensors.imu import Imu, ImuSampling
from host.twin.sensors.local_flow import AirData
from host.twin.sensors.mega_clock import TICKS_PER_S, Ticks, ticks
from host.twin.sensors.sensor_delays import dlpf_for
from host.wire.packets import packet
from host.wire.schema_text import packed_schema

RATE_HZ = 200.0
# Sample to START of the transfer, s: attitude filter and packing on the 328P, estimated.
AGE_S = 0.9e-3
AGE_JITTER_S = 0.15e-3
BYTE_S = 9.0 / 400_000.0
RAW = ("p", "q", "r", "ax", "ay", "az", "phi", "theta", "psi")
# The IMU's firmware keeps its restart flag for 2 s, its attitude is not settled for 3 s.
RESTARTED_S, UNSETTLED_S = 2.0, 3.0
REPEATED_AFTER_S = 1.2e-3  # a packet takes 0.83 ms
FULL_SCALE = 32767


@dataclass(frozen=True, slots=True)
class ImuPacket:
    """One transfer on the IMU's bus, ticks of its START and of its STOP."""

    start: int
    end: int
    address: int
    data: bytes


def imu_packets(
    record: FlightRecord, data: AirData, rng: np.random.Generator
) -> tuple[Imu, list[ImuPacket]]:
    """Return the samples the IMU took, and the packets that leave it.

    Parameters
    ----------
    record : FlightRecord
    data : AirData
    rng : numpy Generator

    Returns
    -------
    Imu, list of ImuPacket
        Without faults one packet per sample.
    """
    sender = ImuSender(record, rng)
    at, own_clock = sender.at_s, sender.own_clock
    rows = sender.rows(len(at))
    # A stream of its own: a fault changes nothing else.
    chance = np.random.default_rng([record.seed, 12])
    sent = np.ones(len(at), dtype=bool)
    for fault in record.card.faults:
        sent &= _fail(fault, at, rows, own_clock, chance)
    packets = [
        transfer(start, data)
        for start, data, leaves in zip(
            sender.starts.tolist(), packet("imu").sealed(rows), sent.tolist(), strict=True
        )
        if leaves
    ]
    for fault in record.card.faults:
        packets = _damage(fault, at[sent], packets, chance)
    return sender.sampling.samples, packets


class ImuSender:
    """Samples and sends, as far as the flight is flown.

    Attributes
    ----------
    at_s : (m,) array
        True times of the samples.
    starts : (m,) array
        Starts of their packets, in ticks.
    own_clock : float
        Its seconds in a true one.
    sampling : ImuSampling
    """

    def __init__(self, record: FlightRecord, rng: np.random.Generator) -> None:
        self.own_clock = 1.0
        if record.card.sensors.clock_error:
            self.own_clock += record.draws.scalar("imu_clock_share")
        self.at_s = np.arange(0.05, record.t_s[-1] - 0.02, 1.0 / RATE_HZ / self.own_clock)
        dlpf = dlpf_for(record.card.flight.rate_hz)
        self.sampling = ImuSampling(record, self.at_s, dlpf, rng)
        self._age_s = AGE_S + AGE_JITTER_S * rng.random(len(self.at_s))
        self.starts = ticks(record, self.at_s + self._age_s)
        self._sent = 0

    def rows(self, last: int) -> NDArray[np.void]:
        """Return the packets, not sealed, of the samples since the last call before `last`."""
        first, self._sent = self._sent, last
        self.sampling.take(last)
        count = np.arange(first, last)
        return _rows(self.sampling.samples, count, self._age_s[first:last], self.own_clock)


def _rows(sample: Imu, count: Ticks, age_s: Array, own_clock: float) -> NDArray[np.void]:
    at, raw = sample.t_s[count], sample.raw[count]
    aux = np.zeros((len(at), 3), dtype=np.int64)
    kinds = count % 12  # magnetometer at 16.7 Hz, bias and status at the same pace
    schema = packed_schema()
    mag_step_t = schema.by_name["mag"].field("mx").scale
    bias_step_radps = schema.by_name["attitude"].field("bias_p").scale
    # Between its turns the magnetometer is repeated, as the IMU keeps its last reading.
    aux[:] = np.round(sample.magnetic_t[count - kinds] / mag_step_t)
    aux[kinds == 4] = np.round(sample.bias_radps[count[kinds == 4]] / bias_step_radps)
    aux[kinds == 8] = (3150, 0x54 + 256 * sample.dlpf, 1)
    gyro_full = np.abs(raw[:, :3]).max(axis=1) >= FULL_SCALE
    accel_full = np.abs(raw[:, 3:6]).max(axis=1) >= FULL_SCALE
    rows = packet("imu").rows(len(at))
    rows["seq"] = count & 0xFF
    rows["flags"] = (
        _flag("gyro_saturated") * gyro_full
        + _flag("accel_saturated") * accel_full
        + (_flag("attitude_valid") | _flag("mag_valid") | _flag("offsets_valid"))
    )
    rows["aux_kind"] = np.select(
        [kinds == 4, kinds == 8],
        [schema.number("imu_aux", "gyro_bias"), schema.number("imu_aux", "status")],
        schema.number("imu_aux", "magnetometer"),
    )
    rows["t_us"] = np.round(at * own_clock * 1e6).astype(np.int64) & 0xFFFFFFFF
    age_step_s = packet("imu").scale("age") * 1e-6
    rows["age"] = np.round(age_s * own_clock / age_step_s).astype(np.int64)
    for column, name in enumerate(RAW):
        rows[name] = raw[:, column]
    rows["aux"] = np.clip(aux, -32768, 32767)
    return rows


def _flag(name: str) -> int:
    return packed_schema().bit("imu_flags", name)


def _fail(
    fault: Fault, at: Array, rows: NDArray[np.void], own_clock: float, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Alter the IMU's own samples during a fault; return a mask of the packets that it sends."""
    inside = fault.inside(at)
    sent = np.ones(len(at), dtype=bool)
    if not inside.any():
        return sent
    first = int(np.argmax(inside))
    if fault.kind == "imu_off":
        sent[inside] = False
    elif fault.kind == "imu_stuck":
        for name in RAW:
            rows[name][inside] = rows[name][first]
    elif fault.kind == "imu_lost_packets":
        sent[inside & (rng.random(len(at)) < fault.amount)] = False
    elif fault.kind == "imu_slow":
        sent[inside & (np.arange(len(at)) % 2 == 1)] = False
        rows["seq"] = (np.cumsum(sent) - 1) & 0xFF
    elif fault.kind == "gyro_saturated":
        rows[RAW[fault.place]][inside] = FULL_SCALE
        rows["flags"][inside] |= _flag("gyro_saturated")
    elif fault.kind == "imu_reset":
        again_s = fault.at_s + fault.amount
        sent[(at >= fault.at_s) & (at < again_s)] = False
        after = at >= again_s
        rows["seq"][after] = np.arange(int(after.sum())) & 0xFF
        rows["t_us"][after] = np.round((at[after] - fault.at_s) * own_clock * 1e6).astype(np.int64)
        rows["flags"][after & (at < again_s + RESTARTED_S)] |= _flag("restarted")
        rows["flags"][after & (at < again_s + UNSETTLED_S)] &= 0xFF - _flag("attitude_valid")
    return sent


def transfer(start: int, data: bytes) -> ImuPacket:
    """Return the packet that begins at a tick."""
    transfer_s = (len(data) + 1) * BYTE_S
    return ImuPacket(start, start + round(transfer_s * TICKS_PER_S), packet("imu").address, data)


def _damage(
    fault: Fault, at: Array, packets: list[ImuPacket], rng: np.random.Generator
) -> list[ImuPacket]:
    """Alter or drop packets on their way to the Mega during a fault."""
    if fault.kind not in ("imu_garbage", "imu_short", "imu_repeated"):
        return packets
    hit = fault.inside(at) & (rng.random(len(at)) < fault.amount)
    twice = []
    for i in np.flatnonzero(hit).tolist():
        p = packets[i]
        if fault.kind == "imu_repeated":
            delay_ticks = round(REPEATED_AFTER_S * TICKS_PER_S)
            twice.append(replace(p, start=p.start + delay_ticks, end=p.end + delay_ticks))
        elif fault.kind == "imu_short":
            size = int(rng.integers(1, len(p.data)))
            end = p.start + round((size + 1) * BYTE_S * TICKS_PER_S)
            packets[i] = replace(p, end=end, data=p.data[:size])
        else:
            broken = bytearray(p.data)
            broken[int(rng.integers(len(broken)))] ^= 1 << int(rng.integers(8))
            packets[i] = replace(p, data=bytes(broken))
    return sorted([*packets, *twice], key=lambda p: p.start)
