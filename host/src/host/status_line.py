"""The line the logger writes on USB once a second while it records nothing."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

# In the order in which firmware/app/status.cpp writes them; others are shown as they are.
KEYS = ("imu", "baro", "gps", "rc", "drive", "card", "avcc")
LEAST_AVCC_MV = 4500  # 16 MHz needs 4.5 V (ATmega2560 datasheet, 31.4)

_TITLES = {
    "imu": "IMU",
    "baro": "barometer",
    "gps": "GPS",
    "rc": "receiver",
    "drive": "servos by",
    "card": "card",
    "avcc": "supply",
}
_IMAGE = re.compile(r"^([\w .-]+) (\d+\.\d+\S*)$")
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.])")
_STATES = ("missing", "stale", "original", "ok")
_HINTS = {
    ("imu", "missing"): "no packet for a second",
    ("baro", "missing"): "no answer on its bus",
    ("gps", "missing"): "nothing readable; antenna, plug, crossed TX and RX?",
    ("rc", "missing"): "no steady pulses; receiver powered, transmitter on?",
    ("card", "missing"): "put a card in",
    ("card", "not FAT32"): "format it to FAT32; cards above 32 GB are sold as exFAT",
    ("card", "unreadable"): "another card, or look at its wires",
    ("card", "full"): "no room for a flight file; free 64 MiB",
    ("card", "fragmented"): "no 64 MiB in one piece; format the card",
    ("card", "lost"): "it went away while it was in use",
    ("card", "open flight"): "an earlier flight is open; throttle idle for 10 s closes it",
}


@dataclass(frozen=True, slots=True)
class StatusLine:
    """One status line.

    Parameters
    ----------
    board, version : str
        Of the image that runs; board ``BENCH ONLY`` drives no servo and no relay.
    fields : dict of str to str
        Key of the line -> what it says.
    """

    board: str
    version: str
    fields: dict[str, str] = field(default_factory=dict)

    def state(self, key: str) -> str:
        """``ok``, ``missing``, ``stale``, ``original``, or what the card says of itself."""
        text = self.fields[key]
        if key == "card":
            return re.sub(r"\s+\d+$", "", text)
        return next((word for word in _STATES if word in text.split()), "ok")

    def numbers(self, key: str) -> list[float]:
        """Numbers of a field, in order."""
        return [float(one) for one in _NUMBER.findall(self.fields[key])]

    def complaints(self) -> list[str]:
        """What is missing or wrong, with what to do; empty if nothing is."""
        found = []
        for key in self.fields:
            hint = _HINTS.get((key, self.state(key)))
            if hint:
                found.append(f"{_TITLES.get(key, key)} {self.state(key)}: {hint}")
            elif self.state(key) == "stale":
                found.append(f"{_TITLES.get(key, key)} stale: it was there and went silent")
        supply_mv = self._first("avcc")
        if supply_mv is not None and supply_mv < LEAST_AVCC_MV:
            found.append(f"supply below {LEAST_AVCC_MV / 1000:.1f} V: the chip is out of its range")
        if self.board == "BENCH ONLY":
            found.append("this image drives no servo and no relay: for the bench only")
        return found

    def as_json(self) -> dict[str, object]:
        """Return the line for a program: states, numbers with their unit, and the text."""
        gps = dict(zip(("fix", "satellites"), map(int, self.numbers("gps")), strict=False))
        return {
            "board": self.board,
            "version": self.version,
            "imu": {"state": self.state("imu")},
            "baro": {"state": self.state("baro"), "static_pressure_pa": self._first("baro")},
            "gps": {"state": self.state("gps"), "fix": None, "satellites": None, **gps},
            "receiver": {"state": self.state("rc"), "pulse_us": self.numbers("rc")},
            "servos_by": self.fields["drive"],
            "card": {"state": self.state("card"), "file_number": self._first("card")},
            "supply_mv": self._first("avcc"),
            "complaints": self.complaints(),
            "text": self.fields,
        }

    def lines(self) -> list[str]:
        """Return the line for a person, one thing per row."""
        rows = [f"{self.board} {self.version}"]
        for key, text in self.fields.items():
            unit = " us" if key == "rc" and self.numbers("rc") else ""
            rows.append(f"  {_TITLES.get(key, key):<10} {text}{unit}")
        complaints = self.complaints()
        rows += [f"  ! {one}" for one in complaints] or ["  nothing is missing"]
        return rows

    def _first(self, key: str) -> float | None:
        numbers = self.numbers(key)
        return numbers[0] if numbers else None


def parse_status(line: str) -> StatusLine | None:
    """Read a status line.

    Parameters
    ----------
    line : str
        Without its line end.

    Returns
    -------
    StatusLine or None
        None for anything else, and for a line of which a part is missing, doubled or garbled: a
        reset in the middle of a line joins two.
    """
    if not line.isascii():
        return None
    head, *parts = line.split(" | ")
    image = _IMAGE.match(head)
    if image is None:
        return None
    fields: dict[str, str] = {}
    for part in parts:
        words = part.removeprefix("rc us").split() if part.startswith("rc us") else part.split()
        key = "rc" if part.startswith("rc us") else (words.pop(0) if words else "")
        if not key or not words or key in fields:
            return None
        fields[key] = " ".join(words)
    if not set(KEYS) <= set(fields) or not re.fullmatch(r"\d+ mV", fields["avcc"]):
        return None
    return StatusLine(image[1], image[2], fields)
