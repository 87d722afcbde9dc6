"""The flight card over USB: request and answer, one byte at a time (protocol/flight-card.md).

The logger has no buffer for USB, so behind each byte of a request the host waits for an answer.
Only here are bytes sent to a logger, and only to a port that the user named or that looks like
a Mega.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from host.link.serial import DeviceError
from host.wire.flight_card import body_parts, number, parts
from host.wire.framing import EnvelopeReader, envelope
from host.wire.schema_text import packed_schema

ANSWER_S, FORGETS_S = 1.0, 1.0  # time until a byte counts as lost, until the logger starts afresh
TRIES = 4
STILL_S = 25.0  # from power-on until the logger may know that it stands: 5 s, 18 with one sensor
ANSWER_BYTES = 9  # id, command, result, part, hash, fault
SAID = {
    "no_card": "there is no valid card in the logger",
    "recording": "refused: it is recording; end the session first",
    "relay": "refused: the relay is or may be engaged; move the switch to direct",
    "airborne": "refused: it does not know that it stands on the ground; let it rest for 20 s",
    "damaged": "the card that arrived is damaged",
    "request": "it does not know this request: another image than this tool's",
    "eeprom": "its EEPROM does not keep what is written",
}  # fmt: skip
# What to do about a fault whose name does not say it.
FAULT_TEXTS = {
    "other_version": "the logger's program is of another version than the card (other_version):"
    " pio run -t upload; of a simulated logger: make sitl",
}


class CardError(DeviceError):
    """The logger refuses a request, or its answer is wrong."""


class Link(Protocol):
    """An open line to a logger."""

    device: str

    def data(self) -> bytes:
        """Return the bytes received, after at most 50 ms."""
        ...

    def send(self, data: bytes) -> None:
        """Send bytes."""
        ...


@dataclass(frozen=True, slots=True)
class Answer:
    """The logger's answer to a request."""

    command: int
    result: str
    part: int
    hash: int
    fault: str
    data: bytes = b""


class CardConsole:
    """Requests about the flight card, each repeated until it is answered.

    Parameters
    ----------
    link : Link
    clock : callable
        Seconds; another one in tests.
    """

    def __init__(self, link: Link, clock: Callable[[], float] = time.monotonic) -> None:
        self._link, self._clock = link, clock
        self._reader = EnvelopeReader()
        enums = packed_schema().enums
        self._commands = enums["card_command"]
        self._results = {v: k for k, v in enums["card_result"].items()}
        self._faults = {v: k for k, v in enums["card_fault"].items()}

    def request(self, command: str, part: int = 0, data: bytes = b"") -> Answer:
        """Return the answer to a request.

        Parameters
        ----------
        command : str
            A name of ``card_command``.
        part : int
        data : bytes
            48 of `write`.

        Raises
        ------
        CardError
            If no answer comes.
        """
        code = self._commands[command]
        body = envelope(bytes((number("card_request"), code, part)) + data)
        for _ in range(TRIES):
            answer = self._sent(body)
            if answer is not None and answer.command == code:
                return answer
            self._listen(FORGETS_S)
        raise CardError(
            f"{self._link.device}: no answer about the flight card after {TRIES} tries; is it our"
            " logger, and its image one with flight cards?"
        )

    def _sent(self, body: bytes) -> Answer | None:
        self._listen(0.0)
        answer = None
        for byte in body:
            self._link.send(bytes((byte,)))
            answer = self._listen(ANSWER_S)
            if answer is None or answer.result != "more":
                return answer
        return answer

    def _listen(self, seconds: float) -> Answer | None:
        """Return the next answer within `seconds`; with 0 s discard the bytes received so far."""
        until = self._clock() + seconds
        while True:
            for frame in self._reader.feed(self._link.data()):
                found = self._answer(frame)
                if found is not None and seconds > 0.0:
                    return found
            if self._clock() >= until:
                return None

    def _answer(self, frame: bytes) -> Answer | None:
        if len(frame) < ANSWER_BYTES or frame[0] != number("card_answer"):
            return None
        result = self._results.get(frame[2], f"result {frame[2]}")
        fault = self._faults.get(frame[8], f"fault {frame[8]}")
        return Answer(
            frame[1], result, frame[3], int.from_bytes(frame[4:8], "little"), fault, frame[9:]
        )

    def must(self, command: str, part: int = 0, data: bytes = b"") -> Answer:
        """Return the answer to a request that has to succeed; waits while it may be airborne.

        Raises
        ------
        CardError
            With what the logger said.
        """
        until = self._clock() + STILL_S
        while (answer := self.request(command, part, data)).result != "ok":
            if answer.result != "airborne" or self._clock() >= until:
                said = SAID.get(answer.result, answer.result)
                why = f" ({answer.fault})" if answer.fault != "none" else ""
                said = FAULT_TEXTS.get(answer.fault, f"{said}{why}")
                raise CardError(f"{self._link.device}: {said}")
            self._listen(FORGETS_S)
        return answer

    def write(self, card: bytes, progress: Callable[[float], None] = lambda _: None) -> int:
        """Write a card, make it valid, read it back; return its hash.

        Parameters
        ----------
        card : bytes
            Good by `host.wire.flight_card.card_faults`.
        progress : callable, optional
            Called with the share that is done.

        Raises
        ------
        CardError
            If the logger refuses, or its card reads back differently; it then has no card.
        """
        each = parts(card)
        for k, part in enumerate(each):
            self.must("write", k, part)
            progress(0.5 * (k + 1) / len(each))
        found = self.must("commit")
        kept = self.read(lambda share: progress(0.5 + 0.5 * share))
        if kept != card:
            self.must("erase")
            raise CardError(
                f"{self._link.device}: reads back another card than was written; erased it"
            )
        return found.hash

    def read(self, progress: Callable[[float], None] = lambda _: None) -> bytes:
        """Return the valid card.

        Raises
        ------
        CardError
            If there is none.
        """
        self.must("state")
        heads = number("card_head_parts")
        head = b"".join(self.must("read", k).data for k in range(heads))
        rows = head[3]
        if not 1 <= rows <= number("card_most_rows"):
            raise CardError(f"{self._link.device}: its card says {rows} rows, expected 1 to 32")
        body, behind = b"", body_parts(head)
        for k in range(behind):
            body += self.must("read", heads + k).data
            progress((k + 1) / behind)
        return head + body
