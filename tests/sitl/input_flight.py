"""A flight with a flight card: ground, sign of the pilot, take-off, one trigger; faults on top.

Times in seconds since power-on. The stimuli are arrays that a fault may alter before they are
given: the receiver's frames, the IMU's packets (5 ms), rows of the analogue inputs and of
the pressure sensor, epochs of the GPS.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from host.twin.recorder.sitl_library import TICKS_PER_S, Sitl
from host.wire.packets import packet
from numpy.typing import NDArray

from tests.sitl.script import COEFFICIENTS, IMU, IMU_ADDRESS, IMU_FLAGS, Gps, Receiver

GROUND_S = 7.0  # by then it is known to be the ground
STIR_S = 5.0
SIGN_S = GROUND_S + STIR_S
UP_S = SIGN_S + 4.0  # throttle up
MEGA_S = UP_S + 5.0
ARMED_S = MEGA_S + 0.8
TRIGGER_S = ARMED_S + 0.3
FRAME_S = 0.02  # of the receiver, where nothing else is asked for
PACKET_S = 0.005
ANALOG_S = 0.005
PRESSURE_S = 0.01
GPS_S = 0.2

AILERON, ELEVATOR, RUDDER, THROTTLE, SWITCH = range(5)
DIRECT_US, MEGA_US, ARMED_US = 1100, 1675, 1900
IDLE_US, CRUISE_US = 1100, 1600
LEAST_US, MOST_US = 1150, 1850  # the travel that the pilot shows
STILL_UP, PASCAL_UP = 95_372.0, 2.67  # at 34.4 kPa by these coefficients; its UP per pascal
CLIMB_PA = 900.0
BAROMETER_NOISE_PA = 3.0  # BMP085 data sheet, rms at its highest resolution
HOME = (247_000_000, 1_210_000_000)


@dataclass(slots=True)
class InputFlight:
    """What reaches the pins.

    Attributes
    ----------
    width_us : (frames, 5) array
        The receiver's; 0: that channel sends no pulse in that frame.
    imu : (packets, 9) array
        As in frame `ident`.
    imu_sent : (packets,) array
        Packets that are sent at all.
    analog : (rows, 11) array
        Counts.
    up : (rows,) array
        Counts of the pressure sensor.
    place : (epochs, 2) array
        Latitude and longitude, 1e-7 deg.
    gps_sent : (epochs,) array
    ground_speed_cmps : (epochs,) array
    button : list of (float, float)
        When it is pressed, and for how long.
    packet_delay_s : float
        Delay of every packet, behind its place.
    apart_us : int
        Rises of two channels; 0: the receiver sends them all at once.
    trigger_s : float
        When the switch was at armed for long enough.
    """

    seconds: float
    width_us: NDArray[np.int64]
    imu: NDArray[np.int64]
    imu_sent: NDArray[np.bool_]
    analog: NDArray[np.float64]
    up: NDArray[np.float64]
    place: NDArray[np.int64]
    gps_sent: NDArray[np.bool_]
    ground_speed_cmps: NDArray[np.int64]
    button: list[tuple[float, float]] = field(default_factory=list)
    frame_s: float = FRAME_S
    packet_delay_s: float = 0.0
    apart_us: int = 2300
    trigger_s: float = TRIGGER_S

    def receiver(self) -> Receiver:
        """Return the pulses that are sent."""
        frames = np.arange(len(self.width_us))
        start = np.round(frames * self.frame_s * TICKS_PER_S).astype(np.int64)[:, None]
        return Receiver(start + 2000 + 2 * self.apart_us * np.arange(5), 2 * self.width_us)

    def edges(self) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
        """Return ticks and levels of the receiver's edges."""
        return _edges(self.receiver())

    def packets(self) -> tuple[NDArray[np.int64], list[bytes]]:
        """Return START and bytes of the IMU's packets that are sent."""
        first_s = 0.003 + self.packet_delay_s
        start = np.round((np.arange(len(self.imu)) * PACKET_S + first_s) * TICKS_PER_S)
        rows = packet("imu").rows(len(self.imu))
        rows["seq"] = np.arange(len(rows)) & 0xFF
        rows["flags"], rows["age"] = IMU_FLAGS, 225
        rows["t_us"] = (start // 2).astype(np.int64) & 0xFFFFFFFF
        for column, name in enumerate(IMU):
            rows[name] = self.imu[:, column]
        sent = self.imu_sent
        return start.astype(np.int64)[sent], packet("imu").sealed(rows[sent])

    def gps_bytes(self) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
        """Return ticks and bytes of the GPS."""
        if not self.gps_sent.any():
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.uint8)
        return _gps(self.place, self.gps_sent, self.ground_speed_cmps).stream()

    def give(self, sitl: Sitl) -> None:
        """Hand all stimuli to the instrument."""
        sitl.add_edges(*self.edges())
        start, packets = self.packets()
        sitl.add_packets(start, IMU_ADDRESS, packets)
        sitl.set_analog(0, round(ANALOG_S * TICKS_PER_S), self.analog)
        raw = np.stack([np.full(len(self.up), 27_898.0), self.up], axis=1)
        sitl.set_pressure(COEFFICIENTS, 0, round(PRESSURE_S * TICKS_PER_S), raw)
        sitl.add_gps(*self.gps_bytes())
        for at_s, seconds in sorted(self.button):
            sitl.press(round(at_s * TICKS_PER_S), seconds)


