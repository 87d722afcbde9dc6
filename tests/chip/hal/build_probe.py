"""Link the board's hal with the probe program."""

from __future__ import annotations

import subprocess
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
BOARDS = ROOT / "firmware" / "boards"
BOARD = BOARDS / "mega2560"
SHARED = BOARDS / "avr"
HAL = ROOT / "firmware" / "hal"
PARTS = [
    "clock",
    "pulse_capture",
    "servo_output",
    "relay",
    "panel",
    "imu_bus",
    "baro_bus",
    "analog_input",
    "serial",
    "system",
]
FLAGS = [
    *("-mmcu=atmega2560", "-DF_CPU=16000000UL", "-std=gnu++14", "-Os", "-g"),
    *("-Wall", "-Wextra", "-Werror", "-ffunction-sections", "-Wl,--gc-sections"),
    *("-fno-exceptions", "-fno-threadsafe-statics", f"-I{ROOT}/firmware", f"-I{ROOT}/protocol"),
]


def build_probe() -> Path:
    """Compile probe.cpp with the files of boards/mega2560 and boards/avr.

    Returns
    -------
    Path
        The ELF.

    Raises
    ------
    RuntimeError
        If the compiler refuses; the text is its own.
    """
    target = ROOT / "build" / "chip" / "hal" / "probe.elf"
    sources = [HERE / "probe.cpp", *(BOARD / f"{part}.cpp" for part in PARTS)]
    sources += sorted(SHARED.glob("*.cpp"))
    headers = [path for room in (BOARD, SHARED, HAL) for path in room.glob("*.h")]
    inputs = [*sources, *headers]
    made = target.stat().st_mtime if target.exists() else 0.0
    if any(path.stat().st_mtime > made for path in inputs):
        target.parent.mkdir(parents=True, exist_ok=True)
        command = ["avr-g++", *FLAGS, *map(str, sources), "-o", str(target)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"compiling the hal probe failed:\n{done.stderr}")
    return target
