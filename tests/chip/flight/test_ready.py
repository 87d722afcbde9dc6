"""A card of small clusters: a file is ready in time although the ground is known late."""

from __future__ import annotations

import subprocess
from functools import partial
from pathlib import Path

import pytest

MOVED_S = 1.9  # by hand: two seconds of motion, then five of rest, are the ground at 7 s
GROUND_S = 7.0
READY_S = 10.0
QUARTER_HOUR = 7_000_000  # bytes of 15 minutes at 100 Hz
WHOLE_FILE = 64 << 20


def format_card(path: Path, cluster_blocks: int) -> Path:
    """Make an empty card of 300 MiB."""
    subprocess.run(
        ["mkfs.vfat", "-F", "32", "-s", str(cluster_blocks), "-C", str(path), str(300 * 1024)],
        check=True,
        capture_output=True,
    )
    return path


def ready_times_s(elf: Path, image: Path, until_s: float) -> tuple[float, float, float]:
    """First write, first file ready, whole file ready; seconds after power-on."""
    from flight.rig import FlightRig, check_card
    from simavr_bench import cycles
    from simavr_bench.card_journal import CardJournal

    rig = FlightRig(elf, image, ground_s=100.0)
    journal = CardJournal(rig.card)
    rig.power_on()
    rig.fly()
    rig.chip.at(rig.chip.cycle + cycles(MOVED_S), rig.stand)
    rig.chip.run_until(cycles(until_s))
    rows = journal.records()
    # A file is ready when its entry is written: the root folder is the first cluster.
    name = b"FLT00001BIN"
    entries = [row for row in rows if bytes(row["data"][:11]) == name]
    sizes = [int.from_bytes(bytes(row["data"][28:32]), "little") for row in entries]
    first_s = rows["begun"][0] / 16e6
    at_s = [int(row["ended"]) / 16e6 for row in entries]

    rig.land()
    check_card(image)
    assert sizes[0] > QUARTER_HOUR
    assert sizes[-1] == WHOLE_FILE
    return first_s, at_s[0], at_s[-1]


@pytest.mark.parametrize(
    ("cluster_blocks", "whole_s"),
    [(8, 12.0), pytest.param(2, 24.0, marks=pytest.mark.campaign), (1, 40.0)],
)
def test_a_file_is_ready_although_the_ground_is_known_late(
    flight_elf: Path, tmp_path: Path, cluster_blocks: int, whole_s: float
) -> None:
    from simavr_bench import in_fork

    image = format_card(tmp_path / "card.img", cluster_blocks)
    first_s, ready_s, _ = in_fork(partial(ready_times_s, flight_elf, image, whole_s))
    assert first_s > GROUND_S - 0.2
    assert ready_s < READY_S
