"""The flight image on the simulated chip, with everything it flies with around it."""

from __future__ import annotations

import math
import mmap
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from devices.ardu_imu import ArduImu, ImuSample
from flight.card_files import copy_out
from host.wire.extents import data_extents
from host.wire.framing import text_of
from host.wire.schema_text import packed_schema
from simavr_bench import (
    Bmp085,
    CardKind,
    ChargePumpRelay,
    Chip,
    GpsUart,
    Receiver,
    SdCard,
)
from simavr_bench.heartbeat import Beats, judge_beats
from simavr_bench.log import LogKind

BOOTLOADER = Path(
    "/usr/share/arduino/hardware/arduino/avr/bootloaders/stk500v2/stk500boot_v2_mega2560.hex"
)
IMU_FLAGS = sum(
    packed_schema().bit("imu_flags", word) for word in ("attitude_valid", "offsets_valid")
)
HEARTBEAT = "PH5"
THRESHOLDS_VOLT = (0.8, 1.5)  # BSS138, least and most
RECEIVER_PINS = ("PK0", "PK1", "PK2", "PK3", "PK4")
SERVOS = {
    "aileron": ("PK0", "PE4"),
    "elevator": ("PK1", "PE5"),
    "rudder": ("PK2", "PB5"),
    "throttle": ("PK3", "PE3"),
}
# ADC channel of each scan slot, as hw/pin_map.toml gives them.
ANALOG_CHANNELS = (1, 5, 2, 6, 3, 4, 7, 13, 0, 14, 15)
CYCLES_PER_US = 16

GROUND_S = 11.0
STANDING_CMPS, FLYING_CMPS = (20, -10, 0), (1200, -300, 10)
IDLE_US, CRUISE_US = 1000.0, 1500.0
DIRECT_US, MEGA_US = 1000.0, 1900.0


