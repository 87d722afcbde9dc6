"""The logger's flight card: its bytes, what is wrong with them, and the line that carries it."""

from __future__ import annotations

import json
import random
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from host.cli import main
from host.link.card_console import CardConsole, CardError
from host.wire.card_text import card_lines
from host.wire.flight_card import (
    AXIS,
    ROW,
    WORTH,
    card_bytes,
    card_faults,
    components,
    dtype,
    number,
    parts,
    read_card,
)
from host.wire.framing import EnvelopeReader, crc16, envelope
from host.wire.schema_text import packed_schema

HEAD = {
    "aircraft": b"ultrastick25e", "airspeed_input": 4, "alpha_input": 0, "beta_input": 2,
    "dp_max": 4000, "alpha_max": 4000, "beta_max": 4000, "phi_max": 5000, "theta_max": 3000,
    "height_min_pa": 480, "height_max_pa": 2400, "still_ms": 500, "stick_us": 40,
    "servo_min_us": [1000] * 3, "servo_max_us": [2000] * 3, "amplitude_max_us": [120] * 3,
    "rate_max_usps": 3000, "frequency_max_chz": 500,
}  # fmt: skip
DOUBLET = {"shape": 2, "axes": 2, "quiet_ms": 1000, "duration_ms": 800, "amplitude_us": [0, 90, 0]}
TONES = [10, 3, 64 * 1 + 40, 14, 128, 64 * 0 + 63] + 24 * [0]
MULTISINE = {"shape": 5, "axes": 3, "duration_ms": 10_000, "amplitude_us": [70, 90, 0],
             "components": TONES}  # fmt: skip


@pytest.fixture
def card() -> bytes:
    return card_bytes(HEAD, [DOUBLET, MULTISINE])


def test_a_card_says_what_was_put_in(card: bytes) -> None:
    assert len(card) == 48 * 5
    assert card_faults(card) == []
    read = read_card(card)
    assert read.head["aircraft"] == b"ultrastick25e"
    assert read.hash == zlib.crc32(card[:92] + card[96:])
    assert read.rows[0]["crc"] == crc16(card[144:190])
    assert components(read.rows[1]) == [(1, 10, 40, 3), (0, 14, 63, 128)]
    assert "multisine: aileron +70 us, elevator +90 us; 10 s" in "\n".join(card_lines(read))


def test_a_card_says_what_its_rows_start_by(card: bytes) -> None:
    """Pitot or GPS; without a pitot on the card GPS alone."""
    said = "\n".join(card_lines(read_card(card)))
    assert "12.8 m/s" in said
    assert "with neither no row starts" in said
    blind = read_card(card_bytes({**HEAD, "airspeed_input": 255}, [DOUBLET]))
    assert "without GPS no row starts" in "\n".join(card_lines(blind))


def test_no_changed_bit_of_a_card_is_good(card: bytes) -> None:
    rng = random.Random(18)
    for _ in range(300):
        place = rng.randrange(8 * len(card))
        damaged = bytearray(card)
        damaged[place // 8] ^= 1 << place % 8
        assert card_faults(bytes(damaged)), place
    assert card_faults(card[:-48])
    assert card_faults(card[:-1])
    assert "0 bytes, expected 48 times" in card_faults(b"")[0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"duration_ms": 90}, "90 ms"),
        ({"duration_ms": 19_500}, "together up to 20000"),
        ({"amplitude_us": [0, 130, 0]}, "elevator 130 us, expected up to 120"),
        ({"axes": 1}, "axes 001, expected 010"),
        ({"shape": 9}, "shape 9"),
        ({"duration_ms": 180}, "up to 5.56 Hz, expected up to 5 Hz"),
        ({"components": TONES}, "bytes behind the last tone"),
        ({"first_chz": 20}, "sweep from 20 to 0"),
        ({"shape": 5, "duration_ms": 10_000}, "0 tones of the elevator"),
        ({"shape": 5, "duration_ms": 10_000, "components": [51, 0, 127] + 27 * [0]}, "5.1"),
    ],
)
def test_a_row_that_the_logger_refuses_is_named(change: dict[str, object], said: str) -> None:
    assert said in "; ".join(card_faults(card_bytes(HEAD, [{**DOUBLET, **change}])))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"stick_us": 5}, "stick_us is 5, expected 10 to 200"),
        ({"dp_min": 4001}, "dp_min 4001 is above"),
        ({"height_min_pa": 119}, "height_min_pa is 119, expected 120 to 2400"),
        ({"servo_max_us": [2000, 2300, 2000]}, "travel of the elevator"),
        ({"frequency_max_chz": 501}, "frequency_max_chz is 501"),
        ({"alpha_input": 7}, "alpha_input is 7"),
        ({"amplitude_max_us": [501] * 3}, "at most 500"),
    ],
)
def test_limits_that_the_logger_refuses_are_named(change: dict[str, object], said: str) -> None:
    assert said in "; ".join(card_faults(card_bytes({**HEAD, **change}, [DOUBLET])))


