"""Cards that cannot be recorded on, at power-on: each said so, the pilot's pulses go through."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from flight.card_files import findings
from flight.rig import CRUISE_US, MEGA_US, FlightRig, make_card
from flight.servos import LONGEST_GAP_MS, spoiled, worst_gap_ms
from simavr_bench import in_fork
from simavr_bench.heartbeat import Beats

EXFAT = b"\xeb\x76\x90EXFAT   "


@dataclass(frozen=True, slots=True)
class BadCard:
    """One row.

    Attributes
    ----------
    injected, said : str
        What is wrong, and the words of the status line.
    make : callable
        Makes the image.
    flashes : int
        Flashes of LED and buzzer in a group.
    prepare : callable
        Done to the rig before power-on.
    """

    injected: str
    said: str
    make: Callable[[Path], Path]
    flashes: int
    prepare: Callable[[FlightRig], object] = lambda rig: None


def empty(path: Path) -> Path:
    """Format a card."""
    return make_card(path)


def unformatted(path: Path) -> Path:
    """Nothing but zeros."""
    with make_card(path).open("r+b") as file:
        file.write(bytes(64 * 512))
    return path


def exfat(path: Path) -> Path:
    """The boot sector of an exFAT volume."""
    with make_card(path).open("r+b") as file:
        file.write(EXFAT + bytes(499))
        file.seek(510)
        file.write(b"\x55\xaa")
    return path


def fill(path: Path, name: str, mebibytes: int) -> None:
    """Put a file of so many MiB on a card."""
    filler = path.with_name("filler")
    with filler.open("wb") as file:
        file.truncate(mebibytes << 20)
    subprocess.run(
        ["mcopy", "-i", str(path), str(filler), f"::{name}"], check=True, capture_output=True
    )


def full(path: Path) -> Path:
    """A file leaves 5.4 MiB, and 15 minutes need 7.2."""
    make_card(path)
    fill(path, "FILLER.DAT", 294)
    return path


def fragmented(path: Path) -> Path:
    """Room enough, but a file every 6 MiB."""
    make_card(path)
    for number in range(4):
        fill(path, f"GAP{number}.DAT", 6)
        fill(path, f"KEEP{number}.DAT", 1)
    fill(path, "FILLER.DAT", 265)
    for number in range(4):
        subprocess.run(["mdel", "-i", str(path), f"::GAP{number}.DAT"], check=True)
    return path


def last_number(path: Path) -> Path:
    """No number is left for another file."""
    make_card(path)
    content = path.with_name("last")
    content.write_bytes(b"the last flight" * 100)
    subprocess.run(
        ["mcopy", "-i", str(path), str(content), "::FLT99999.BIN"], check=True, capture_output=True
    )
    return path


def dead_sector(rig: FlightRig) -> None:
    """Every read fails."""
    rig.card.fail_reads()


BAD_CARDS = (
    BadCard("no card at boot", "missing", empty, 2, lambda rig: rig.card.remove()),
    BadCard("card not formatted", "not FAT32", unformatted, 3),
    BadCard("card with exFAT", "not FAT32", exfat, 3),
    BadCard("card that cannot be read", "unreadable", empty, 4, dead_sector),
    BadCard("card full", "full", full, 5),
    BadCard("card in pieces", "fragmented", fragmented, 6),
    BadCard("card with FLT99999.BIN", "full", last_number, 5),
)


@dataclass(slots=True)
class BootOutcome:
    """What was seen."""

    gap_ms: float
    beats: Beats
    said: str
    wrong: list[str]


def beeps_in_group(rig: FlightRig) -> set[int]:
    """Lengths of the groups of beeps that are over, the first left out."""
    at, level = rig.chip.edges("PH4")
    rises = at[level == 1].astype(np.int64)
    breaks = np.flatnonzero(np.diff(rises) > 16_000_000) + 1
    groups = [len(group) for group in np.split(rises, breaks)]
    return set(groups[1:-1])


def boot(elf: Path, folder: Path, bad: BadCard) -> BootOutcome:
    """Power on with a card, take off with the Mega driving; only in a child of in_fork."""
    image = bad.make(folder / "bad.img")
    before = image.read_bytes() if bad.make is last_number else b""
    rig = FlightRig(elf, image, in_place=False)
    rig.chip.watch("PH4")
    bad.prepare(rig)
    rig.power_on()
    rig.chip.run_s(12.0)
    rig.receiver.width_us[3] = CRUISE_US
    rig.chip.run_s(1.5)
    rig.receiver.width_us[4] = MEGA_US
    since = rig.chip.cycle
    rig.chip.run_s(3.0)
    line = rig.status_lines()[-2]
    gap_ms, beats = worst_gap_ms(rig, since), rig.beats()
    beeps = beeps_in_group(rig)
    wrong = beats.wrong()
    if bad.said not in line.partition("| card ")[2].partition(" |")[0]:
        wrong.append(f"says: {line}")
    if beeps != {bad.flashes}:
        wrong.append(f"beeps in groups of {sorted(beeps)}, not {bad.flashes}")
    if not rig.relay.engaged:
        wrong.append("the receiver drives")
    if gap_ms > LONGEST_GAP_MS:
        wrong.append(f"gap of {gap_ms:.0f} ms")
    if max(spoiled(rig, since, servo) for servo in rig.relay.servos) > 1:
        wrong.append("spoilt pulses")
    judge_card(bad, rig, folder, wrong)
    if before and rig.card.block(0, rig.card.blocks) != before:
        wrong.append("the card was changed")
    rig.chip.close()
    return BootOutcome(gap_ms, beats, bad.said, wrong)


def judge_card(bad: BadCard, rig: FlightRig, folder: Path, wrong: list[str]) -> None:
    """Nothing written to a card that is not FAT32; else nothing that fsck.vfat objects to."""
    written = rig.card.count().written
    if bad.flashes <= 4 and written:
        wrong.append(f"{written} blocks written")
    if bad.flashes > 4:
        left = findings(rig.save_card(folder / "after.img"))
        wrong += [f"fsck.vfat found {left[:200]}"] if left else []


def run_boots(elf: Path, folder: Path, *, only: str = "") -> int:
    """Print a row for each bad card; gives the number of wrong ones."""
    bad_rows = 0
    for bad in BAD_CARDS:
        if only not in bad.injected:
            continue
        seen = in_fork(partial(boot, elf, folder, bad))
        bad_rows += bool(seen.wrong)
        said = "NOT: " + "; ".join(seen.wrong) if seen.wrong else f'"{seen.said}"'
        text = f"{bad.flashes} beeps, Mega may drive"
        print(
            f"5   {bad.injected:31} {text:33} {seen.gap_ms:4.0f} {'-':>5} {'-':>6} "
            f"{seen.beats.gate_volt:5.2f}  {said}",
            flush=True,
        )
    return bad_rows
