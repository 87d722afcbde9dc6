"""Builds both images once and makes boards and rigs around them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import pytest

if TYPE_CHECKING:
    from imu.record import ImuRecord
    from imu.rig import ImuBoard, PairRig


class MakeBoard(Protocol):
    """Makes an IMU board without a Mega; something on its bus takes the packets."""

    def __call__(
        self,
        *,
        record: ImuRecord | None = None,
        product_id: int = 0x58,
        over_i2c: bool = False,
        qmc: bool = False,
        mega: bool = True,
    ) -> ImuBoard:
        """Make one and give it power."""


@pytest.fixture(scope="session")
def imu_elf(request: pytest.FixtureRequest) -> Path:
    """The IMU's image, by the compiler that a test names or the usual one."""
    from flight.images import build_image

    return build_image("arduimu", getattr(request, "param", None))


@pytest.fixture(scope="session")
def mega_elf(request: pytest.FixtureRequest) -> Path:
    """The flight image, by the compiler that a test names or the usual one."""
    from flight.images import build_image

    return build_image("mega2560", getattr(request, "param", None))


@pytest.fixture
def make_board(imu_elf: Path) -> Iterator[MakeBoard]:
    """A maker of IMU boards; frees their chips afterwards."""
    from imu.packets import ADDRESSES
    from imu.rig import ImuBoard

    boards: list[ImuBoard] = []

    def make(
        *,
        record: ImuRecord | None = None,
        product_id: int = 0x58,
        over_i2c: bool = False,
        qmc: bool = False,
        mega: bool = True,
    ) -> ImuBoard:
        board = ImuBoard(imu_elf, product_id=product_id, over_i2c=over_i2c, qmc=qmc)
        boards.append(board)
        if record is not None:
            board.chip.load(record.image())
        if mega:
            board.bus.listen(*ADDRESSES)
        board.bus.log_bytes()
        board.power_on()
        return board

    yield make
    for board in boards:
        board.chip.close()


@pytest.fixture(scope="session")
def flying_pair(
    mega_elf: Path, imu_elf: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[PairRig]:
    """Both images in flight: for children made by in_fork only."""
    from imu.faults import ready_rig

    rig = ready_rig(mega_elf, imu_elf, tmp_path_factory.mktemp("pair"))
    yield rig
    rig.close()
