"""Records of these tests have noise alone: their sensors are told to be without errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest
from host.cli import main
from host.instrument.instrument_errors import (
    InstrumentErrors,
    errors_without_file,
    usual_errors,
)
from host.physical.calibration import Calibration

# Which their data tell.
OF_AIRSPEED = {"pitot_scale", "pitot_zero_pa", "density_share", "fuselage_heat_share"}


def known_sensors(maker: str, calibration: Calibration | None = None) -> InstrumentErrors:
    """Return usual errors of the airspeed and of servos, and next to none of all else.

    A calibration that a test gives says itself what its sensors are.
    """
    if calibration is not None:
        return errors_without_file(maker, calibration)
    errors = usual_errors(maker)
    kept = {e.name for e in errors if e.name.startswith("servo")} | OF_AIRSPEED
    return errors.scaled(0.01, *(e.name for e in errors if e.name not in kept))


@pytest.fixture(scope="session")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, int], Path]:
    """Return what gives the folder of a flight without recorder; nobody writes into it.

    It is flown by the first of the modules that ask for it, each with the errors below.
    """

    @cache
    def folder_of(card: str, seed: int) -> Path:
        folder = tmp_path_factory.mktemp(f"{card}_{seed}_")
        quiet = ["--firmware", "none", "--no-picture"]
        assert main(["simulate", card, *quiet, "--seed", str(seed), "-o", str(folder)]) == 0
        return folder

    return folder_of


@pytest.fixture(scope="module", autouse=True)
def sensors_without_errors() -> Iterator[None]:
    """Stand in for the errors of an aircraft without a file: tests/host/instrument has those.

    A package that is none for Python would keep it for all tests that come later.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("host.instrument.deviations.errors_without_file", known_sensors)
        yield


@pytest.fixture
def interpreted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run a user's equations as where numba is missing: that takes no compiler's time."""
    monkeypatch.setattr("host.compiled.has_compiler", lambda: False)
