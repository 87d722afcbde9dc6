"""Hold the boards on the wing against the shield's plugs, the harness and the chips' data sheets.

python hw/board/check_sensors.py       needs no KiCad: it reads what export.py wrote
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path

import check_nets

HERE = Path(__file__).resolve().parent
# Pin by pin: AS5600 (ams OSRAM DS000365, figure 4) and MPXV7002 (NXP, table of case 1351).
# PGO has a pull-up of its own; DIR at ground counts clockwise; the rest of MPXV7002 stays free.
CHIPS: Mapping[str, Mapping[str, str]] = {
    "vane": {
        "1": "+5V", "2": "inner_3V3", "3": "raw", "4": "GND", "5": "free", "6": "sda",
        "7": "scl", "8": "GND",
    },
    "pitot": {
        "1": "free", "2": "+5V", "3": "GND", "4": "raw", "5": "free", "6": "free", "7": "free",
        "8": "free",
    },
}  # fmt: skip
# What must stand between two nets, by the data sheets: a capacitor at each supply, the filter.
_BETWEEN: Mapping[str, tuple[tuple[str, str, str], ...]] = {
    "vane": (
        ("100n", "+5V", "GND"), ("1u", "inner_3V3", "GND"), ("100", "raw", "out"),
        ("10n", "out", "GND"), ("10k", "sda", "+5V"), ("10k", "scl", "+5V"),
    ),
    "pitot": (
        ("1u", "+5V", "GND"), ("10n", "+5V", "GND"), ("470p", "raw", "GND"), ("100", "raw", "out"),
    ),
}  # fmt: skip
_RAILS = {"5V": "+5V", "GND": "GND", "OUT": "out"}


def faults(
    sensors: Mapping[str, check_nets.Board], shield: check_nets.Board, harness_text: str
) -> list[str]:
    """Name every contradiction.

    Parameters
    ----------
    sensors
        The boards on the wing by name.
    shield
        The shield's nets.
    harness_text
        Content of harness.toml.
    """
    found = []
    for name, board in sensors.items():
        for pin, wanted in CHIPS[name].items():
            net = board.net_of.get(("U1", pin), "no such pin")
            if net != wanted and not (wanted == "free" and net.startswith("unconnected-")):
                found.append(
                    f"{name} board: U1 pin {pin} is on {net}, its data sheet says {wanted}"
                )
        for value, one, other in _BETWEEN[name]:
            if not any(
                part.value == value and _ends(board, ref) == {one, other}
                for ref, part in board.parts.items()
            ):
                found.append(f"{name} board: nothing of {value} between {one} and {other}")
    for device in tomllib.loads(harness_text)["device"]:
        if "board" in device:
            found += _plug_faults(device, sensors, shield)
    return found


def _ends(board: check_nets.Board, ref: str) -> set[str]:
    return {net for (owner, _), net in board.net_of.items() if owner == ref}


def _plug_faults(
    device: Mapping[str, str], sensors: Mapping[str, check_nets.Board], shield: check_nets.Board
) -> list[str]:
    name, plug = device["board"], device["connector"]
    if name not in sensors:
        return [f"{device['name']}: there is no {name} board, expected one of {list(sensors)}"]
    board = sensors[name]
    found = []
    for pin in ("1", "2", "3"):
        here, there = shield.names.get((plug, pin)), board.names.get(("J1", pin))
        if here != there:
            found.append(f"{plug} pin {pin} is {here}, J1 of the {name} board has {there} there")
        net = board.net_of.get(("J1", pin), "no such pin")
        if net != _RAILS.get(there or ""):
            found.append(f"{name} board: J1 pin {pin}, {there}, is on {net}")
    return found


def read(generated: Path) -> check_nets.Board:
    """Read a board from what export.py wrote."""
    texts = [(generated / name).read_text(encoding="utf-8") for name in ("parts.csv", "nets.csv")]
    return check_nets.load(*texts)


def main() -> int:
    """Print every contradiction; 0 none, 6 some."""
    sensors = {name: read(HERE / "sensors" / "generated" / name) for name in CHIPS}
    harness = (HERE.parent / "harness.toml").read_text(encoding="utf-8")
    found = faults(sensors, read(HERE / "generated"), harness)
    print("\n".join(found) or "boards on the wing agree with shield, harness and data sheets")
    return 6 if found else 0


if __name__ == "__main__":
    sys.exit(main())
