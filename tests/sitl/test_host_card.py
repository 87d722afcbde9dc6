"""`host card` and the recorder's own program at the two ends of one USB line."""

from __future__ import annotations

import pytest
from host.link.card_console import CardConsole, CardError
from host.twin.recorder.flight_card_line import SitlLine
from host.wire.flight_card import card_bytes, card_faults, parts, read_card

from tests.host.test_flight_card import DOUBLET, HEAD, MULTISINE
from tests.sitl.bench import GROUND_S, Bench, config_places


@pytest.fixture(scope="module")
def bench() -> Bench:
    """An instrument at rest on the ground, long enough to know it."""
    found = Bench()
    found.sitl.power_on()
    found.sitl.run_for(GROUND_S)
    return found


@pytest.fixture(scope="module")
def card(bench: Bench) -> bytes:
    name = read_aircraft(bench)
    return card_bytes(HEAD | {"aircraft": name}, [DOUBLET, MULTISINE])


def read_aircraft(bench: Bench) -> bytes:
    at, size = config_places()["aircraft"]
    return bytes(bench.sitl.default_config()[at : at + size]).rstrip(b"\0")


def test_a_card_is_written_committed_and_read_back(bench: Bench, card: bytes) -> None:
    line = SitlLine(bench.sitl)
    console = CardConsole(line, line.now_s)
    assert card_faults(card) == []
    with pytest.raises(CardError, match="no valid card"):
        console.read()
    assert console.write(card) == read_card(card).hash
    assert console.read() == card
    console.must("write", 0, parts(card)[0])
    with pytest.raises(CardError, match="no valid card"):
        console.read()
    console.must("commit")
    console.must("erase")
    with pytest.raises(CardError, match="no valid card"):
        console.read()


HOLD = {
    "model": b"ultrastick25e", "model_date": 20261128, "angle_gain": [2699, -3162],
    "integral_gain": [286, -339], "rate_gain": [174, -149], "authority_us": [58, 40],
}  # fmt: skip


def test_a_card_that_holds_is_written_with_its_gains(bench: Bench, card: bytes) -> None:
    """With the most rows there are: 32."""
    line = SitlLine(bench.sitl)
    console = CardConsole(line, line.now_s)
    name = read_card(card).head["aircraft"]
    rows = [DOUBLET | {"axes": 2 | 16}] * 32
    holding = card_bytes(HEAD | {"aircraft": name}, rows, hold=HOLD)
    assert card_faults(holding) == []
    assert console.write(holding) == read_card(holding).hash
    assert console.read() == holding
    console.must("erase")


@pytest.mark.parametrize(
    ("hold", "axes", "fault"),
    [
        (HOLD | {"angle_gain": [0, -3162]}, 2 | 16, "hold"),
        (HOLD | {"rate_gain": [-174, -149]}, 2 | 16, "hold"),
        (HOLD | {"authority_us": [121, 40]}, 2 | 16, "hold"),
        (None, 2 | 16, "row_hold"),
        (HOLD, 2 | 32, "row_hold"),
        (HOLD, 2 | 64, "row_hold"),
    ],
)
def test_host_and_logger_refuse_the_same_holds(
    bench: Bench, card: bytes, hold: dict[str, object] | None, axes: int, fault: str
) -> None:
    line = SitlLine(bench.sitl)
    console = CardConsole(line, line.now_s)
    name = read_card(card).head["aircraft"]
    wrong = card_bytes({**HEAD, "aircraft": name}, [{**DOUBLET, "axes": axes}], hold=hold)
    assert card_faults(wrong)
    with pytest.raises(CardError, match=rf"damaged \({fault}\)"):
        console.write(wrong)


@pytest.mark.parametrize(
    ("head", "row", "fault"),
    [
        ({"aircraft": b"another"}, {}, "aircraft"),
        ({"stick_us": 9}, {}, "limits"),
        ({"height_min_pa": 119}, {}, "limits"),
        ({}, {"duration_ms": 90}, "row_time"),
        ({}, {"amplitude_us": [0, 121, 0]}, "row_amplitude"),
        ({}, {"duration_ms": 180}, "row_frequency"),
        ({}, {"shape": 9}, "row_shape"),
        ({}, {"axes": 3}, "row_axes"),
        ({}, {"first_chz": 20}, "row_frequency"),
        ({}, {"shape": 5}, "row_components"),
    ],
)
def test_host_and_logger_refuse_the_same_cards(
    bench: Bench, card: bytes, head: dict[str, object], row: dict[str, object], fault: str
) -> None:
    line = SitlLine(bench.sitl)
    console = CardConsole(line, line.now_s)
    name = read_card(card).head["aircraft"]
    wrong = card_bytes({**HEAD, "aircraft": name, **head}, [{**DOUBLET, **row}])
    if fault != "aircraft":  # the host does not know whose logger it is
        assert card_faults(wrong)
    with pytest.raises(CardError, match=rf"damaged \({fault}\)"):
        console.write(wrong)