class FakeLogger:
    """The console of protocol/flight-card.md, a byte at a time, with faults to order."""

    device = "fake"

    def __init__(self) -> None:
        self.eeprom = bytearray(b"\xff" * 48 * 35)
        self.valid, self.refuses, self.finds, self.now_s = False, "", "crc", 0.0
        self.deaf: set[int] = set()  # numbers of the bytes that are lost
        self.stuck = -1  # an EEPROM byte that keeps its value
        self.seen = 0
        self._got, self._out = bytearray(), bytearray()

    def clock(self) -> float:
        return self.now_s

    def data(self) -> bytes:
        self.now_s += 0.05
        out, self._out = bytes(self._out), bytearray()
        return out

    def send(self, data: bytes) -> None:
        assert len(data) == 1
        if self.now_s - getattr(self, "_last_s", 0.0) > 0.5:
            self._got.clear()
        self._last_s = self.now_s
        self.seen += 1
        if self.seen in self.deaf:
            return
        self._got += data
        whole = len(self._got) > 2 and len(self._got) == self._got[2] + 5
        if not whole:
            self._answer(0, "more", 0)
            return
        [body] = EnvelopeReader().feed(bytes(self._got))
        self._got.clear()
        self._obey(body)

    def _obey(self, body: bytes) -> None:
        names = {v: k for k, v in packed_schema().enums["card_command"].items()}
        name, part, data = names[body[1]], body[2], body[3:]
        assert body[0] == number("card_request")
        if self.refuses and name in ("write", "erase", "commit"):
            self._answer(body[1], self.refuses, part)
            return
        size = 48 * part
        if name == "write":
            self.valid = False
            kept = self.eeprom[self.stuck] if self.stuck >= 0 else 0
            self.eeprom[size : size + 48] = data
            if self.stuck >= 0:
                self.eeprom[self.stuck] = kept
        elif name == "erase":
            self.valid = False
        elif name == "commit":
            rows = self.eeprom[3]
            self.valid = rows <= 32 and not card_faults(bytes(self.eeprom[: 48 * (3 + rows)]))
            if not self.valid:
                self._answer(body[1], "damaged", 0, fault=self.finds)
                return
        elif name == "state" and not self.valid:
            self._answer(body[1], "no_card", 0, fault="not_valid")
            return
        data = bytes(self.eeprom[size : size + 48]) if name == "read" else b""
        self._answer(body[1], "ok", part, data=data)

    def _answer(
        self, command: int, result: str, part: int, *, fault: str = "none", data: bytes = b""
    ) -> None:
        enums = packed_schema().enums
        code = enums["card_result"][result]
        kept = bytes(self.eeprom[92:96]) if self.valid else bytes(4)
        body = bytes((number("card_answer"), command, code, part)) + kept
        # A line of text and an envelope of another id stand between.
        self._out += b"status: noise\r\n" + envelope(b"\x07abc")
        self._out += envelope(body + bytes((enums["card_fault"][fault],)) + data)


def console(logger: FakeLogger) -> CardConsole:
    return CardConsole(logger, logger.clock)


def test_a_card_is_written_and_read_back(card: bytes) -> None:
    logger, shares = FakeLogger(), list[float]()
    assert console(logger).write(card, shares.append) == read_card(card).hash
    assert bytes(logger.eeprom[: len(card)]) == card
    assert logger.valid
    assert shares[-1] == 1.0
    assert console(logger).read() == card


def test_lost_bytes_are_sent_again(card: bytes) -> None:
    logger = FakeLogger()
    logger.deaf = {3, 70, 200}
    console(logger).write(card)
    assert bytes(logger.eeprom[: len(card)]) == card


