"""Make generated/settings.h, the pilot's defaults and their limits, from settings.toml.

    python firmware/generate_settings.py            # write it
    python firmware/generate_settings.py --check    # prove that what is committed is current

Names and types come from the frames ``config`` and ``input_config`` of protocol/frames.toml. Exit
codes: 0 good, 2 a mistake in settings.toml, 6 the committed header is not current.
"""

import argparse
import re
import sys
import tomllib
from collections.abc import Collection
from pathlib import Path
from typing import TypeAlias, TypeGuard

FIRMWARE = Path(__file__).resolve().parent
SETTINGS = FIRMWARE / "settings.toml"
FRAMES = FIRMWARE.parent / "protocol" / "frames.toml"
HEADER = FIRMWARE / "generated" / "settings.h"
RANGES = {"u8": 0xFF, "u16": 0xFFFF, "u32": 0xFFFFFFFF}
KEYS = {"value", "min", "max", "any_of", "why"}
INPUTS = ("input_aileron", "input_elevator", "input_rudder", "input_throttle", "input_switch")
# Between the switch's positions, so that a pulse that trembles at one limit is not at the other.
LEAST_SWITCH_GAP_US = 100
STRUCTS = {"config": "ConfigFrame", "input_config": "InputConfigFrame"}
NAME = re.compile(r"[A-Za-z0-9_.-]+")  # goes into a C++ literal and names a file of the host

Setting: TypeAlias = "dict[str, int | str | list[int]]"


class SettingsError(Exception):
    """A mistake in settings.toml, in one line."""


def config_fields(
    frames_path: Path = FRAMES, frames: Collection[str] = tuple(STRUCTS)
) -> dict[str, str]:
    """Return name and type of every setting: the frames' fields behind ``t_us``.

    Parameters
    ----------
    frames_path : Path
        The schema.
    frames : collection of str
        Of `STRUCTS`.

    Returns
    -------
    dict[str, str]
        Type by name, in wire order.
    """
    schema = tomllib.loads(frames_path.read_text(encoding="utf-8"))
    fields = [f for frame in schema["frame"] if frame["name"] in frames for f in frame["field"]]
    return {f["name"]: f["type"] for f in fields if f["name"] != "t_us"}


def checked(settings: dict[str, Setting], fields: dict[str, str]) -> dict[str, Setting]:
    """Return the settings in wire order.

    Parameters
    ----------
    settings : dict[str, Setting]
        Tables of settings.toml.
    fields : dict[str, str]
        Type by name, as `config_fields` returns it.

    Returns
    -------
    dict[str, Setting]
        The same tables, ordered as on the wire.

    Raises
    ------
    SettingsError
        A name too many or missing, a key that is not known, a value outside its limits or its type,
        values that are good by themselves but not together.
    """
    if set(settings) != set(fields):
        odd = ", ".join(sorted(set(settings) ^ set(fields)))
        raise SettingsError(f"names differ from frames config and input_config: {odd}")
    for name, kind in fields.items():
        setting = settings[name]
        if not isinstance(setting, dict):
            raise SettingsError(
                f"{name} is {setting!r}, expected a table [{name}] with value and why"
            )
        if odd_keys := set(setting) - KEYS:
            raise SettingsError(f"[{name}] has the unknown key {min(odd_keys)}")
        if not setting.get("why"):
            raise SettingsError(f"[{name}] does not say why")
        _check_value(name, kind, setting)
    _check_together(settings)
    return {name: settings[name] for name in fields}


def _check_value(name: str, kind: str, setting: Setting) -> None:
    value = setting.get("value")
    if kind.startswith("char["):
        room = int(kind[5:-1])
        if not (isinstance(value, str) and NAME.fullmatch(value) and len(value) < room):
            raise SettingsError(
                f"[{name}] value is {value!r}, expected 1 to {room - 1} of letters, digits, _ . -"
            )
        return
    allowed = _allowed(name, setting)
    if not _whole(value) or value not in allowed:
        raise SettingsError(f"[{name}] value is {value!r}, expected one of {_text(allowed)}")
    if min(allowed) < 0 or max(allowed) > RANGES[kind]:
        raise SettingsError(f"[{name}] limits do not fit {kind}: {_text(allowed)}")


def _check_together(settings: dict[str, Setting]) -> None:
    """Hold the defaults to what core/settings.cpp asks of a record in EEPROM."""
    users: dict[object, str] = {}
    for name in INPUTS:
        value = settings[name]["value"]
        if value in users:
            raise SettingsError(f"[{name}] value is {value}, which [{users[value]}] has already")
        users[value] = name
    low, high = (settings[name]["value"] for name in ("switch_direct_max_us", "switch_mega_min_us"))
    if isinstance(low, int) and isinstance(high, int) and high - low < LEAST_SWITCH_GAP_US:
        raise SettingsError(
            f"[switch_mega_min_us] value is {high}, expected at least {low + LEAST_SWITCH_GAP_US}: "
            f"{LEAST_SWITCH_GAP_US} above [switch_direct_max_us]"
        )
    armed = settings["switch_armed_min_us"]["value"]
    least = high + 2 * LEAST_SWITCH_GAP_US if isinstance(high, int) else 0
    if isinstance(armed, int) and armed != 0 and armed < least:
        raise SettingsError(
            f"[switch_armed_min_us] value is {armed}, expected 0 or at least {least}: Mega's place"
            f" is {LEAST_SWITCH_GAP_US} us wide or more and ends {LEAST_SWITCH_GAP_US} us below"
        )


