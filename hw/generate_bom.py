"""Make the bill of materials and the page of the light variant: what is bought, what it weighs.

python hw/generate_bom.py           write bom.csv and generated/LIGHT.md
python hw/generate_bom.py --check   prove that they are current
"""

from __future__ import annotations

import argparse
import csv
import io
import sys
import tomllib
from collections import defaultdict
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
BOM = HERE / "bom.csv"
LIGHT = HERE / "generated" / "LIGHT.md"
PETG_USD_PER_G = 0.025
KITS = ("logger", "radio", "flight")
# Parts of each printed board and how many boards a logger has; the shield's references are bare.
SYMBOLS = {
    "": ("board/generated/parts.csv", 1),
    "vane": ("board/sensors/generated/vane/parts.csv", 4),
    "pitot": ("board/sensors/generated/pitot/parts.csv", 1),
}
COLUMNS = (
    "what", "maker", "part number", "alternative", "quantity", "unit price USD", "price class",
    "unit weight g", "kit", "refs", "drawing", "part of the 2015 logger", "note",
)  # fmt: skip


class BomError(Exception):
    """A part without a line, a line without a part."""


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the list; price in USD and weight in g of one piece."""

    what: str
    maker: str
    number: str
    alternative: str
    quantity: float
    price_usd: float
    weight_g: float
    kit: str
    refs: tuple[str, ...] = ()
    drawing: str = ""
    of_2015: str = "none"
    note: str = ""

    def cells(self) -> tuple[str, ...]:
        """Return the line as text, in the order of COLUMNS."""
        return (
            self.what, self.maker, self.number, self.alternative, f"{self.quantity:g}",
            f"{self.price_usd:.2f}", price_class(self.price_usd), f"{self.weight_g:g}", self.kit,
            " ".join(self.refs), self.drawing, self.of_2015, self.note,
        )  # fmt: skip


def price_class(price_usd: float) -> str:
    """Return A below 0.1 USD, B below 1, C below 10, D above: what survives a change of shop."""
    return "ABCD"[sum(price_usd >= limit for limit in (0.1, 1.0, 10.0))]


def counted(parts_texts: Mapping[str, str]) -> dict[tuple[str, str], list[str]]:
    """Return the references of each (part, value), the wing's with their board's name.

    Parameters
    ----------
    parts_texts
        parts.csv of each board, keys as in SYMBOLS.
    """
    found: dict[tuple[str, str], list[str]] = defaultdict(list)
    for board, text in parts_texts.items():
        for row in csv.DictReader(text.splitlines()[1:]):
            if row["part"] != "none":
                found[row["part"], row["value"]].append(f"{board} {row['ref']}".strip())
    return found


def pieces(ref: str) -> int:
    """Return how many of a reference one logger has: four vane boards have four of its parts."""
    return SYMBOLS[ref.rpartition(" ")[0]][1]


def wire_m(harness_text: str, without: Collection[str] = ()) -> float:
    """Return the metres of wire: every pin of a cable, supply and ground with it.

    Parameters
    ----------
    harness_text
        Content of harness.toml.
    without
        Devices that are left out.
    """
    total = 0.0
    harness = tomllib.loads(harness_text)
    for link in harness["link"]:
        if "length_mm" in link and link["from"] != "Shield J22":  # that is J22's own cable
            total += len(link["pins"]) * link["length_mm"] / 1000.0
    for device in harness["device"]:
        if device["name"] in without:
            continue
        lead = "servo leads" in device["connector"]  # bought ready
        supplies = 2 if device["supply"] != "none" else 1
        total += 0.0 if lead else (len(device["pins"]) + supplies) * device["length_mm"] / 1000.0
    return round(total + 0.5)


def supply_wire_m(harness_text: str) -> float:
    """Return the metres of thick wire: both wires of each lead that has a gauge of its own."""
    leads = tomllib.loads(harness_text)["lead"]
    return sum(2.0 * float(lead["length_mm"]) / 1000.0 for lead in leads if "gauge" in lead)


def resistor_code(value: str) -> str:
    """Return Yageo's code: 330 -> 330R, 4.7k -> 4K7, 10k -> 10K."""
    if not value.endswith("k"):
        return f"{value}R"
    whole, _, part = value.removesuffix("k").partition(".")
    return f"{whole}K{part}"


