"""Make wiring pictures' WireViz sources and the table of cables from harness.toml and pin_map.toml.

python hw/generate_wiring.py           write generated/CABLES.md and the sources of the pictures
python hw/generate_wiring.py --check   prove that they, and the pictures made of them, are current
python hw/generate_wiring.py --draw    draw the pictures too (wireviz from PyPI, graphviz)
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
OUT = HERE / "generated"
FIRST_LINE = "# made by hw/generate_wiring.py from hw/harness.toml and hw/pin_map.toml; do not edit"
MEGA = "Arduino Mega 2560"
# On the IMU's tray SDA and SCL keep the colours they have towards the Mega.
_BUS_COLOURS = {
    "SDA": "BN", "A4": "BN", "HV1": "BN", "LV1": "BN",
    "SCL": "OG", "A5": "OG", "HV2": "OG", "LV2": "OG", "GPS TX": "YE",
}  # fmt: skip
PICTURES = ("control", "sensors", "modules")
_SUPPLY_COLOURS = {
    "GND": "BK",
    "5V": "RD",
    "VCC": "RD",
    "HV": "RD",
    "+ servo rail": "RD",
    "3V3": "PK",
    "7 to 15 V": "RD",
    "4.8 to 6 V": "RD",
}
_WIRE_COLOURS = ("BN", "OG", "YE", "GN", "BU", "VT", "GY", "PK", "TQ", "WH")


class HarnessError(Exception):
    """Harness and pin map contradict each other."""


@dataclass(frozen=True, slots=True)
class Device:
    """What stands at the other end of the Mega's wires: (pin of the device, signal) pairs."""

    name: str
    part: str
    side: str
    supply: str
    connector: str
    length_mm: int
    pins: tuple[tuple[str, str], ...]
    board: str = ""


@dataclass(frozen=True, slots=True)
class Cable:
    """Wires between two connectors: (pin there, pin here, colour) each."""

    start: str
    end: str
    wires: tuple[tuple[str, str, str], ...]
    length_mm: int = 0


def load_devices(harness_text: str, map_text: str) -> list[Device]:
    """Read the devices and hold them against the pin map.

    Raises
    ------
    HarnessError
        A signal without a device or with two, a device with a signal the map lacks, a supply that
        no rail is called, a rail that feeds what is not there.
    """
    table = tomllib.loads(harness_text)
    devices = [Device(**row | {"pins": tuple(map(tuple, row["pins"]))}) for row in table["device"]]
    known = [str(row["name"]) for row in tomllib.loads(map_text)["signal"]]
    used = [signal for device in devices for _, signal in device.pins]
    for device in devices:
        if device.side not in ("left", "right"):
            raise HarnessError(f"{device.name}: side is '{device.side}', expected left or right")
        for _, signal in device.pins:
            if signal not in known:
                raise HarnessError(f"{device.name}: pin_map.toml has no signal {signal}")
            if used.count(signal) > 1:
                raise HarnessError(f"{device.name}: signal {signal} has two ends")
    for signal in known:
        if signal not in used:
            raise HarnessError(f"signal {signal} of pin_map.toml goes to no device")
    _check_rails(table, devices)
    return devices


def _check_rails(table: dict[str, list[dict[str, object]]], devices: list[Device]) -> None:
    fed: dict[str, set[str]] = {}
    for rail in table["rail"]:
        feeds = rail["feeds"]
        fed[str(rail["name"])] = set(map(str, feeds)) if isinstance(feeds, list) else set()
    for device in devices:
        if device.supply != "none" and device.name not in fed.get(device.supply, set()):
            raise HarnessError(f"{device.name}: rail '{device.supply}' does not feed it")


def shown_in(device: str) -> str:
    """Return which of the three pictures of the Mega shows a device."""
    if device in ("Receiver", "Relay board"):
        return "control"
    return "sensors" if device.split()[0] in ("Vane", "Pitot", "Pot", "Rail") else "modules"


