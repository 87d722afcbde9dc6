"""Make pin header and wiring table from pin_map.toml; `--check` proves they are current."""

from __future__ import annotations

import argparse
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
PINS_H = ROOT / "firmware" / "boards" / "mega2560" / "generated" / "pins.h"
WIRING_MD = HERE / "generated" / "WIRING.md"
FIRST_LINE = "made by hw/generate.py from hw/pin_map.toml and protocol/frames.toml; do not edit"

PINS: dict[str, list[str]] = {
    pin: text.split()
    for pin, text in tomllib.loads((HERE / "board_mega2560.toml").read_text())["pin"].items()
}

SLOT_US = 104  # 13 ADC clocks at 125 kHz
ROUNDS = 4
SAMPLE_HOLD_US = 12  # 1.5 ADC clocks


class PinMapError(Exception):
    """The map contradicts itself, the board or the frames."""


@dataclass(frozen=True, slots=True)
class Signal:
    """One line of the harness."""

    name: str
    pin: str
    function: str
    net: str
    level: str
    why: str
    idle: str = ""

    @property
    def port(self) -> str:
        """Letter of the chip's port."""
        return PINS[self.pin][0][1]

    @property
    def bit(self) -> int:
        """Bit in that port."""
        return int(PINS[self.pin][0][2])


def load_signals(text: str) -> list[Signal]:
    """Read the map and prove that it is free of conflicts.

    Parameters
    ----------
    text
        Content of pin_map.toml.

    Returns
    -------
    list of Signal
        In the order of the file.

    Raises
    ------
    PinMapError
        Two users of a pin or a name, a pin the Mega lacks, a function the pin lacks, a timer that
        is used by a pin but not claimed, the receiver on the card's port.
    """
    table = tomllib.loads(text)
    signals = [Signal(**row) for row in table["signal"]]
    by_pin: dict[str, str] = {}
    names: set[str] = set()
    for signal in signals:
        if signal.pin not in PINS:
            raise PinMapError(f"{signal.name}: the Mega has no pin {signal.pin}")
        if signal.pin in by_pin:
            raise PinMapError(f"pin {signal.pin}: used by {by_pin[signal.pin]} and {signal.name}")
        if signal.name in names:
            raise PinMapError(f"two signals are called {signal.name}")
        functions = PINS[signal.pin][1:]
        if signal.function != "gpio" and signal.function not in functions:
            found = ", ".join(functions) or "none"
            raise PinMapError(
                f"{signal.name}: pin {signal.pin} cannot do {signal.function} (it can do: {found})"
            )
        by_pin[signal.pin] = signal.name
        names.add(signal.name)
    _check_timers(signals, table["timer"])
    card_ports = {s.port for s in signals if s.name.startswith("card_")}
    for signal in signals:
        if signal.name.startswith("rc_") and signal.port in card_ports:
            raise PinMapError(f"{signal.name}: port {signal.port} also carries the card's SPI")
    return signals


def _check_timers(signals: list[Signal], timers: list[dict[str, str]]) -> None:
    seen: dict[str, str] = {}
    for timer in timers:
        if timer["name"] in seen:
            raise PinMapError(
                f"{timer['name']}: claimed for '{seen[timer['name']]}' and '{timer['use']}'"
            )
        seen[timer["name"]] = timer["use"]
    for signal in signals:
        if signal.function.startswith("OC"):
            timer_name = f"timer {signal.function[2]}"
            channel = signal.name.removeprefix("servo_")
            if channel not in seen.get(timer_name, ""):
                raise PinMapError(
                    f"{signal.name}: {signal.function} needs {timer_name},"
                    f" which is claimed for '{seen.get(timer_name, 'nothing')}'"
                )


def analogue_order(frames_text: str, signals: list[Signal]) -> list[tuple[str, int]]:
    """Give the analogue scan in the order of the identification frame, the servo rail last.

    Parameters
    ----------
    frames_text
        Content of protocol/frames.toml.
    signals
        The pin map.

    Returns
    -------
    list of (str, int)
        Field name and ADC channel, slot by slot.

    Raises
    ------
    PinMapError
        A field without a pin, or a sampling delay in frames.toml that this order does not give.
    """
    frames = tomllib.loads(frames_text)
    ident = next(f for f in frames["frame"] if f["name"] == "ident")
    fields = [f for f in ident["field"] if f.get("unit") == "count"]
    channels = {s.name: int(s.function[3:]) for s in signals if s.function.startswith("ADC")}
    slots = len(fields) + 1
    order: list[tuple[str, int]] = []
    for slot, field in enumerate(fields):
        name = field["name"]
        if name not in channels:
            raise PinMapError(f"frame field {name} has no analogue pin")
        mean_us = (ROUNDS - 1) * slots * SLOT_US // 2 + slot * SLOT_US + SAMPLE_HOLD_US
        if field["delay_us"] != -mean_us:
            raise PinMapError(
                f"{name}: frames.toml says delay_us = {field['delay_us']},"
                f" slot {slot} gives {-mean_us}"
            )
        order.append((name, channels[name]))
    return [*order, ("rail", channels["rail"])]