def make_card(path: Path, *, mebibytes: int = 300) -> Path:
    """Format an empty FAT32 card image with room for two flight files."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    subprocess.run(
        ["mkfs.vfat", "-F", "32", "-s", "8", "-C", str(path), str(mebibytes * 1024)],
        check=True,
        capture_output=True,
    )
    return path


def numbered(time_s: float) -> ImuSample:
    """Give samples that differ from each other in every channel."""
    step = round(time_s * 200)
    return ImuSample(
        (step % 16000, -(step % 15000), step % 14000),
        (100 + step % 500, 200 - step % 300, -8192 + step % 200),
        (step % 9000, -(step % 8000), step % 18000 - 9000),
    )


def at_rest(time_s: float) -> ImuSample:
    """Give samples of an aircraft on the ground: noise that no two neighbours share."""
    step = round(time_s * 200)
    return ImuSample(
        (step % 31, -(step % 29), step % 27),
        (100 + step % 200, 200 - step % 150, -8192 + step % 170),
        (100 + step % 50, 200 - step % 40, 9000 + step % 60),
    )


@dataclass
class FlightRig:
    """A powered-off instrument; `take_off` brings it to recording with the Mega driving.

    Parameters
    ----------
    elf : Path
        The flight image.
    card_image : Path
        FAT32 image; changed in place.
    imu_hz : float
        Rate of the IMU's packets.
    frame_s, sequential : float, bool
        The receiver.
    busy_s, read_s, init_s : float
        Card busy after every block, before each block read, before it is ready.
    bootloader : bool
        Start in Debian's Mega bootloader, after the 65 ms of start-up that the fuses ask for.
    in_place : bool
        Write into the image; else into private pages, so that each child of in_fork has a card of
        its own, kept with `save_card`.
    card_kind : CardKind
        How the card is addressed.
    threshold_volt : float or None
        Threshold of the relay's transistor; None: the end of its data sheet that is worse for each
        movement.
    ground_s : float
        IMU and GPS stand still for so long after power-on, then move; 0: it wakes in flight.
    source : callable
        What the IMU sends while it moves.
    """

    elf: Path
    card_image: Path
    imu_hz: float = 100.0
    frame_s: float = 0.020
    sequential: bool = True
    busy_s: float = 0.005
    read_s: float = 0.0002
    init_s: float = 0.05
    bootloader: bool = False
    in_place: bool = True
    card_kind: CardKind = CardKind.SDHC
    threshold_volt: float | None = None
    ground_s: float = GROUND_S
    source: Callable[[float], ImuSample] = numbered
    sticks: Callable[[float], Sequence[float]] | None = None
    chip: Chip = field(init=False)
    receiver: Receiver = field(init=False)
    imu: ArduImu = field(init=False)
    gps: GpsUart = field(init=False)
    baro: Bmp085 = field(init=False)
    card: SdCard = field(init=False)
    relay: ChargePumpRelay = field(init=False)
    started: list[int] = field(default_factory=list)
    moving: bool = False

    def __post_init__(self) -> None:
        """Wire everything; nothing has power yet."""
        if self.bootloader:
            self.chip = Chip(bootloader=True)
            self.chip.load(BOOTLOADER)
        else:
            self.chip = Chip(startup_s=0.0)
        self.chip.load(self.elf)
        self.card = SdCard(
            self.chip,
            "PB0",
            image=self.card_image,
            busy_s=self.busy_s,
            read_s=self.read_s,
            init_s=self.init_s,
            in_place=self.in_place,
            kind=self.card_kind,
        )
        self.receiver = Receiver(
            self.chip, RECEIVER_PINS, frame_s=self.frame_s, sequential=self.sequential
        )
        self.receiver.width_us = [CRUISE_US, CRUISE_US, CRUISE_US, IDLE_US, DIRECT_US]
        self.imu = ArduImu(
            self.chip, rate_hz=self.imu_hz, scl_hz=400_000.0, source=self._sample, flags=IMU_FLAGS
        )
        self.gps = GpsUart(self.chip, 2, knows_pvt=True, velocity_cmps=STANDING_CMPS)
        self.baro = Bmp085(self.chip, "PA2", "PA3")
        self.relay = ChargePumpRelay(self.chip, HEARTBEAT, SERVOS, sense="PH6")
        if self.threshold_volt is not None:
            self.relay.on_volt = self.relay.off_volt = self.threshold_volt
        self.chip.on_start(self.started.append)
        for slot, channel in enumerate(ANALOG_CHANNELS):
            self.chip.analog(channel, 0.8 + 0.33 * slot, noise_lsb=0.5)

    def power_on(self) -> None:
        """Give power to chip, receiver, IMU and GPS."""
        self.chip.power_on()
        self.receiver.start()
        self.imu.start()
        self.gps.start()
        if self.ground_s > 0.0:
            self.stand()
            self.chip.at(self.chip.cycle + round(self.ground_s * CYCLES_PER_US * 1e6), self.fly)
        else:
            self.fly()

    def stand(self) -> None:
        """Let IMU and GPS stand still, as on the ground."""
        self.moving, self.gps.velocity_cmps = False, STANDING_CMPS

    def fly(self) -> None:
        """Let IMU and GPS move."""
        self.moving, self.gps.velocity_cmps = True, FLYING_CMPS

    def _sample(self, time_s: float) -> ImuSample:
        return self.source(time_s) if self.moving else at_rest(time_s)

    def take_off(self, *, ground_s: float = 12.0) -> None:
        """Power on, wait on the ground, throttle up, switch to direct and then to Mega."""
        self.power_on()
        self.chip.run_s(ground_s)
        self.receiver.width_us[3] = CRUISE_US
        self.chip.run_s(1.5)
        self.receiver.width_us[4] = MEGA_US
        self.chip.run_s(0.5)

    def beats(self, *, may_stop: bool = False) -> Beats:
        """Judge the heartbeat so far, at the worst tolerances of its pump.

        Parameters
        ----------
        may_stop : bool
            Whether the Mega may have ceased to drive.
        """
        cycles, levels = self.chip.edges(HEARTBEAT)
        if not may_stop:
            return judge_beats(cycles, levels, until=self.chip.cycle)
        # An edge at the cycle of a reset is the chip letting its pin go, not a beat.
        beat = ~np.isin(cycles, self.chip.records(LogKind.RESET)["cycle"])
        return judge_beats(cycles[beat], levels[beat], may_stop=True)

    def status_lines(self) -> list[str]:
        """Lines of the USB port so far."""
        return text_of(self.chip.uart_sent(0)).decode("ascii", "replace").splitlines()

    def save_card(self, target: Path) -> Path:
        """Copy the card as it is now to a sparse file: what its image held, and what changed."""
        pages = self.card.changed_pages()
        page = mmap.PAGESIZE
        with self.card_image.open("rb", buffering=0) as image:
            for start, end in data_extents(image, self.card.blocks * 512):
                pages[start // page : -(-end // page)] = True
        edges = np.flatnonzero(np.diff(pages, prepend=False, append=False))
        with target.open("wb", buffering=0) as file:
            file.truncate(self.card.blocks * 512)
            for first, end in edges.reshape(-1, 2).tolist():
                file.seek(first * page)
                file.write(self.card.block(first * page // 512, (end - first) * page // 512))
        return target

    def land(self) -> None:
        """Pull the battery and free the chip."""
        self.chip.power_off()
        self.chip.close()


def take_log(card_image: Path, target: Path, number: int = 1) -> Path:
    """Copy FLTnnnnn.BIN out of the image as a PC would."""
    return copy_out(card_image, f"FLT{number:05d}.BIN", target)


def check_card(card_image: Path) -> None:
    """Raise unless fsck.vfat finds the file system clean."""
    done = subprocess.run(
        ["fsck.vfat", "-n", str(card_image)], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise AssertionError(f"fsck.vfat found:\n{done.stdout}")


def sine(period_s: float, low_us: float, high_us: float) -> Callable[[float], float]:
    """Give a stick that moves to and fro."""
    middle_us, swing_us = (low_us + high_us) / 2, (high_us - low_us) / 2
    return lambda time_s: middle_us + swing_us * math.sin(2 * math.pi * time_s / period_s)
