"""Aircraft, linear aircraft and flight cards: one door, every wrong file one line."""

from collections.abc import Callable
from pathlib import Path

import pytest
from host.aircraft import file as aircraft
from host.aircraft import linear_aircraft
from host.errors import UsageError
from host.twin.testcard import cards

DOORS: dict[str, tuple[Callable[[str | Path], object], type[UsageError]]] = {
    "aircraft": (aircraft.load, aircraft.AircraftError),
    "measured aircraft": (aircraft.load_measured, aircraft.AircraftError),
    "linear aircraft": (linear_aircraft.load, aircraft.AircraftError),
    "flight card": (cards.load, cards.CardError),
}


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\xff\xfe\x00log", "wrong.toml: not TOML: byte 0 is no UTF-8"),
        (b"format = ", "wrong.toml: not TOML: Invalid value"),
        (b"format = 2", r"wrong(\.toml)?: format is 2, expected 1"),
        (None, "wrong.toml: a folder; name a file in it"),
    ],
)
def test_a_wrong_file_is_one_line(
    tmp_path: Path, door: str, content: bytes | None, message: str
) -> None:
    load, error = DOORS[door]
    path = tmp_path / "wrong.toml"
    if content is None:
        path.mkdir()
    else:
        path.write_bytes(content)
    with pytest.raises(error, match=message) as caught:
        load(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("door", DOORS)
def test_a_file_that_is_not_there_lists_the_known_ones(door: str) -> None:
    load, error = DOORS[door]
    known = cards.names() if door == "flight card" else aircraft.names()
    with pytest.raises(error, match=f"expected a file or one of .*{known[0]}"):
        load("spitfire")