def pins_header(signals: list[Signal], order: list[tuple[str, int]]) -> str:
    """Write the C++ header."""
    lines = [
        f"// {FIRST_LINE}",
        "#pragma once",
        "",
        "#include <avr/io.h>",
        "#include <stdint.h>",
        "",
        "namespace pins {",
        "",
        "// One line: its registers and its bit. Calls fold into sbi, cbi, sbis on ports A to G;",
        "// ports H to L lie beyond those instructions and want interrupts off around a write.",
    ]
    for signal in signals:
        camel = "".join(part.capitalize() for part in signal.name.split("_"))
        lines += [
            f"struct {camel} {{  // pin {signal.pin}, {signal.net}",
            f"  static constexpr uint8_t kBit = {signal.bit};",
            f"  static constexpr uint8_t kMask = uint8_t(1U << {signal.bit});",
            f"  static volatile uint8_t& port() {{ return PORT{signal.port}; }}",
            f"  static volatile uint8_t& direction() {{ return DDR{signal.port}; }}",
            f"  static volatile uint8_t& input() {{ return PIN{signal.port}; }}",
            "};",
        ]
    lines += [
        "",
        "// ADC channel of each slot of the scan: as in the identification frame, the rail last.",
        f"constexpr uint8_t kAnalogSlots = {len(order)};",
        f"constexpr uint8_t kAnalogRounds = {ROUNDS};",
        "constexpr uint8_t kAnalogChannel[kAnalogSlots] = {"
        + ", ".join(str(channel) for _, channel in order)
        + "};",
        "",
        "}  // namespace pins",
        "",
    ]
    return "\n".join(lines)


def wiring_table(signals: list[Signal], text: str, order: list[tuple[str, int]]) -> str:
    """Write the table a person wires from."""
    slots = {name: slot for slot, (name, _) in enumerate(order)}
    lines = [
        f"<!-- {FIRST_LINE} -->",
        "# Wiring of the Mega",
        "",
        "| pin | chip | signal | goes to | level | why there |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for signal in signals:
        chip = PINS[signal.pin][0] + ("" if signal.function == "gpio" else f" {signal.function}")
        idle = f"; idle: {signal.idle}" if signal.idle else ""
        slot = f" (scan slot {slots[signal.name]})" if signal.name in slots else ""
        lines.append(
            f"| {signal.pin} | {chip} | {signal.name}{slot} | {signal.net} "
            f"| {signal.level}{idle} | {signal.why} |"
        )
    lines += ["", "| timer | use |", "| --- | --- |"]
    lines += [f"| {t['name']} | {t['use']} |" for t in tomllib.loads(text)["timer"]]
    return "\n".join(lines) + "\n"


def outputs() -> dict[Path, str]:
    """Make every generated text.

    Returns
    -------
    dict
        Path -> content.

    Raises
    ------
    PinMapError
        See `load_signals` and `analogue_order`.
    """
    text = (HERE / "pin_map.toml").read_text()
    signals = load_signals(text)
    order = analogue_order((ROOT / "protocol" / "frames.toml").read_text(), signals)
    return {PINS_H: pins_header(signals, order), WIRING_MD: wiring_table(signals, text, order)}


def main(arguments: list[str] | None = None) -> int:
    """Write or check the generated files; 0 ok, 2 the map is wrong, 6 a file is not current."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="compare with what is committed")
    check = parser.parse_args(arguments).check
    try:
        made = outputs()
    except PinMapError as error:
        print(f"hw/pin_map.toml: {error}", file=sys.stderr)
        return 2
    for path, content in made.items():
        shown = path.relative_to(ROOT)
        if check:
            if not path.exists() or path.read_text() != content:
                print(f"{shown} is not current: run python hw/generate.py", file=sys.stderr)
                return 6
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content)
            print(f"wrote {shown}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
