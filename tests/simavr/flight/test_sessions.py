"""Files and sessions of the flight image: resumed, closed, prepared, never overwritten."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

if TYPE_CHECKING:
    from flight.rig import FlightRig
    from simavr_bench.card_journal import CardJournal

MakeRig = Callable[..., "FlightRig"]
RESUMED_S = 2.0
PHASES_MS = tuple(range(0, 78, 3))  # a block is written every 73 ms, sent within 8


@pytest.fixture(scope="module")
def recording(
    flight_elf: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[FlightRig, CardJournal]:
    """A rig in flight with a journal of its card: for children made by in_fork only."""
    from flight.faults.run import ready_rig

    return ready_rig(flight_elf, tmp_path_factory.mktemp("recording"))


def resumed_s(rig: FlightRig, journal: CardJournal, cause: str, wait_ms: float) -> float:
    """Reset after a wait; give the time until a block is on its way to the card."""
    from flight.cut_flight import FILE_BLOCKS, place_of_file
    from simavr_bench import ResetCause

    rig.chip.run_s(wait_ms / 1000)
    rig.receiver.width_us[3] = 1000.0  # idle: the mark in .noinit alone decides
    rig.chip.reset(ResetCause[cause])
    rig.chip.run_s(RESUMED_S + 0.5)
    rows = journal.records()
    place = rows["block"].astype(np.int64) - place_of_file(rows)
    later = rows["begun"] > rig.started[-1]
    assert np.all((place[later] >= 0) & (place[later] < FILE_BLOCKS))  # no metadata
    first = rows["begun"][later]
    return (int(first[0]) - rig.started[-1]) / 16e6 if len(first) else float("nan")


def test_reset_at_any_phase_of_a_block_resumes_at_once(
    recording: tuple[FlightRig, CardJournal],
) -> None:
    """Also in the middle of a block, and while the card is busy with one."""
    from simavr_bench import in_fork

    times_s = [
        in_fork(partial(resumed_s, *recording, "WATCHDOG", wait_ms)) for wait_ms in PHASES_MS
    ]
    late = {p: t for p, t in zip(PHASES_MS, times_s, strict=True) if not t <= RESUMED_S}
    assert late == {}