def _refused(result: str) -> Callable[[FakeLogger], None]:
    return lambda logger: setattr(logger, "refuses", result)


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (_refused("recording"), "refused: it is recording"),
        (_refused("relay"), "move the switch to direct"),
        (_refused("airborne"), "does not know that it stands on the ground"),
        (_refused("eeprom"), "does not keep what is written"),
        (lambda logger: setattr(logger, "stuck", 60), "damaged (crc)"),
        (
            lambda logger: logger.__dict__.update(stuck=60, finds="other_version"),
            "another version than the card (other_version): pio run -t upload",
        ),
        (lambda logger: logger.deaf.update(range(1, 2000)), "no answer about the flight card"),
    ],
)
def test_what_the_logger_refuses_is_said_and_leaves_no_card(
    card: bytes, fault: Callable[[FakeLogger], None], said: str
) -> None:
    logger = FakeLogger()
    fault(logger)
    with pytest.raises(CardError, match=said.replace("(", r"\(").replace(")", r"\)")):
        console(logger).write(card)
    assert not logger.valid


def test_a_card_half_written_is_none(card: bytes) -> None:
    logger = FakeLogger()
    console(logger).write(card)
    console(logger).must("write", 0, parts(card)[0])
    with pytest.raises(CardError, match="no valid card"):
        console(logger).read()


AXIS_CARD = card_bytes(
    HEAD,
    [DOUBLET, MULTISINE],
    [({"axis": 0, "told": 1, "harmonic_count": 2, "harmonics": [1, 2, *[0] * 8]}, {})],
    [1, 0],
)


def test_a_card_with_a_good_hash_and_an_axis_that_is_none_is_refused() -> None:
    """They were an IndexError: a row that learns axis 2 of 1, and an axis 3."""
    learning, axis = 96 + dtype("card_learning").fields["axis_of_row"][1], 48 * 5  # type: ignore[index]
    for place, value, says in (
        (learning, 2, "row 1: learns axis 2, expected 0 to 1"),
        (axis + dtype("card_axis").fields["axis"][1], 3, "learned axis 1: axis 3"),  # type: ignore[index]
    ):
        assert says in "; ".join(card_faults(sealed(AXIS_CARD, place, value)))


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
def test_no_number_of_a_learned_axis_is_none_or_infinite(value: float) -> None:
    axis: dict[str, object] = {"axis": 1, "harmonic_count": 1, "harmonics": [3]}
    worth: dict[str, object] = {}
    for layout, given in ((AXIS, axis), (WORTH, worth)):
        singles = [
            name for name in dtype(layout).names or () if dtype(layout)[name].base.kind == "f"
        ]
        assert singles
        for name in singles:
            changed = {**given, name: value}
            pair = (changed, worth) if layout == AXIS else (axis, changed)
            found = card_faults(card_bytes(HEAD, [DOUBLET], [pair], [1]))
            assert f"learned axis 1: {name} is not finite" in found
    assert not any(
        "finite" in x for x in card_faults(card_bytes(HEAD, [DOUBLET], [(axis, worth)], [1]))
    )


def test_no_byte_behind_a_good_hash_is_a_mistake_of_ours() -> None:
    rng = random.Random(46)
    for _ in range(3000):
        place = rng.randrange(len(AXIS_CARD))
        data = sealed(AXIS_CARD, place, rng.randrange(256))
        if not card_faults(data):
            card_lines(read_card(data))


def sealed(card: bytes, place: int, value: int) -> bytes:
    """Return a card with one byte changed and the hash of what it then is."""
    data = card[:place] + bytes([value]) + card[place + 1 :]
    return data[:92] + zlib.crc32(data[:92] + data[96:]).to_bytes(4, "little") + data[96:]


def test_the_verb_checks_a_file_without_any_port(
    card: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "flight.card"
    path.write_bytes(card)
    assert main(["card", "check", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["hash"] == f"{read_card(card).hash:08x}"
    path.write_bytes(card[:-1] + b"\x01")
    assert main(["card", "check", str(path)]) == 6
    assert "CRC-16" in capsys.readouterr().err
    assert main(["card", "write"]) == 2
    assert main(["card", "erase", "--port", str(tmp_path / "no")]) == 5
    assert dtype(ROW).itemsize == 48
