"""Fly two scripted minutes, take the log out of the card, decode it, compare.

All of it is simulated on this computer; nothing here was measured on a board or in flight.
Results stay in build/scripted. Exit codes: 0 every channel agrees with the script, 6 one does not
or a step failed.
"""

from __future__ import annotations

import argparse
import mmap
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from host.log import FlightLog, read_log
from host.twin.recorder.sitl_library import TICKS_PER_S, Recorder, Sitl

from tests.sitl.card_image import (
    BLOCK,
    CARD_ID,
    blocks_for,
    format_fat32,
    list_files,
    read_file,
)
from tests.sitl.compare import Difference, compare
from tests.sitl.script import Script, script

ROOT = Path(__file__).resolve().parents[2]
DEMO = ROOT / "build" / "scripted"
CLUSTER_BLOCKS = 8
NAME = "FLT00001.BIN"
GROUND_S = 25.0
START_S, IDLE_S, STOP_S, END_S = 2.0, 121.0, 122.0, 128.0
RATES_HZ = {"ident": 100, "mag": 15, "attitude": 10, "baro": 25, "gps": 5, "system": 1}


class DemoError(Exception):
    """A step went wrong; the text says what was found and what was expected."""


def say(text: str) -> None:
    """Tell the progress."""
    print(f"demo: {text}", file=sys.stderr, flush=True)


def new_card_file(path: Path) -> None:
    """Make the image of an empty FAT32 card, partitioned as cards are sold; a sparse file."""
    path.unlink(missing_ok=True)
    path.touch()
    with path.open("r+b") as file:
        file.truncate(blocks_for(CLUSTER_BLOCKS, partitioned=True) * BLOCK)
        image = mmap.mmap(file.fileno(), 0)
        view = memoryview(image)
        format_fat32(view, CLUSTER_BLOCKS, partitioned=True)
        view.release()
        image.close()


def fly(card: Path, flight: Script) -> None:
    """Let the firmware live through the script: a file on the ground, record, stop, close."""
    sitl = Sitl()
    with card.open("r+b") as file, mmap.mmap(file.fileno(), 0) as image:
        sitl.insert_card(image, CARD_ID)
        sitl.power_on()  # on the ground: a bare board needs 18 s to know it
        sitl.run_for(GROUND_S)
        sitl.power_cut()
        sitl.close()
        sitl = Sitl()
        sitl.insert_card(image, CARD_ID)
        flight.give(sitl)
        sitl.press(round(START_S * TICKS_PER_S), 0.3)
        sitl.press(round(STOP_S * TICKS_PER_S), 2.5)
        sitl.power_on()
        for second in range(1, int(END_S) + 1):
            sitl.run_until(second * TICKS_PER_S)
            if second % 32 == 0:
                say(f"  {second} s of {END_S:.0f} s simulated")
        state = sitl.state()
        if state.recorder != Recorder.READY:
            raise DemoError(f"recorder ends {Recorder(state.recorder).name}, expected READY")
        sitl.close()


def decode(flight: Path) -> None:
    """Run `host decode` as a user does; it prints duration, rates, frames, losses, files."""
    command = [sys.executable, "-m", "host", "decode", str(flight)]
    say("host decode flight.bin")
    done = subprocess.run(command, cwd=flight.parent, stdin=subprocess.DEVNULL, check=False)
    if done.returncode != 0:
        raise DemoError(f"host decode ended with {done.returncode}, expected 0")


def check_counts(log: FlightLog) -> None:
    """Every frame is there, at its rate, and nothing was lost."""
    ident = log.frames["ident"]
    seconds = len(ident) / RATES_HZ["ident"]
    for name, rate_hz in RATES_HZ.items():
        found = len(log.frames[name])
        if abs(found - rate_hz * seconds) > max(2.0, 0.02 * rate_hz * seconds):
            raise DemoError(f"{found} frames {name}, expected {rate_hz * seconds:.0f}")
    steps = (ident["count"][1:] - ident["count"][:-1]) != 1
    if steps.any() or log.complete != "complete":
        raise DemoError(f"{int(steps.sum())} gaps in ident.count, log {log.complete}")
    if seconds < IDLE_S - START_S:
        raise DemoError(f"{seconds:.1f} s recorded, expected {STOP_S - START_S:.1f} s")


def table(differences: Sequence[Difference]) -> str:
    """Lay out the differences, in raw steps of each channel."""
    head = (
        f"{'channel':<24}{'samples':>8}{'lowest':>13}{'highest':>13}{'difference':>12}{'step':>6}"
    )
    lines = [head]
    lines += [
        f"{d.channel:<24}{d.samples:>8}{d.low:>13}{d.high:>13}{d.largest:>12}{d.allowed:>6}"
        f"{'' if d.good else '  WRONG'}"
        for d in differences
    ]
    return "\n".join(lines)


def run(folder: Path) -> None:
    """Fly, decode, compare; raises DemoError if anything is not as scripted."""
    folder.mkdir(parents=True, exist_ok=True)
    say("building the firmware for this computer")
    built = subprocess.run(
        [sys.executable, "firmware/toolchain/build_sitl.py"],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        check=False,
    )
    if built.returncode != 0:
        raise DemoError("the firmware does not build; the compiler's words stand above")
    say("writing the script of a flight")
    flight = script(END_S, idle_from_s=IDLE_S)
    card = folder / "card.img"
    new_card_file(card)
    say(f"flying {END_S:.0f} s in simulated time")
    begin_s = time.process_time()
    fly(card, flight)
    speed = END_S / (time.process_time() - begin_s)
    files = list_files(card, partitioned=True)
    say("taking flight.bin out of the card: " + ", ".join(f"{n} {s} B" for n, s in files.items()))
    log_path = folder / "flight.bin"
    log_path.write_bytes(read_file(card, NAME, partitioned=True))
    decode(log_path)
    log = read_log(log_path)
    check_counts(log)
    differences = compare(log.frames, flight)
    print("\nThe log against the script, raw counts; 'step' is the quantisation allowed:")
    print(table(differences))
    wrong = [d.channel for d in differences if not d.good]
    if wrong:
        raise DemoError(f"not as scripted: {', '.join(wrong)}")
    print(f"\nall {len(differences)} channels as scripted; flown at {speed:.0f} times real time")


def main() -> int:
    """Run the demo; 6 with one line if something is wrong."""
    parser = argparse.ArgumentParser(description="Fly two scripted minutes and compare.")
    parser.add_argument("-o", "--output", type=Path, default=DEMO, help="folder of the results")
    try:
        run(parser.parse_args().output.resolve())
    except (DemoError, OSError) as error:
        print(f"demo: {error}", file=sys.stderr)
        return 6
    return 0


if __name__ == "__main__":
    sys.exit(main())
