"""Aircraft and recorder together: the inputs that the logger flies, from the card to the finder."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.airframe import ELEVATOR
from host.aircraft.linear_aircraft import load
from host.cli import main
from host.errors import UsageError
from host.live.flight_state import FlightState
from host.live.live_stream import LiveStream
from host.log import read_log
from host.log.flown_inputs import FlownInput, flown_inputs
from host.physical.calibration import calibration_of_text, load_calibration
from host.planning.flight_envelope import Envelope
from host.planning.logger_card import logger_card
from host.twin.flight.fly import FlightRecord
from host.twin.outcome.compare import true_times
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.logger_flight import logger_flight
from host.twin.recorder.sitl_radio import radio
from host.twin.recorder.stimuli import Stimuli
from host.twin.testcard.cards import Card, Segment
from host.twin.testcard.flown_by_logger import flown_by_logger

SEED = 30_400
DOUBLET_DEG, WIDTH_S, QUIET_S = 3.0, 0.4, 1.0
CARD = Card(
    "short",
    "An elevator and an aileron doublet",
    "ultrastick25e",
    (
        Segment("doublet", axes=("elevator",), amplitudes=(DOUBLET_DEG,), width_s=WIDTH_S,
                before_s=QUIET_S),
        Segment("doublet", axes=("aileron",), amplitudes=(2.0,), width_s=WIDTH_S,
                before_s=QUIET_S),
        Segment("trim", duration_s=1.0),
    ),
)  # fmt: skip


def flight_card(envelope: Envelope | None = None) -> bytes:
    """Return the card for the virtual aircraft's own servos."""
    plane = load(CARD.aircraft)
    servos = calibration_of_text(calibration(plane), Path("calibration.toml"))
    return logger_card(CARD, plane, servos, envelope)


def fly(envelope: Envelope, folder: Path) -> tuple[FlightRecord, list[FlownInput], float]:
    """Return the flight, its rows as the host reads them, and the true time of the table's 0."""
    data = flight_card(envelope)

    def recorder(record: FlightRecord, given: Stimuli) -> sitl.Recording:
        return sitl.record(given, rate_hz=100, aircraft=record.aircraft.name, flight_card=data)

    record, _, recording = logger_flight(data, CARD, seed=SEED, recorder=recorder)
    path = folder / "flight.bin"
    path.write_bytes(recording.log)
    log = read_log(path)
    table = log.table()
    true_s = true_times(record, table, int(log.frames["ident"]["t_us"][0]))
    return record, flown_inputs(log), float((true_s - table["t_s"]).iloc[0])


def test_the_radio_of_such_a_flight_tells_its_rows() -> None:
    """As `host live sim:CARD --flight-card FILE` receives it."""
    data = flight_card()
    flown = partial(sitl.record, rate_hz=100, aircraft=load(CARD.aircraft).name, flight_card=data)
    record, given, _ = logger_flight(
        data, CARD, seed=SEED + 1, recorder=lambda _, given: flown(given)
    )
    stream = LiveStream(load_calibration())
    state = FlightState(stream)
    for sent in radio(given, rate_hz=100, aircraft=record.aircraft.name, flight_card=data):
        stream.feed(sent.data, sent.t_s)
    said = [event["text"] for event in state.events if event["text"].startswith("row")]
    assert said == ["row 1 begins", "row 1 ends: done", "row 2 begins", "row 2 ends: done"]


def test_the_aircraft_flies_what_the_logger_adds_and_the_host_finds_it(tmp_path: Path) -> None:
    record, rows, zero_s = fly(Envelope(), tmp_path)
    assert [(row.axes, row.reason) for row in rows] == [
        (("elevator",), "done"),
        (("aileron",), "done"),
    ]
    for row, window in zip(rows, record.schedule.windows, strict=True):
        assert window.start_s == pytest.approx(row.start_s + zero_s, abs=2e-3)
        assert window.input_end_s == pytest.approx(row.end_s + zero_s, abs=2e-3)
        assert window.input_end_s - window.start_s == pytest.approx(2 * WIDTH_S, abs=5e-3)
        # Nobody touched a stick: it trembles by 1 us.
        inside = (record.pulse_starts_s > window.start_s - QUIET_S) & (
            record.pulse_starts_s < window.input_end_s
        )
        assert np.ptp(record.pulses_us[inside, :4], axis=0).max() < 10.0
    start_s = record.schedule.windows[0].start_s
    surface = np.degrees(record.states[:, ELEVATOR])

    def at(seconds: float) -> float:
        return float(surface[round(1000 * (start_s + seconds))])

    settled_s = 0.9 * WIDTH_S
    for half, sign in ((0.0, 1.0), (WIDTH_S, -1.0)):
        moved = at(half + settled_s) - at(-0.1)
        assert moved == pytest.approx(sign * DOUBLET_DEG, rel=0.05)


def test_a_limit_ends_an_input_in_both_worlds(tmp_path: Path) -> None:
    record, rows, zero_s = fly(replace(Envelope(), rates_degps=20.0), tmp_path)
    first, window = rows[0], record.schedule.windows[0]
    assert first.reason == "rates"
    assert first.end_s - first.start_s < WIDTH_S
    assert window.input_end_s == pytest.approx(first.end_s + zero_s, abs=2e-3)
    back = round(1000 * (window.input_end_s + 0.3))
    before = round(1000 * (window.start_s - 0.1))
    left = record.states[back, ELEVATOR] - record.states[before, ELEVATOR]
    assert abs(np.degrees(left)) < 0.1 * DOUBLET_DEG


def test_a_leg_without_room_and_a_card_of_another_flight_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(UsageError, match="within 60 m of home"):
        flown_by_logger(CARD, 17.0, 60.0)
    path = tmp_path / "flight.card"
    path.write_bytes(flight_card())
    folder = str(tmp_path / "out")
    assert main(["simulate", "calm", "--flight-card", str(path), "-o", folder]) == 2
    assert "make it of the same card, host plan CARD --card" in capsys.readouterr().err
    asked = ["simulate", "calm", "--flight-card", str(path), "--firmware", "none", "-o", folder]
    assert main(asked) == 2
    assert "only sitl flies it" in capsys.readouterr().err