def _whole(value: object) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)


def _allowed(name: str, setting: Setting) -> range | list[int]:
    any_of = setting.get("any_of")
    if isinstance(any_of, list) and any_of and all(map(_whole, any_of)):
        return any_of
    low, high = setting.get("min"), setting.get("max")
    if any_of is None and _whole(low) and _whole(high) and low <= high:
        return range(low, high + 1)
    raise SettingsError(f"[{name}] needs min and max, or any_of, in whole numbers")


def _text(allowed: range | list[int]) -> str:
    if isinstance(allowed, range):
        return f"{allowed[0]} to {allowed[-1]}"
    return ", ".join(map(str, allowed))


def _condition(name: str, setting: Setting) -> str:
    allowed = _allowed(name, setting)
    if isinstance(allowed, range):
        low = [f"config.{name} >= {allowed[0]}U"] if allowed[0] > 0 else []
        return " && ".join([*low, f"config.{name} <= {allowed[-1]}U"])
    return "(" + " || ".join(f"config.{name} == {value}U" for value in allowed) + ")"


def render(settings: dict[str, Setting], fields: dict[str, str]) -> str:
    """Return the text of generated/settings.h.

    Parameters
    ----------
    settings : dict[str, Setting]
        As `checked` returns it.
    fields : dict[str, str]
        Type by name.

    Returns
    -------
    str
        C++14 with a function for the defaults and one for the limits.
    """
    functions: list[str] = []
    for frame, struct in STRUCTS.items():
        inside = config_fields(frames=(frame,))
        functions += _functions(struct, {name: fields[name] for name in inside}, settings)
    return "\n".join(
        [
            "// Generated by firmware/generate_settings.py from firmware/settings.toml.",
            "// clang-format off",
            "#pragma once",
            "",
            '#include "core/progmem.h"',
            '#include "generated/frames.h"',
            "",
            "namespace settings {",
            "",
            "// switch_mega_min_us is at least this much above switch_direct_max_us.",
            f"constexpr uint16_t kLeastSwitchGapUs = {LEAST_SWITCH_GAP_US};",
            "",
            *functions,
            "}  // namespace settings",
            "",
        ]
    )


def _functions(struct: str, fields: dict[str, str], settings: dict[str, Setting]) -> list[str]:
    """Return the lines of put_defaults and in_range for one frame."""
    assign = []
    conditions = []
    for name, kind in fields.items():
        value = settings[name]["value"]
        if kind.startswith("char["):
            letters = ", ".join(f"'{letter}'" for letter in str(value))
            assign.append(f"  static constexpr char {name}[] CORE_FLASH = {{{letters}}};")
            assign.append(f"  core::flash_copy(config.{name}, {name}, sizeof({name}));")
        else:
            assign.append(f"  config.{name} = {value}U;")
            conditions.append(_condition(name, settings[name]))
    return [
        f"inline void put_defaults(frames::{struct}& config) {{",
        f"  config = frames::{struct}();",
        *assign,
        "}",
        "",
        "// Each value by itself.",
        f"inline bool in_range(const frames::{struct}& config) {{",
        "  return " + " &&\n         ".join(conditions) + ";",
        "}",
        "",
    ]


def main(arguments: list[str] | None = None) -> int:
    """Write or check the header.

    Parameters
    ----------
    arguments : list[str] or None
        Command line without the program's name; None takes the real one.

    Returns
    -------
    int
        Exit code.
    """
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="compare with what is committed")
    check = parser.parse_args(arguments).check
    try:
        fields = config_fields()
        settings = checked(tomllib.loads(SETTINGS.read_text(encoding="utf-8")), fields)
    except (SettingsError, tomllib.TOMLDecodeError, UnicodeDecodeError, OSError) as error:
        print(f"firmware/settings.toml: {error}", file=sys.stderr)
        return 2
    text = render(settings, fields)
    if not check:
        HEADER.parent.mkdir(exist_ok=True)
        HEADER.write_text(text, encoding="utf-8")
        return 0
    if not HEADER.is_file() or HEADER.read_text(encoding="utf-8") != text:
        print(
            "firmware/generated/settings.h is old: run python firmware/generate_settings.py",
            file=sys.stderr,
        )
        return 6
    return 0


if __name__ == "__main__":
    sys.exit(main())
