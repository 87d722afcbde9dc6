"""Hold the schematic's nets against the pin map, the harness and the relay's page.

python hw/board/check_nets.py       needs no KiCad: it reads what export.py wrote

Each net is called as its signal in pin_map.toml. A wire of the harness may pass one resistor.
"""

from __future__ import annotations

import csv
import re
import sys
import tomllib
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
MEGA = "M1"
RAILS = {"5 V sensors": "+5V", "servo rail": "+VSERVO", "3.3 V of the Mega": "+3V3"}
# Symbols of what stands on the IMU's tray, and its plug.
_TRAY = {
    "Shield J22": "J22",
    "Pro Mini": "M2",
    "Level shifter": "M3",
    "GY-521": "M4",
    "GY-271": "M5",
}
SUPPLIES = {*RAILS.values(), "GND"}
_CONTACT = re.compile(r"^\| (K\d) ([ab]) \| (.+?) \| (.+?) \| (.+?) \|$", re.M)
_VALUE = re.compile(r"^\| ([RC])(\d+)(?: to [RC](\d+))? \| [^|]*\| ([\d.]+) (kohm|ohm|uF)\b", re.M)
# Contact set a is pins 2, 3, 4 of the relay, b is 9, 8, 7 (data sheet ASCTB14E, seen from below).
_PINS = {"a": ("2", "4", "3"), "b": ("9", "7", "8")}


@dataclass(frozen=True, slots=True)
class Part:
    """One symbol: what it is, which device of the harness it belongs to."""

    ref: str
    value: str
    part: str
    device: str


@dataclass(frozen=True, slots=True)
class Board:
    """The nets of the schematic.

    Attributes
    ----------
    parts
        By reference.
    net_of
        (reference, pin) -> net, without the sheet's path.
    names
        (reference, pin) -> the pin's name.
    """

    parts: dict[str, Part]
    net_of: dict[tuple[str, str], str]
    names: dict[tuple[str, str], str]

    def across(self) -> dict[str, set[str]]:
        """Return which nets a single resistor joins, supplies left out."""
        ends: dict[str, list[str]] = defaultdict(list)
        for (ref, _), net in self.net_of.items():
            if self.parts[ref].part == "resistor":
                ends[ref].append(net)
        joined: dict[str, set[str]] = defaultdict(set)
        for here, there in ends.values():
            if not {here, there} & SUPPLIES:
                joined[here].add(there)
                joined[there].add(here)
        return joined


def rows(text: str) -> list[dict[str, str]]:
    """Read a table of export.py; its first line names the hash of the sheets."""
    return list(csv.DictReader(text.splitlines()[1:]))


def load(parts_text: str, nets_text: str) -> Board:
    """Read parts.csv and nets.csv."""
    parts = {
        row["ref"]: Part(row["ref"], row["value"], row["part"], row["device"])
        for row in rows(parts_text)
    }
    pins = [((row["ref"], row["pin"]), row) for row in rows(nets_text)]
    return Board(
        parts,
        {pin: row["net"].rpartition("/")[2] for pin, row in pins},
        {pin: row["pin name"] for pin, row in pins},
    )


def faults(board: Board, map_text: str, harness_text: str, relay_text: str) -> list[str]:
    """Name every contradiction between the schematic and what owns the facts.

    Parameters
    ----------
    board
        The schematic.
    map_text, harness_text, relay_text
        Content of pin_map.toml, harness.toml and relay.md.

    Returns
    -------
    list of str
        One line each, empty if all agree.
    """
    pins = {row["name"]: row["pin"] for row in tomllib.loads(map_text)["signal"]}
    return [
        *_mega_faults(board, pins),
        *_device_faults(board, tomllib.loads(harness_text)["device"]),
        *_link_faults(board, tomllib.loads(harness_text)["link"]),
        *_contact_faults(board, relay_text),
        *_value_faults(board, relay_text),
    ]


def _mega_faults(board: Board, pins: dict[str, str]) -> list[str]:
    found = []
    wired = {pin: net for (ref, pin), net in board.net_of.items() if ref == MEGA}
    signal_of = {pin: name for name, pin in pins.items()}
    for name, pin in pins.items():
        net = wired.get(pin, "nothing")
        free = net.startswith("unconnected-")
        if name.startswith("usb_"):
            if not free:
                found.append(f"pin {pin} belongs to USB, the schematic has {net} on it")
        elif net != name:
            found.append(f"pin {pin} carries {name} (pin_map.toml), the schematic has {net}")
    for pin, net in wired.items():
        used = pin in signal_of or net in SUPPLIES or net.startswith("unconnected-")
        if not used:
            found.append(f"pin {pin} carries {net}, pin_map.toml does not use it")
    return found


