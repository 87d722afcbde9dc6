"""The recorder as the real ELF in the chip simulator: a program of its own, started by path.

The simulator is under the GPL; nothing of it is imported or linked. Stimuli go in as a file, the
card's image comes back.
"""

from __future__ import annotations

import json
import mmap
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from host.errors import UsageError
from host.resources import CLONE
from host.twin.faults import Fault, recorder_actions
from host.twin.recorder import sitl
from host.twin.recorder.recorder_build import existing_library
from host.twin.recorder.sitl import (
    CLOSE_S,
    LET_GO_S,
    PRESS_S,
    Recording,
    card_image,
    check_duration,
    file_of,
)
from host.twin.recorder.stimuli import SAMPLE_STEP_TICKS, Stimuli
from host.twin.sensors.mega_clock import TICKS_PER_S

REPLAY = CLONE / "tests" / "chip" / "replay.py"
ELF = CLONE / ".pio" / "build" / "mega2560" / "firmware.elf"
PACKET_ROOM = 40
SPARSE_STEP = 1 << 20
DEFAULT_RATE_HZ = 100
NOT_ON_CHIP = {
    "clock_wrap": "the chip's clock starts at 0",
    "telemetry_blocked": "its modem has no line to stop the chip",
}


def record(
    given: Stimuli,
    *,
    rate_hz: int,
    aircraft: str,
    faults: Sequence[Fault] = (),
    seed: int = 0,
    progress: Callable[[float], None] = lambda _: None,
) -> Recording:
    """Run the Mega's image through a flight in the chip simulator.

    Parameters and return value are those of `sitl.record`.

    Raises
    ------
    UsageError
        Image or simulator are not built, or the simulator refused.
    """
    check_duration(given)
    elf = Path(os.environ.get("HOST_ELF", ELF))
    replay = Path(os.environ.get("HOST_REPLAY", REPLAY))
    for path, how in ((elf, "`pio run`"), (replay, "a clone with tests/chip")):
        if not path.is_file():
            raise UsageError(f"no {path}: --firmware avr needs {how}; --firmware sitl does not")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _write(given, folder / "stimuli.npz")
        _sparse(card_image(faults), folder / "card.img")
        command = [sys.executable, str(replay), str(elf), str(folder / "stimuli.npz"),
                   str(folder / "card.img"), "--close-s", str(CLOSE_S),
                   "--seed", str(seed)]  # fmt: skip
        damaged = any(fault.kind == "settings_damaged" for fault in faults)
        library = existing_library() is not None
        if damaged or rate_hz != DEFAULT_RATE_HZ or library:
            (folder / "eeprom.bin").write_bytes(sitl.eeprom(rate_hz, aircraft, damaged=damaged))
            command += ["--eeprom", str(folder / "eeprom.bin")]
        for fault in faults:
            if fault.kind in NOT_ON_CHIP:
                raise UsageError(f"{fault.kind}: {NOT_ON_CHIP[fault.kind]}; use --firmware sitl")
            if fault.kind in ("power_cut", "card_absent"):
                command += ["--fault", f"{fault.kind}:{fault.at_s:g}"]
        for action in recorder_actions(faults):
            command += ["--fault", f"{action.what}:{action.at_s:g}:{action.value:g}"]
        summary = _run(command, progress)
        with (folder / "card.img").open("rb") as file:
            image = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        log, file_name = file_of(image, faults)
        image.close()
    lost = summary.get("uart_bytes_lost", [0, 0, 0, 0])
    return Recording(log, file_name, 0, 0, int(lost[2]) if isinstance(lost, list) else 0)


def _write(given: Stimuli, path: Path) -> None:
    packets = given.packets
    data = b"".join(p.data.ljust(PACKET_ROOM, b"\0") for p in packets)
    press = np.array([PRESS_S, LET_GO_S]) * TICKS_PER_S
    np.savez(
        path,
        allow_pickle=False,
        duration=np.int64(given.duration),
        step=np.int64(SAMPLE_STEP_TICKS),
        edge_at=given.edges["at"],
        edge_levels=given.edges["levels"],
        packet_start=np.array([p.start for p in packets], dtype=np.int64),
        packet_address=np.array([p.address for p in packets], dtype=np.uint8),
        packet_size=np.array([len(p.data) for p in packets], dtype=np.uint8),
        packet_data=np.frombuffer(data, dtype=np.uint8).reshape(-1, PACKET_ROOM),
        analog=given.analog,
        pressure=given.pressure,
        coefficients=np.array(given.coefficients, dtype=np.int64),
        gps_at=given.gps["at"],
        gps_value=given.gps["levels"],
        button_at=press.astype(np.int64),
    )


def _sparse(image: mmap.mmap, path: Path) -> None:
    """Write an image without its zeros."""
    nothing = bytes(SPARSE_STEP)
    with path.open("wb") as out:
        for place in range(0, len(image), SPARSE_STEP):
            piece = image[place : place + SPARSE_STEP]
            if piece != nothing[: len(piece)]:
                out.seek(place)
                out.write(piece)
        out.truncate(len(image))


def _run(command: list[str], progress: Callable[[float], None]) -> dict[str, object]:
    words = ""
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as running:
        assert running.stderr is not None
        assert running.stdout is not None
        try:
            for line in running.stderr:
                if line.strip().endswith(" %"):
                    progress(float(line.split()[0]) / 100.0)
                else:
                    words += line
            answer = running.stdout.read()
        except BaseException:
            running.kill()  # interrupted: the simulator must not fly on alone
            raise
    if running.returncode != 0:
        last = words.strip().splitlines()[-1] if words.strip() else "no word"
        raise UsageError(f"the chip simulator ended with {running.returncode}: {last}")
    summary: dict[str, object] = json.loads(answer)
    return summary
