"""Who knows less is never surer: errors without a file are no smaller than with one."""

import pytest
from host.aircraft.file import load_measured
from host.instrument.instrument_errors import (
    errors_without_file,
    instrument_errors,
    standard_errors,
    usual_errors,
)
from host.physical.calibration import load_calibration
from host.physical.recording import AUTOPILOT, FOREIGN, OWN
from host.sysid.linear import Answer
from studies.wrong_flights import fly

from tests.host.sysid.at_hand import identify
from tests.host.sysid.conftest import known_sensors


@pytest.mark.parametrize("maker", [OWN, AUTOPILOT, FOREIGN])
def test_no_error_is_smaller_without_a_file(maker: str) -> None:
    known = instrument_errors(load_measured("ultrastick25e"), maker=maker)
    unknown = errors_without_file(maker)
    for error in known:
        # Zero and slope of vanes and pots are a data sheet's or a calibration's, whichever made
        # the columns; a tolerance is the file's.
        if error.name in {"vane_scale", "pitot_scale"} and maker == OWN:
            continue
        for sensor in error.sensors:
            assert unknown[error.name].sigma(sensor) >= 0.99 * error.sigma(sensor), error.name


def test_own_sensors_without_a_calibration_are_out_of_the_box() -> None:
    found, known = errors_without_file(OWN), load_calibration()
    by_line = known.lines["channel.pot_rudder"].slope_sigma
    assert found["pot_scale"].sigma("pot_rudder") == pytest.approx(by_line)
    assert found["place_m"].sigma("imu") > 4.0 * standard_errors()["place_m"].sigma("imu")
    assert usual_errors(OWN)["vane_flow_share"].sigma("alpha") == 0.0  # an aircraft file tells it
    assert found["vane_flow_share"].sigma("alpha") > 0.1


@pytest.fixture(scope="module")
def answers() -> tuple[Answer, Answer]:
    """The same record of perfect sensors, told to be such, and of sensors nobody knows."""
    flight = fly("short-period", "none", "white", 1)
    told, unknown = (
        identify(
            flight.columns, names=("short-period",), method="output-error-white",
            windows=flight.windows, user_model=flight.model, errors=errors,
        )[0]
        for errors in (known_sensors(OWN), errors_without_file(OWN))
    )  # fmt: skip
    return told, unknown


def test_the_list_of_errors_is_never_empty(answers: tuple[Answer, Answer]) -> None:
    _, unknown = answers
    assert {"alpha_scale", "elevator_scale", "vane_x_m"} <= {e.name for e in unknown.errors}
    assert all(e.origin for e in unknown.errors)


def test_no_half_width_shrinks_where_nothing_is_known(answers: tuple[Answer, Answer]) -> None:
    told, unknown = (dict(zip(a.result.names, a.result.half_width(), strict=True)) for a in answers)
    for name in ("Z_alpha", "M_alpha", "M_q", "M_de"):
        assert unknown[name] > 0.97 * told[name]
    assert unknown["M_alpha"] > 1.3 * told["M_alpha"]