def signal_picture(harness_text: str, map_text: str, picture: str) -> str:
    """Write the WireViz source of the signal wires of one picture: control, sensors or modules."""
    devices = [d for d in load_devices(harness_text, map_text) if shown_in(d.name) == picture]
    pins = {str(row["name"]): str(row["pin"]) for row in tomllib.loads(map_text)["signal"]}
    links = [
        row
        for row in tomllib.loads(harness_text)["link"]
        if row.get("picture", "control") == picture
    ]
    connectors: dict[str, tuple[str, list[str], str]] = {
        device.name: (device.part, [pin for pin, _ in device.pins], device.supply)
        for device in devices
    }
    cables: list[Cable] = []
    for device in devices:
        wires = tuple(
            (pin, pins[signal], _WIRE_COLOURS[place % len(_WIRE_COLOURS)])
            for place, (pin, signal) in enumerate(device.pins)
        )
        if device.side == "left":
            cables.append(Cable(device.name, MEGA, wires, device.length_mm))
        else:
            turned = tuple((here, there, colour) for there, here, colour in wires)
            cables.append(Cable(MEGA, device.name, turned, device.length_mm))
    for link in links:
        for end, place in (("from", 0), ("to", 1)):
            part, held, supply = connectors.get(link[end], (link.get(f"{end}_part", ""), [], ""))
            # In front: such wires run above those of the Mega.
            held = [pair[place] for pair in link["pins"]] + held
            connectors[link[end]] = (part, held, supply)
        wires = tuple(
            (there, here, _WIRE_COLOURS[place]) for place, (there, here) in enumerate(link["pins"])
        )
        cables.append(Cable(link["from"], link["to"], wires))
    board = [(pins[signal], signal) for signal in board_order(devices)]
    lines = [FIRST_LINE, *_style(), "connectors:"]
    lines += _connector(MEGA, "signal wires; supply: power.svg", board)
    for name, (part, names, supply) in connectors.items():
        note = f"{part}; {supply}" if supply and supply != "none" else part
        lines += _connector(name, note, [(pin, "") for pin in names])
    return "\n".join([*lines, *_cables(cables)]) + "\n"


def board_order(devices: list[Device]) -> list[str]:
    """Order the Mega's signals so that wires of neither side cross."""
    placed: list[tuple[float, str]] = []
    for side in ("left", "right"):
        signals = [s for device in devices if device.side == side for _, s in device.pins]
        placed += [((place + 0.5) / len(signals), s) for place, s in enumerate(signals)]
    return [signal for _, signal in sorted(placed)]


def link_picture(harness_text: str, picture: str) -> str:
    """Write the WireViz source of the wires that do not touch the Mega and name this picture."""
    links = [r for r in tomllib.loads(harness_text)["link"] if r.get("picture") == picture]
    connectors: dict[str, list[str]] = {}
    cables = []
    for link in links:
        for end, place in (("from", 0), ("to", 1)):
            held = connectors.setdefault(link[end], [])
            held += [pair[place] for pair in link["pins"] if pair[place] not in held]
        wires = tuple(
            (a, b, _SUPPLY_COLOURS.get(a, _BUS_COLOURS.get(a, _WIRE_COLOURS[4])))
            for a, b in link["pins"]
        )
        cables.append(Cable(link["from"], link["to"], wires, link["length_mm"]))
    lines = [FIRST_LINE, *_style(), "connectors:"]
    for name, pins in connectors.items():
        lines += _connector(name, "IMU tray", [(pin, "") for pin in pins])
    return "\n".join([*lines, *_cables(cables)]) + "\n"