def lines(parts_toml: str, parts_texts: Mapping[str, str], harness_text: str) -> list[Line]:
    """Return the list.

    Parameters
    ----------
    parts_toml, harness_text
        Content of parts.toml and harness.toml.
    parts_texts
        parts.csv of each board, keys as in SYMBOLS.

    Raises
    ------
    BomError
        A part of the schematic that parts.toml lacks; a line that nothing counts; an unknown kit.
    """
    symbols = counted(parts_texts)
    found: list[Line] = []
    seen: set[str] = set()
    for row in tomllib.loads(parts_toml)["part"]:
        key, kit = row.pop("key"), row["kit"]
        if kit not in KITS:
            raise BomError(f"parts.toml: {key} is in kit '{kit}', expected one of {KITS}")
        seen.add(key)
        uses = [(value, refs) for (part, value), refs in symbols.items() if part == key]
        if key == "wire":
            row["quantity"] = wire_m(harness_text)
        if key == "supply_wire":
            row["quantity"] = supply_wire_m(harness_text)
        if key != "resistor":  # only a resistor's value makes another part number
            uses = [("", [ref for _, refs in uses for ref in refs])]
        if "quantity" not in row and not any(refs for _, refs in uses):
            raise BomError(f"parts.toml: {key} has no quantity and the schematic does not use it")
        for value, refs in uses:
            named = dict(row)
            if key == "resistor":
                named["number"] = row["number"].format(code=resistor_code(value))
                named["what"] = f"{row['what']}, {value}ohm"
            quantity = named.pop("quantity", sum(map(pieces, refs)))
            ordered = sorted(refs, key=_by_board)
            found.append(Line(quantity=quantity, refs=tuple(ordered), **named))
    for part, _ in symbols:
        if part not in seen:
            raise BomError(
                f"the schematic uses {part or 'a symbol without Part'}: not in parts.toml"
            )
    return found