def input_flight(
    seconds: float, random: np.random.Generator, frame_s: float = FRAME_S
) -> InputFlight:
    """Return a flight in calm air on which every limit holds; the switch is armed to its end."""
    at = np.arange(int(seconds / frame_s)) * frame_s
    width_us = np.full((len(at), 5), 1500, dtype=np.int64)
    # The travel is shown: three sticks together to each end, a second each.
    phase = np.floor((at - GROUND_S) / 1.0)
    stirring = (at >= GROUND_S) & (at < SIGN_S)
    for channel in (AILERON, ELEVATOR, RUDDER):
        width_us[stirring & (phase % 4 == 0), channel] = LEAST_US
        width_us[stirring & (phase % 4 == 2), channel] = MOST_US
    sign = (at >= SIGN_S) & (at < SIGN_S + 3.4)
    width_us[sign, AILERON] = MOST_US
    width_us[sign, RUDDER] = LEAST_US
    width_us[:, THROTTLE] = np.where(at < UP_S, IDLE_US, CRUISE_US)
    width_us[:, SWITCH] = np.select([at < MEGA_S, at < ARMED_S], [DIRECT_US, MEGA_US], ARMED_US)
    # A hand that trembles.
    flying = at >= UP_S
    width_us[flying, :3] += random.integers(-4, 5, (int(flying.sum()), 3))

    at = np.arange(int(seconds / PACKET_S) - 4) * PACKET_S
    imu = np.zeros((len(at), 9), dtype=np.int64)
    imu[:, 5] = -8192
    flying = at >= UP_S
    imu[flying, :9] += random.integers(-300, 301, (int(flying.sum()), 9))
    imu[~flying, :6] += random.integers(-8, 9, (int((~flying).sum()), 6))

    at = np.arange(int(seconds / ANALOG_S) + 4) * ANALOG_S
    analog = 512.0 + random.normal(0.0, 1.0, (len(at), 11))
    analog[:, 4:6] += np.where(at < UP_S, 0.0, np.minimum(150.0, 200.0 * (at - UP_S)))[:, None]

    at = np.arange(int(seconds / PRESSURE_S) + 4) * PRESSURE_S
    climb_pa = np.clip((at - UP_S) / (MEGA_S - UP_S), 0.0, 1.0) * CLIMB_PA
    noise_pa = random.normal(0.0, BAROMETER_NOISE_PA, len(at))
    up = STILL_UP + PASCAL_UP * (noise_pa - climb_pa)

    at = np.arange(int(seconds / GPS_S) - 1) * GPS_S
    gone_m = 15.0 * np.maximum(0.0, at - UP_S)
    north_m = 150.0 * np.sin(gone_m / 150.0)
    east_m = 150.0 * (1.0 - np.cos(gone_m / 150.0))
    place = np.stack([HOME[0] + north_m / 0.0111, HOME[1] + east_m / 0.0101], axis=1)
    return InputFlight(
        seconds, width_us, imu, np.ones(len(imu), dtype=np.bool_), analog, up,
        np.round(place).astype(np.int64), np.ones(len(place), dtype=np.bool_),
        np.where(at >= UP_S, 1500, 10),
        frame_s=frame_s,
    )  # fmt: skip


def _edges(receiver: Receiver) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return the edges of the pulses that are sent."""
    sent = receiver.width.ravel() > 0
    channel = np.tile(1 << np.arange(5), len(receiver.start))[sent]
    rise, fall = receiver.start.ravel()[sent], (receiver.start + receiver.width).ravel()[sent]
    at = np.concatenate([rise, fall])
    order = np.argsort(at, kind="stable")
    levels = np.bitwise_xor.accumulate(np.concatenate([channel, channel])[order])
    last = np.append(np.diff(at[order]) > 0, True)
    return at[order][last], levels[last].astype(np.uint8)


def _gps(
    place: NDArray[np.int64], sent: NDArray[np.bool_], ground_speed_cmps: NDArray[np.int64]
) -> Gps:
    index = np.flatnonzero(sent)
    count = len(index)
    values = {
        name: np.full(count, value)
        for name, value in {
            "week": 2400, "height": 20_000, "v_north": 0, "v_east": 0, "v_down": 0, "course": 0,
            "h_accuracy": 200, "v_accuracy": 300, "s_accuracy": 20, "fix": 3, "satellites": 9,
        }.items()
    }  # fmt: skip
    values["itow_ms"] = 100_000_000 + index * 200
    values["latitude"], values["longitude"] = place[index, 0], place[index, 1]
    values["ground_speed"] = ground_speed_cmps[index]
    return Gps((index * 200_000 + 61_000) * 2, values)
