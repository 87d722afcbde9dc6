"""The day of a card that holds axes: gains from a log, card, tilts, flight, model.

The aircraft is virtual; the verbs, the recorder and what it sends are those of a real day.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from host.aircraft.linear_aircraft import load
from host.cli import main
from host.live.live_stream import LiveStream
from host.log import read_log
from host.log.flown_inputs import flown_inputs
from host.physical.calibration import load_calibration
from host.planning.hold_card import read_gains
from host.preflight.check_list import CheckListInputs
from host.preflight.guided_list import Preflight
from host.sysid.answer import true_coefficients
from host.sysid.answer.truth_comparison import read_truth
from host.sysid.pipeline import identify
from host.twin.outcome.flight_outcome import simulate
from host.twin.recorder.sitl_radio import radio
from host.twin.recorder.stimuli import stimuli
from host.twin.testcard import cards
from host.wire.flight_card import card_file, read_card

AIRCRAFT = "ultrastick25e"
SEED = "5"


@pytest.mark.campaign
@pytest.mark.costs(150, "two flights identified, gains designed, a card planned and flown")
def test_a_day_from_log_to_gains_to_a_held_flight_to_the_model(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    gains, plan, card = (tmp_path / name for name in ("gains.toml", "card.toml", "flight.card"))
    calibration = first / "calibration.toml"
    assert main(["simulate", "demo", "-o", str(first), "--seed", SEED, "--no-picture"]) == 0
    log = first / "flight.bin"
    asked = ["tune", str(log), "--aircraft", AIRCRAFT, "--for", "mega", "--save", str(gains)]
    assert main(asked) == 0
    assert read_gains(gains).model == AIRCRAFT
    asked = ["plan", "--aircraft", AIRCRAFT, "--calibration", str(calibration)]
    assert main([*asked, "--save", str(plan), "--card", str(card), "--hold", str(gains)]) == 0
    assert main(["card", "check", str(card)]) == 0

    # As `host simulate card.toml --flight-card flight.card`.
    outcome = simulate(
        cards.load(str(plan)), second, seed=1, firmware="sitl", pictures=False, both=False,
        flight_card=card_file(card), progress=lambda *_: None,
    )  # fmt: skip
    rows = flown_inputs(read_log(second / "flight.bin"))
    assert len(rows) == len(read_card(card_file(card)).rows)
    assert {row.reason for row in rows} == {"done"}
    assert all(row.held for row in rows)

    # The preflight's list hears the proof on the radio, before anything flies.
    lines = load_calibration(second / "calibration.toml")
    inputs = CheckListInputs(load(AIRCRAFT), lines, flight_card=read_card(card_file(card)))
    stream = LiveStream(lines)
    preflight = Preflight(inputs, stream)
    given = stimuli(outcome.record, outcome.data)
    ground_s = outcome.record.card.flight.ground_s
    for sent in radio(given, rate_hz=100, aircraft=AIRCRAFT, flight_card=card_file(card)):
        if sent.t_s > ground_s:
            break
        stream.feed(sent.data, sent.t_s)
    (proof,) = (check for check in preflight.checks if check.key == "hold")
    assert proof.state == "seen", proof.missing()

    found = identify(
        second / "flight.bin", aircraft=AIRCRAFT, calibration=second / "calibration.toml"
    )
    truth = read_truth(second / "flight.truth.toml")
    told = held = 0
    for answer in found.linear:
        true = true_coefficients(truth, answer.template)
        for c in answer.coefficients:
            told += 1
            held += abs(c.value - true[c.name]) <= c.half_width
    assert told >= 20
    assert held >= 0.85 * told