def _by_board(ref: str) -> tuple[str, str, int]:
    board, _, name = ref.rpartition(" ")
    return board, name.rstrip("0123456789"), int(name.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ"))


def made(masses_csv: str) -> list[Line]:
    """Return the mechanical parts that are printed or cut, by file; printed ones as if solid."""
    found = []
    for row in csv.DictReader(masses_csv.splitlines()[2:]):
        if row["file"]:
            printed = row["material"] == "petg"
            mass_g = float(row["mass_g"])
            stem = row["file"].removesuffix(".step")
            found.append(
                Line(
                    what=f"{row['name']}, {row['material']}",
                    maker="own",
                    number=f"mechanics/generated/step/{row['file']}",
                    alternative="PLA indoors, ABS" if printed else "see its drawing",
                    quantity=int(row["quantity"]),
                    price_usd=round(mass_g * PETG_USD_PER_G, 2) if printed else 0.0,
                    weight_g=mass_g,
                    kit="flight",
                    drawing=f"mechanics/generated/drawings/{stem}.svg",
                )
            )
    return found


def lightened(found: list[Line], leave: Mapping[str, Any], wire: float) -> list[Line]:
    """Return the list once more parts have left.

    Parameters
    ----------
    found
        The list before.
    leave
        One entry of light.toml.
    wire
        Metres of wire that stay.

    Raises
    ------
    BomError
        A part that no line has.
    """
    parts = {row["key"]: row for row in _toml("parts.toml")["part"]}
    named: dict[str, float] = {"the wire": wire}
    for key, quantity in leave.get("parts", {}).items():
        if key not in parts:
            raise BomError(f"light.toml: parts.toml has no {key}")
        named[parts[key]["what"]] = quantity
    made_names = {line.what.rpartition(", ")[0]: line.what for line in found if line.maker == "own"}
    for name, quantity in leave.get("made", {}).items():
        if name in made_names:  # a magnet and what is bought stand among the parts
            named[made_names[name]] = quantity
        elif name != "magnet":
            raise BomError(f"light.toml: masses.csv has no {name}")
    named[parts["wire"]["what"]] = named.pop("the wire")
    boards = leave.get("boards", {})
    return [
        replace(line, quantity=named.get(line.what, line.quantity * _stays(line, boards)))
        for line in found
    ]


def _stays(line: Line, boards: Mapping[str, int]) -> float:
    """Return the share of a line that stays when boards of a sensor leave."""
    if not line.refs:
        return 1.0
    before = sum(map(pieces, line.refs))
    after = sum(boards.get(ref.rpartition(" ")[0], pieces(ref)) for ref in line.refs)
    return after / before


def flown_g(found: list[Line], light: Mapping[str, Any]) -> tuple[float, float]:
    """Return what flies, in g: with printed parts solid, and as they are printed."""
    solid = printed = 0.0
    for line in found:
        name, _, material = line.what.rpartition(", ")
        if line.maker == "own" and name in light["on_the_ground"]:
            continue
        solid += line.quantity * line.weight_g
        share = light["printed_share"] if line.maker == "own" and material == "petg" else 1.0
        printed += line.quantity * line.weight_g * share
    return solid, printed


def light_page(found: list[Line], light: Mapping[str, Any], harness_text: str) -> str:
    """Return the page of the light variant."""
    rows = [
        "<!-- made by hw/generate_bom.py from light.toml and the parts list -->",
        "# The light variant, for aircraft below 2.5 kg",
        "",
        "**Never built.** Listen only, as for every first flight"
        " ([relay.md](../relay.md#first-flight-listen-only)).",
        "Weights: parts list, printed parts at half of solid, what stays on the ground left out.",
        "",
        "| leaves | g | instead | what is lost |",
        "| --- | --- | --- | --- |",
    ]
    without: set[str] = set()
    before, stays = flown_g(found, light)[1], found
    total = before
    for leave in light["leave"]:
        without |= set(leave.get("cables", ()))
        stays = lightened(stays, leave, wire_m(harness_text, without))
        after = flown_g(stays, light)[1]
        rows.append(
            f"| {leave['what']} | {before - after:.0f} | {leave['instead']} | {leave['lost']} |"
        )
        before = after
    rows += [
        "",
        f"**{total:.0f} g become {before:.0f} g.** Each tip carries one vane on one boom instead of"
        " two: half of the roll inertia that",
        "they add; a boom at half span has a quarter, at a larger upwash",
        "([install.md](../install.md#where-a-vane-may-stand)).",
        "Swing the aircraft with everything in it all the same.",
        "",
    ]
    return "\n".join(rows)


def totals(found: list[Line]) -> dict[str, tuple[float, float]]:
    """Return price in USD and weight in g of each kit with all kits before it."""
    sums: dict[str, tuple[float, float]] = {}
    price = weight = 0.0
    for kit in KITS:
        price += sum(line.quantity * line.price_usd for line in found if line.kit == kit)
        weight += sum(line.quantity * line.weight_g for line in found if line.kit == kit)
        sums[kit] = (price, weight)
    return sums


def read() -> list[Line]:
    """Return the list of this clone.

    Raises
    ------
    BomError
        See `lines`.
    """
    parts, harness, masses = (
        (HERE / path).read_text(encoding="utf-8")
        for path in ("parts.toml", "harness.toml", "mechanics/generated/masses.csv")
    )
    symbols = {
        board: (HERE / path).read_text(encoding="utf-8") for board, (path, _) in SYMBOLS.items()
    }
    return lines(parts, symbols, harness) + made(masses)


def _toml(name: str) -> dict[str, Any]:
    return tomllib.loads((HERE / name).read_text(encoding="utf-8"))


def text(found: list[Line]) -> str:
    """Return bom.csv."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(line.cells() for line in found)
    return out.getvalue()


def main(arguments: list[str] | None = None) -> int:
    """Write or check; 0 ok, 2 the parts contradict each other, 6 bom.csv is not current."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--check", action="store_true", help="compare with what is committed")
    check = parser.parse_args(arguments).check
    try:
        found = read()
        harness = (HERE / "harness.toml").read_text(encoding="utf-8")
        made_files = {BOM: text(found), LIGHT: light_page(found, _toml("light.toml"), harness)}
    except BomError as error:
        print(f"hw: {error}", file=sys.stderr)
        return 2
    for path, content in made_files.items():
        if not check:
            path.write_text(content, encoding="utf-8", newline="\n")
        elif not path.exists() or path.read_text(encoding="utf-8") != content:
            name = path.relative_to(HERE)
            print(f"hw/{name} is not current: run python hw/generate_bom.py", file=sys.stderr)
            return 6
    if check:
        return 0
    for kit, (price, weight) in totals(found).items():
        print(f"{kit}: {price:.2f} USD, {weight:.0f} g")
    return 0


if __name__ == "__main__":
    sys.exit(main())