def _device_faults(board: Board, devices: list[dict[str, object]]) -> list[str]:
    found = []
    across = board.across()
    for device in devices:
        name, supply, pairs = str(device["name"]), str(device["supply"]), device["pins"]
        refs = {ref for ref, part in board.parts.items() if part.device == name}
        if name in ("Relay board", "USB"):
            continue  # on the board itself: see _contact_faults and _mega_faults
        if not refs:
            found.append(f"{name} of harness.toml has no symbol")
            continue
        own = {pin: net for pin, net in board.net_of.items() if pin[0] in refs}
        assert isinstance(pairs, list)
        for label, signal in pairs:
            word = re.split(r",| \(| to ", label)[0]
            nets = {net for pin, net in own.items() if board.names[pin] == word}
            if word == "middle":  # of the divider: the net that both resistors share
                nets = {net for net in own.values() if list(own.values()).count(net) == 2}
            if not any(net == signal or signal in across[net] for net in nets):
                was = ", ".join(sorted(nets)) or "no such pin"
                found.append(f"{name} {word} leads to {was}, harness.toml says {signal}")
        if supply in RAILS and RAILS[supply] not in own.values():
            found.append(f"{name} has no {RAILS[supply]}, harness.toml feeds it from {supply}")
        for pin, net in own.items():
            rail = {"5V": "+5V", "3V3": "+3V3", "+ servo rail": "+VSERVO", "GND": "GND"}
            wanted = rail.get(board.names[pin])
            if wanted and net != wanted:
                found.append(f"{name} {board.names[pin]} stands on {net}, expected {wanted}")
    return found


def _link_faults(board: Board, links: list[dict[str, object]]) -> list[str]:
    found = []
    for link in links:
        pairs = link["pins"]
        if "picture" not in link or not isinstance(pairs, list):
            continue
        here, there = (_TRAY[str(link[end])] for end in ("from", "to"))
        for one, other in pairs:
            nets = [_nets_at(board, here, one), _nets_at(board, there, other)]
            if not nets[0] or nets[0] != nets[1]:
                found.append(
                    f"{link['from']} {one} and {link['to']} {other} of harness.toml:"
                    f" the schematic has {nets[0] or 'nothing'} and {nets[1] or 'nothing'}"
                )
    return found


def _nets_at(board: Board, ref: str, word: str) -> set[str]:
    """Return the nets on a symbol's pins of a number or a name."""
    return {
        net
        for pin, net in board.net_of.items()
        if pin[0] == ref and word in (pin[1], board.names[pin])
    }


def _contact_faults(board: Board, relay_text: str) -> list[str]:
    found = []
    across = board.across()
    table = _CONTACT.findall(relay_text)
    if len(table) != 6:
        return [f"relay.md: found {len(table)} contact sets, expected 6"]
    for relay, contact, rest, engaged, common in table:
        for what, pin in zip((rest, engaged, common), _PINS[contact], strict=True):
            net = board.net_of.get((relay, pin), "no such pin")
            if not _is_wired(board, across, net, what):
                found.append(f"{relay} pin {pin} is on {net}, relay.md says {what}")
    return found


def _value_faults(board: Board, relay_text: str) -> list[str]:
    found = []
    table = _VALUE.findall(relay_text)
    if not table:
        return ["relay.md: found no value of a resistor or capacitor"]
    for kind, first, last, number, unit in table:
        wanted = number + {"kohm": "k", "ohm": "", "uF": "u"}[unit]
        for place in range(int(first), int(last or first) + 1):
            ref = f"{kind}{place}"
            value = board.parts[ref].value if ref in board.parts else "nothing"
            if value != wanted:
                found.append(f"{ref} is {value} in the schematic, {number} {unit} in relay.md")
    return found


def _is_wired(board: Board, across: dict[str, set[str]], net: str, what: str) -> bool:
    first, _, last = what.rpartition(" ")
    if what == "open":
        return net.startswith("unconnected-")
    if what == "ground":
        return net == "GND"
    if first == "receiver":
        return net == f"rx_{last}"
    if what.startswith("pin "):
        pin, resistor = re.findall(r"pin (\w+) through (R\d+)", what)[0]
        ends = {n for (ref, _), n in board.net_of.items() if ref == resistor}
        return ends == {net, board.net_of[(MEGA, pin)]}
    surface = "throttle" if what == "ESC" else first
    return net == f"servo_{surface}_out"


def main() -> int:
    """Print every contradiction; 0 none, 6 some."""
    hw = HERE.parent
    board = load(
        (HERE / "generated" / "parts.csv").read_text(encoding="utf-8"),
        (HERE / "generated" / "nets.csv").read_text(encoding="utf-8"),
    )
    texts = [(hw / n).read_text("utf-8") for n in ("pin_map.toml", "harness.toml", "relay.md")]
    found = faults(board, *texts)
    print("\n".join(found) or "schematic agrees with pin map, harness and relay")
    return 6 if found else 0


if __name__ == "__main__":
    sys.exit(main())
