"""The line the logger writes on USB once a second while it records nothing."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

ANALOGUE = ("alpha", "beta", "pitot", "pots")
LEAST_AVCC_MV = 4500  # 16 MHz needs 4.5 V (ATmega2560 datasheet, 31.4)
UNCALIBRATED = 1.2 / 1.1  # the chip's reference may be 1.2 V instead of 1.1 V (same, VINT1)

_TITLES = {
    "imu": "IMU",
    "alpha": "alpha",
    "beta": "beta",
    "pitot": "pitots",
    "pots": "pots",
    "baro": "barometer",
    "gps": "GPS",
    "rc": "receiver",
    "drive": "servos by",
    "relay": "relay",
    "inputs": "flight card",
    "card": "card",
    "rail": "servo rail",
    "avcc": "supply",
}
_IMAGE = re.compile(r"([\w .-]{1,32}?) (\d{1,4}\.\d{1,4}\S{0,32})(?: image ([0-9a-f]{8}))?")
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.])")
_WORDS = r"[\w(][\w ().,:%/-]{0,47}"
# Fields in the order in which firmware/app/status.cpp writes them; other fields are shown as they
# are. Patterns allow every number that the firmware's types hold, so that readings of a broken
# sensor are shown.
_FIELDS: dict[str, tuple[str, float, float]] = {
    "imu": (
        r"missing|(?:ok|original|stale)(?: roll # pitch # deg)?(?: az # mg)?", -32_768, 32_767,
    ),
    "alpha": ("missing|@(?: @)?", 0, 4092),
    "beta": ("missing|@(?: @)?", 0, 4092),
    "pitot": ("missing|@(?: @)?", 0, 4092),
    "pots": ("missing|@(?: @){,3}", 0, 4092),
    "baro": ("missing|(?:stale )?# Pa", 0, 2**24),
    "gps": ("missing|(?:stale )?fix # sat #", 0, 255),
    "rc": ("missing|#(?: #){,7}", 0, 65_535),
    "drive": (_WORDS, 0, 99_999_999),
    "relay": (_WORDS, 0, 99_999_999),
    "card": (_WORDS, 0, 99_999_999),
    "rail": ("missing|# mV", 0, 65_535),
    "avcc": ("(?:about )?# mV", 0, 65_535),
}  # fmt: skip
# Written where there is a flight card only.
_OF_A_CARD = {"inputs": ("[0-9a-f]{8} rows # (?:off|enabled)", 0.0, 99_999_999.0)}
_KNOWN = {**_FIELDS, **_OF_A_CARD}
KEYS = tuple(_KNOWN)
_GRAMMAR = {
    key: re.compile(text.replace("@", r"(?:\d{1,9}|-)").replace("#", r"-?\d{1,9}"))
    for key, (text, _, _) in _KNOWN.items()
}
_LATER = re.compile(r"[ -~]{1,64}")  # of a field that a later firmware adds
_LONGEST_KEY, _MOST_FIELDS = 16, 32
_STATES = ("missing", "stale", "original", "ok")
_HINTS = {
    ("imu", "missing"): "no packet for a second",
    ("alpha", "missing"): "the voltage is at an end of its range; vanes plugged in?",
    ("beta", "missing"): "the voltage is at an end of its range; vanes plugged in?",
    ("pitot", "missing"): "the voltage is at an end of its range; sensors plugged in?",
    ("pots", "missing"): "the voltage is at an end of its range; pots plugged in?",
    ("relay", "stuck"): "its contact says engaged without a heartbeat; the Mega will not drive",
    ("rail", "missing"): "no voltage; divider plugged in, receiver powered?",
    ("baro", "missing"): "no answer on its bus",
    ("gps", "missing"): "nothing readable; antenna, plug, crossed TX and RX?",
    ("rc", "missing"): "no steady pulses; receiver powered, transmitter on?",
    ("card", "missing"): "put a card in",
    ("card", "not FAT32"): "format it to FAT32; cards above 32 GB are sold as exFAT",
    ("card", "unreadable"): "another card, or look at its wires",
    ("card", "full"): "no room for 15 minutes; free 64 MiB",
    ("card", "fragmented"): "no 15 minutes in one piece; format the card",
    ("card", "lost"): "it went away while it was in use",
    ("card", "damaged"): "its file system has numbers that cannot be; format the card to FAT32",
    ("card", "looking"): "it is being read",
    ("card", "searching"): "room is being looked for; nothing is recorded before it is found",
    ("card", "preparing"): "a file is being made; nothing is recorded before it is ready",
    ("card", "closing"): "the file of the last flight is being cut to its length",
    ("card", "ready, small"): "room for 15 minutes at least; more is being looked for",
    ("card", "open flight"): "an earlier flight is open; closed when it stands still",
    ("card", "waits for the ground"): "its file is made when it stands still, within 20 s",
}


@dataclass(frozen=True, slots=True)
class StatusLine:
    """One status line.

    Parameters
    ----------
    board, version : str
        Board and version of the image that runs.
    image : str
        Its hash, eight hexadecimal digits; empty if it has none.
    fields : dict of str to str
        Key of the line -> what it says.
    """

    board: str
    version: str
    image: str
    fields: dict[str, str] = field(default_factory=dict)

    def state(self, key: str) -> str:
        """State of a field: ``ok``, ``missing``, ``stale``, ``original``; for card and relay their
        text.
        """
        text = self.fields[key]
        if key == "card":
            return re.sub(r"(\s+\d+( %)?)?(, not recorded)?$", "", text)
        if key == "relay":
            return text
        return next((word for word in _STATES if word in text.split()), "ok")

    def numbers(self, key: str) -> list[float]:
        """Numbers of a field, in order."""
        return [float(one) for one in _NUMBER.findall(self.fields[key])]

    def complaints(self) -> list[str]:
        """Lines on what is missing or wrong, with the remedy; empty if nothing is."""
        found = []
        for key in self.fields:
            hint = _HINTS.get((key, self.state(key)))
            if hint:
                found.append(f"{_TITLES.get(key, key)} {self.state(key)}: {hint}")
            elif self.state(key) == "stale":
                found.append(f"{_TITLES.get(key, key)} stale: it was there and went silent")
            elif key in ANALOGUE and "-" in self.fields[key].split():
                found.append(f"{_TITLES[key]}: one is at an end of its range (-); plugged in?")
        supply_mv = self._first("avcc")
        if supply_mv is not None and 0 < supply_mv < self._least_supply_mv():
            found.append(f"supply below {LEAST_AVCC_MV / 1000:.1f} V: the chip is out of its range")
        return found

    @property
    def supply_calibrated(self) -> bool:
        """Whether the chip's reference was calibrated with a meter."""
        return not self.fields["avcc"].startswith("about")

    def counts(self, key: str) -> list[float | None]:
        """Return the counts of analogue channels, None for one that is open or shorted."""
        words = self.fields[key].split()
        return [] if "missing" in words else [None if w == "-" else float(w) for w in words]

    def as_json(self) -> dict[str, object]:
        """Return the line for a program: states, numbers with their unit, and the text."""
        gps = dict(zip(("fix", "satellites"), map(int, self.numbers("gps")), strict=False))
        return {
            "board": self.board,
            "version": self.version,
            "image": self.image,
            "imu": {
                "state": self.state("imu"),
                "roll_deg": self._behind("imu", "roll"),
                "pitch_deg": self._behind("imu", "pitch"),
                "az_mg": self._behind("imu", "az"),
            },
            **{key: {"state": self.state(key), "counts": self.counts(key)} for key in ANALOGUE},
            "baro": {"state": self.state("baro"), "static_pressure_pa": self._first("baro")},
            "gps": {"state": self.state("gps"), "fix": None, "satellites": None, **gps},
            "receiver": {"state": self.state("rc"), "pulse_us": self.numbers("rc")},
            "servos_by": self.fields["drive"],
            "relay": self.state("relay"),
            "flight_card": self._flight_card(),
            "card": {"state": self.state("card"), "file_number": self._file_number()},
            "rail_mv": self._first("rail"),
            "supply_mv": self._first("avcc"),
            "supply_calibrated": self.supply_calibrated,
            "complaints": self.complaints(),
            "text": self.fields,
        }

    def lines(self) -> list[str]:
        """Return the line for a person, one thing per row."""
        rows = [f"{self.board} {self.version}" + (f", image {self.image}" if self.image else "")]
        for key, text in self.fields.items():
            unit = " us" if key == "rc" and self.numbers("rc") else ""
            unit = " counts" if key in ANALOGUE and self.numbers(key) else unit
            rows.append(f"  {_TITLES.get(key, key):<10} {text}{unit}")
        complaints = self.complaints()
        rows += [f"  ! {one}" for one in complaints] or ["  nothing is missing"]
        return rows

    def _least_supply_mv(self) -> float:
        return LEAST_AVCC_MV if self.supply_calibrated else LEAST_AVCC_MV / UNCALIBRATED

    def _behind(self, key: str, word: str) -> float | None:
        words = self.fields[key].split()
        return float(words[words.index(word) + 1]) if word in words[:-1] else None

    def _file_number(self) -> float | None:
        return None if "%" in self.fields["card"] else self._first("card")

    def _flight_card(self) -> dict[str, object] | None:
        if "inputs" not in self.fields:
            return None
        words = self.fields["inputs"].split()
        return {"hash": words[0], "rows": int(words[2]), "enabled": words[3] == "enabled"}

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
    head, *parts = line.split(" | ", _MOST_FIELDS)
    image = _IMAGE.fullmatch(head)
    if image is None:
        return None
    fields: dict[str, str] = {}
    for part in parts:
        words = part.removeprefix("rc us").split() if part.startswith("rc us") else part.split()
        key = "rc" if part.startswith("rc us") else (words.pop(0) if words else "")
        if not key or not words or key in fields:
            return None
        fields[key] = " ".join(words)
    found = StatusLine(image[1], image[2], image[3] or "", fields)
    if not set(_FIELDS) <= set(fields) or not all(_possible(found, key) for key in fields):
        return None
    return found


def _possible(line: StatusLine, key: str) -> bool:
    """Return whether the firmware can have written this field."""
    text = line.fields[key]
    if key not in _KNOWN:
        return len(key) <= _LONGEST_KEY and _LATER.fullmatch(text) is not None
    _, least, most = _KNOWN[key]
    if _GRAMMAR[key].fullmatch(text) is None:
        return False
    return all(least <= number <= most for number in line.numbers(key))
