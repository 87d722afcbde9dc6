"""Records of these tests have noise alone: their sensors are told to be without errors."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
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


@pytest.fixture(scope="module", autouse=True)
def sensors_without_errors() -> Iterator[None]:
    """Stand in for the errors of an aircraft without a file: tests/host/instrument has those.

    A package that is none for Python would keep it for all tests that come later.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("host.instrument.deviations.errors_without_file", known_sensors)
        yield
