"""Builds the flight image once and makes rigs around it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from flight.rig import FlightRig
    from simavr_bench.card_journal import CardJournal

MakeRig = Callable[..., "FlightRig"]


@pytest.fixture(scope="session")
def flight_elf(request: pytest.FixtureRequest) -> Path:
    """The flight image; a test that names compilers gets it by each."""
    from flight.images import build_image

    return build_image("mega2560", getattr(request, "param", None))


@pytest.fixture(scope="session")
def recording(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[tuple[FlightRig, CardJournal]]:
    """A rig in flight with a journal of its card: for children made by in_fork only.

    Not of `flight_elf`: a case that names a compiler would have it flown anew for those behind.
    """
    from flight.faults.run import ready_rig
    from flight.images import build_image

    rig, journal = ready_rig(build_image("mega2560"), tmp_path_factory.mktemp("recording"))
    yield rig, journal
    rig.chip.close()


@pytest.fixture(scope="session")
def flying(recording: tuple[FlightRig, CardJournal]) -> FlightRig:
    """The same rig, the Mega driving: for children made by in_fork only."""
    return recording[0]


@pytest.fixture
def make_rig(flight_elf: Path, tmp_path: Path) -> Iterator[MakeRig]:
    """A maker of rigs with a card of their own; frees their chips afterwards."""
    from flight.rig import FlightRig, make_card

    rigs: list[FlightRig] = []

    def make(
        *,
        imu_hz: float = 100.0,
        frame_s: float = 0.020,
        sequential: bool = True,
        bootloader: bool = False,
    ) -> FlightRig:
        card = make_card(tmp_path / f"card{len(rigs)}.img")
        rig = FlightRig(
            flight_elf,
            card,
            imu_hz=imu_hz,
            frame_s=frame_s,
            sequential=sequential,
            bootloader=bootloader,
        )
        rigs.append(rig)
        return rig

    yield make
    for rig in rigs:
        rig.chip.close()
