"""What the tests of this folder share: an instrument with a card, and its logs."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from host.log import FlightLog, read_log
from host.twin.recorder.sitl_library import TICKS_PER_S, Recorder, Sitl
from numpy.typing import NDArray

from tests.sitl import script as scripted
from tests.sitl.card_image import CARD_ID, list_files, new_card, read_file
from tests.sitl.script import Script, script

ROOT = Path(__file__).resolve().parents[2]
FILE_BLOCKS = 4000  # 2 MB: small enough that old blocks are met again soon
FSCK = "/usr/sbin/fsck.vfat"
START_S = 0.5
GROUND_S = 25.0  # a bare board has nobody that says still: 18 s
EVENTS = {
    "session_start": 1, "session_end": 2, "frames_dropped": 3, "block_skipped": 4, "card_stall": 5,
    "card_removed": 7, "imu_lost": 8, "imu_found": 9, "baro_lost": 11, "receiver_lost": 15,
    "reset": 18, "flight_state": 30, "relay_lost": 31, "receiver_refused": 32,
}  # fmt: skip


@cache
def flight(seconds: float, frame_us: float = 20_000.0, simultaneous: bool = False) -> Script:
    """Return a scripted flight; throttle is idle in its last 15 s."""
    return script(seconds, frame_us=frame_us, simultaneous=simultaneous, idle_from_s=seconds - 15.0)


@cache
def config_places() -> dict[str, tuple[int, int]]:
    """Return first byte and size of the integers of the frame `config`, without its id."""
    text = (ROOT / "protocol" / "generated" / "schema.json").read_text(encoding="utf-8")
    frames = json.loads(text)["schema"]["frames"]
    fields = next(frame["fields"] for frame in frames if frame["name"] == "config")
    places, at = {}, 0
    for name, kind, *_ in fields:
        size = int(kind[5:-1]) if kind.startswith("char") else int(kind[1:]) // 8
        places[name] = (at, size)
        at += size
    return places


@cache
def prepared_card(file_blocks: int) -> bytes:
    """Return the smallest card as a power-on on the ground leaves it: its first file prepared."""
    image = new_card()
    sitl = Sitl()
    sitl.set_file_blocks(file_blocks)
    sitl.insert_card(image, CARD_ID)
    sitl.power_on()
    sitl.run_for(GROUND_S)
    assert sitl.state().recorder == Recorder.READY
    sitl.power_cut()
    return bytes(image)


class Bench:
    """An instrument with a small card; button and power as a test wants them.

    Without an image the card has its first file already: most flights here begin in the air.
    """

    def __init__(self, image: bytearray | None = None, *, file_blocks: int = FILE_BLOCKS) -> None:
        self.image = bytearray(prepared_card(file_blocks)) if image is None else image
        self.sitl = Sitl()
        self.sitl.set_file_blocks(file_blocks)
        self.sitl.insert_card(self.image, CARD_ID)

    def configure(self, **changed: int) -> None:
        """Change settings by their names in the frame `config`; KeyError for an unknown one."""
        config = self.sitl.default_config()
        places = config_places()
        for name, value in changed.items():
            start, size = places[name]
            config[start : start + size] = value.to_bytes(size, "little")
        self.sitl.set_config(config)

    def set_rate(self, rate_hz: int) -> None:
        """Change the identification rate in the settings."""
        self.configure(rate_hz=rate_hz)

    def power_on_and_record(self, seconds: float) -> None:
        """Power on, let it boot and prepare a file, start recording and let it run."""
        self.sitl.power_on()
        self.sitl.run_for(START_S)
        self.wait_ready()
        self.record(seconds)

    def wait_ready(self) -> None:
        """Run until a file is prepared, as long as a bare board on the ground needs for it."""
        until = self.sitl.now() + int(GROUND_S * TICKS_PER_S)
        while self.state() != Recorder.READY and self.sitl.now() < until:
            self.sitl.run_for(0.5)
        assert self.state() == Recorder.READY

    def record(self, seconds: float) -> None:
        """Start recording with the button and let it run."""
        self.sitl.press(self.sitl.now() + 2000, 0.2)
        self.sitl.run_for(seconds)
        assert self.state() == Recorder.RECORDING

    def stop(self) -> None:
        """Stop with a long press and wait until the next file is prepared."""
        self.sitl.press(self.sitl.now() + 2000, 2.5)
        self.sitl.run_for(4.0)
        self.wait_ready()

    def state(self) -> Recorder:
        """What the recorder is doing."""
        return Recorder(self.sitl.state().recorder)

    def files(self) -> dict[str, int]:
        """Name and size of the files on the card."""
        return list_files(bytes(self.image))

    def log(self, folder: Path, number: int = 1, *, session: int | None = None) -> FlightLog:
        """Take a file out of the card and decode it."""
        path = folder / f"FLT{number:05d}.BIN"
        path.write_bytes(read_file(bytes(self.image), path.name))
        return read_log(path, session=session)

    def fsck(self, folder: Path) -> str:
        """Return what fsck.vfat finds wrong; empty if the card is clean."""
        path = folder / "card.img"
        with path.open("wb") as file:
            # Boot record, tables and root folder; the data behind them does not matter to it.
            file.write(memoryview(self.image)[: 2 << 20])
            file.truncate(len(self.image))
        done = subprocess.run([FSCK, "-n", str(path)], capture_output=True, text=True, check=False)
        return "" if done.returncode == 0 else done.stdout


def events(log: FlightLog, name: str) -> list[int]:
    """Return the arguments of an event, in the order of the log."""
    found = log.frames["event"]
    return [int(arg) for arg in found["arg"][found["code"] == EVENTS[name]]]


def causes(log: FlightLog, name: str) -> list[str]:
    """Return why sessions began (`session_start`) or ended (`session_end`), in the log's words."""
    table = {"session_start": "start_cause", "session_end": "end_cause"}[name]
    return [log.schema.word(table, arg) for arg in events(log, name)]


def missing(count: NDArray[np.uint16]) -> int:
    """Return how many identification frames the 16-bit counter says are missing."""
    return int((np.diff(count).astype(np.uint16) - np.uint16(1)).astype(np.int64).sum())


def idle_receiver(
    sitl: Sitl, first_s: float, last_s: float, *, throttle_us: int = 1100, switch_us: int = 1100
) -> None:
    """Give steady pulses, the switch at direct."""
    count = int((last_s - first_s) * 50)
    width = np.tile(np.array([3000, 3000, 3000, 2 * throttle_us, 2 * switch_us]), (count, 1))
    start = np.round((first_s + np.arange(count) * 0.02) * TICKS_PER_S).astype(np.int64)
    offsets = np.arange(5) * 5000
    sitl.add_edges(*scripted.Receiver(start[:, None] + offsets, width).edges())


def spread(seed: int, count: int, low_s: float, high_s: float) -> Sequence[float]:
    """Return random instants, the same for the same seed."""
    return [float(t) for t in np.random.default_rng(seed).uniform(low_s, high_s, count)]
