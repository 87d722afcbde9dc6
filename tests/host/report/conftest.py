"""One log for all that is shown of a flight, and one browser."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from host.report.flight_reading import FlightRequest, read_flight
from host.report.shown_flight import ShownFlight

from tests.browser.chromium import Chromium
from tests.host.report.flights import written_flight


@pytest.fixture(scope="package")
def log_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written_flight(tmp_path_factory.mktemp("shown"))


@pytest.fixture(scope="package")
def flight(log_file: Path) -> ShownFlight:
    return read_flight(FlightRequest(log_file))[0]


@pytest.fixture(scope="package")
def browser() -> Iterator[Chromium]:
    with Chromium() as running:
        yield running