def cable_table(harness_text: str, nets_text: str) -> str:
    """Write the table to make cables from: each plug of the shield, pin by pin.

    Parameters
    ----------
    harness_text
        Content of harness.toml.
    nets_text
        Content of board/generated/nets.csv, which knows the plugs' pins.
    """
    rows = list(csv.DictReader(nets_text.splitlines()[1:]))
    lines = [
        f"<!-- {FIRST_LINE.removeprefix('# ')} -->",
        "# Cables of the shield, plug by plug",
        "",
        "Pin 1 has the square pad. Lengths for a span of 1.8 m; 28 AWG, servo leads 22 AWG.",
        "A sensor board's J1 has the same pins as its plug here: wire for wire.",
        "",
        "| plug | to | far end | pin | wire | colour | length m |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for device in tomllib.loads(harness_text)["device"]:
        for plug in _plugs(device["connector"]):
            pins = sorted((r for r in rows if r["ref"] == plug), key=lambda row: int(row["pin"]))
            words = [re.split(r",| \(| to ", label)[0] for label, _ in device["pins"]]
            for row in pins:
                name = row["pin name"]
                colour = _SUPPLY_COLOURS.get(name) or _BUS_COLOURS.get(name)
                if name in words:  # as in the picture of the Mega's wires
                    colour = _WIRE_COLOURS[words.index(name)]
                length = f"{device['length_mm'] / 1000:g}" if device["length_mm"] else "plugged in"
                far = f"{device['board']} board J1" if "board" in device else "its own"
                cells = (plug, device["name"], far, row["pin"], name, colour, length)
                lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join([*lines, *_lead_rows(harness_text, rows), *_link_rows(harness_text)]) + "\n"


def _lead_rows(harness_text: str, rows: list[dict[str, str]]) -> list[str]:
    # Servos and supplies, in the same table.
    found = []
    for lead in tomllib.loads(harness_text).get("lead", ()):
        pins = [row for row in rows if row["ref"] == lead["connector"]]
        if not pins:
            raise HarnessError(f"lead {lead['connector']} of harness.toml is no plug of the shield")
        for row in sorted(pins, key=lambda row: int(row["pin"])):
            name = row["pin name"]
            gauge = f"its own, {lead['gauge']} AWG" if "gauge" in lead else "its own"
            colour = _SUPPLY_COLOURS.get(name, "WH")
            cells = (lead["connector"], lead["to"], gauge, row["pin"], name, colour)
            found.append(f"| {' | '.join(cells)} | {lead['length_mm'] / 1000:g} |")
    return found


def _link_rows(harness_text: str) -> list[str]:
    # Wires between boxes that do not touch the shield's plugs: the IMU's tray.
    found = [
        "",
        "## On the IMU's tray",
        "",
        "| from | pin | to | pin | colour | length m |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for link in tomllib.loads(harness_text)["link"]:
        if "length_mm" in link and link["from"] != "Shield J22":
            for here, there in link["pins"]:
                colour = _SUPPLY_COLOURS.get(here) or _BUS_COLOURS.get(here) or "BU"
                cells = (link["from"], here, link["to"], there, colour)
                found.append(f"| {' | '.join(cells)} | {link['length_mm'] / 1000:g} |")
    return found


def _plugs(connector: str) -> list[str]:
    # "J1 to J5, servo leads" or "J26, plugged in"
    first, _, last = connector.partition(",")[0].partition(" to ")
    if not first.startswith("J"):
        return []
    return [f"J{n}" for n in range(int(first[1:]), int((last or first)[1:]) + 1)]


def power_picture(harness_text: str) -> str:
    """Write the WireViz source of the supply wires."""
    rails = tomllib.loads(harness_text)["rail"]
    outlets = {rail["source"]: rail for rail in rails}
    groups = [_grouped(rail["feeds"]) for rail in rails]
    consumers = [name for group in groups for name in group]
    lines = [FIRST_LINE, *_style(), "connectors:"]
    cables: list[Cable] = []
    for rail, group in zip(rails, groups, strict=True):
        fed_too = rail["source"] in consumers
        names = (["+ in", "- in"] if fed_too else []) + ["+", "-"]
        lines += _connector(rail["source"], rail["source_part"], [(n, "") for n in names])
        for name in group:
            ends = ("+ in", "- in") if name in outlets else ("+", "-")
            wires = (("+", ends[0], "RD"), ("-", ends[1], "BK"))
            cables.append(Cable(rail["source"], name, wires))
    for name in consumers:
        if name not in outlets:
            lines += _connector(name, "", [("+", ""), ("-", "")])
    cables.append(Cable("5 V regulator", "BEC or servo battery", (("-", "-", "BK"),)))
    return "\n".join([*lines, *_cables(cables)]) + "\n"


def _grouped(names: list[str]) -> list[str]:
    """Make one of names that begin alike: `Vane alpha left`, ... become `Vane, 4 of them`."""
    kinds = [name.split()[0] for name in names]
    merged = (
        f"{kind}, {kinds.count(kind)} of them" if kinds.count(kind) > 1 else name
        for kind, name in zip(kinds, names, strict=True)
    )
    return list(dict.fromkeys(merged))


def _style() -> Iterator[str]:
    yield "options: {fontname: 'DejaVu Sans', bgcolor: WH, mini_bom_mode: true}"


def _connector(name: str, note: str, pins: list[tuple[str, str]]) -> Iterator[str]:
    yield f"  {json.dumps(name)}:"
    yield f"    type: {json.dumps(note)}" if note else "    type: supply"
    yield "    show_pincount: false"
    yield f"    pins: {_names(pin for pin, _ in pins)}"
    if any(label for _, label in pins):
        yield f"    pinlabels: {json.dumps([label for _, label in pins])}"


def _names(pins: Iterable[str]) -> str:
    # WireViz turns digits in a connection into a number, and in a connector does not.
    return json.dumps([int(pin) if pin.isdigit() else pin for pin in pins])


def _cables(cables: list[Cable]) -> Iterator[str]:
    yield "cables:"
    for number, cable in enumerate(cables, start=1):
        yield f"  W{number}:"
        yield f"    wirecount: {len(cable.wires)}"
        yield f"    colors: [{', '.join(colour for _, _, colour in cable.wires)}]"
        if cable.length_mm:
            yield f"    length: {cable.length_mm / 1000:g}"
        yield "    show_wirecount: false"
        yield "    show_wirenumbers: false"
    yield "connections:"
    for number, cable in enumerate(cables, start=1):
        yield "  -"
        yield f"    - {json.dumps(cable.start)}: {_names(a for a, _, _ in cable.wires)}"
        yield f"    - W{number}: [{', '.join(str(w + 1) for w in range(len(cable.wires)))}]"
        yield f"    - {json.dumps(cable.end)}: {_names(b for _, b, _ in cable.wires)}"


def mark(source: str) -> str:
    """Give the line by which a picture names the source it was drawn from."""
    return f"<!-- drawn from sha256 {hashlib.sha256(source.encode()).hexdigest()} -->"


def draw(source: str, picture: Path) -> None:
    """Draw one picture with wireviz.

    Raises
    ------
    HarnessError
        wireviz or graphviz is missing or fails.
    """
    tool = shutil.which("wireviz")
    if tool is None or shutil.which("dot") is None:
        raise HarnessError("drawing needs wireviz (pip install wireviz) and graphviz on the PATH")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / picture.with_suffix(".yml").name
        path.write_text(source)
        done = subprocess.run([tool, "-f", "s", path], capture_output=True, text=True, check=False)
        drawn = path.with_suffix(".svg")
        if done.returncode or not drawn.exists():
            raise HarnessError(f"wireviz failed: {done.stderr.strip()[-300:]}")
        picture.write_text(drawn.read_text().rstrip("\n") + "\n" + mark(source) + "\n")


def main(arguments: list[str] | None = None) -> int:
    """Write, check or draw; 0 ok, 2 the harness is wrong, 6 a file is not current."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--check", action="store_true", help="compare with what is committed")
    parser.add_argument("--draw", action="store_true", help="draw the SVG with wireviz")
    args = parser.parse_args(arguments)
    harness, pin_map = (HERE / name for name in ("harness.toml", "pin_map.toml"))
    try:
        made = {
            **{
                OUT / f"wiring-{name}.yml": signal_picture(
                    harness.read_text(), pin_map.read_text(), name
                )
                for name in PICTURES
            },
            OUT / "power.yml": power_picture(harness.read_text()),
            OUT / "imu.yml": link_picture(harness.read_text(), "imu"),
        }
        nets = (HERE / "board" / "generated" / "nets.csv").read_text(encoding="utf-8")
        table = cable_table(harness.read_text(), nets)
        if not args.check:
            (OUT / "CABLES.md").write_text(table, encoding="utf-8")
        elif (OUT / "CABLES.md").read_text(encoding="utf-8") != table:
            raise HarnessError("CABLES.md is not current: run python hw/generate_wiring.py")
        for path, content in made.items():
            picture = path.with_suffix(".svg")
            if args.check:
                _check(path, picture, content)
                continue
            path.write_text(content)
            if args.draw:
                draw(content, picture)
            print(f"wrote {path.relative_to(HERE.parent)}")
    except HarnessError as error:
        print(f"hw: {error}", file=sys.stderr)
        return 6 if args.check and "not current" in str(error) else 2
    return 0


def _check(path: Path, picture: Path, content: str) -> None:
    if not path.exists() or path.read_text() != content:
        raise HarnessError(f"{path.name} is not current: run python hw/generate_wiring.py --draw")
    if not picture.exists() or mark(content) not in picture.read_text():
        raise HarnessError(f"{picture.name} is not current: run with --draw")


if __name__ == "__main__":
    sys.exit(main())
