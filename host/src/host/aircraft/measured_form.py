"""The form of a measured aircraft: what is asked, what is computed, and the file it becomes."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from host.aircraft.file import AircraftError

FORM = Path(__file__).with_name("measured_form.txt")
_OPEN = re.compile(r"^(?P<key>\w+) = \?(?P<optional>-?)\s*# (?P<question>.*)$")
_COMPUTED = re.compile(r" \[.*\]$")
_TEXTS = ("name", "title", "source")
_NUMBERS = 3  # of a place
# What stays out together with a key that may stay out.
_WITH = {"ground_pitch_rad": ("ground_pitch_tolerance_rad",)}


@dataclass(frozen=True, slots=True)
class Question:
    """One open line of the form."""

    key: str
    text: str
    optional: bool


def questions() -> Iterator[Question]:
    """Yield the open lines in their order."""
    for line in FORM.read_text(encoding="utf-8").split("\n"):
        found = _OPEN.match(line)
        if found:
            yield Question(found["key"], found["question"], bool(found["optional"]))


def computed(key: str, given: Mapping[str, str]) -> str | None:
    """Return what follows from earlier answers; None where nothing does."""
    if key == "chord_m" and {"wing_area_m2", "span_m"} <= given.keys():
        span = _number("span_m", given["span_m"])
        if span > 0.0:
            return f"{_number('wing_area_m2', given['wing_area_m2']) / span:.4g}"
    left = {"vane_b_m": "vane_a_m", "pitot_b_m": "pitot_a_m"}.get(key)
    if left in given:
        forward, right, down = _place(str(left), given[str(left)])
        return f"{forward:g}, {-right:g}, {down:g}"
    return None


def filled_form(given: Mapping[str, str]) -> str:
    """Write the file of these answers; a key without one is computed or left out.

    Parameters
    ----------
    given : mapping
        Answers as typed, by key: a number, three numbers of a place, a text.

    Raises
    ------
    AircraftError
        An answer is no number or place, a key is not in the form, or one is missing.
    """
    asked = {question.key: question for question in questions()}
    strange = sorted(given.keys() - asked.keys())
    if strange:
        raise AircraftError(f"{strange[0]}: not asked for; there are {', '.join(asked)}")
    answers = dict(given)
    lines, dropped = [], set[str]()
    for line in FORM.read_text(encoding="utf-8").split("\n")[1:]:
        found = _OPEN.match(line)
        if not found:
            if line.partition(" ")[0] not in dropped:
                lines.append(line)
            continue
        key = found["key"]
        value = answers.get(key) or computed(key, answers)
        if value is None and found["optional"]:
            dropped |= {key, *_WITH.get(key, ())}
            continue
        if value is None:
            raise AircraftError(f"{key} is missing: {_COMPUTED.sub('', found['question'])}")
        answers[key] = value
        said = _COMPUTED.sub("", found["question"])
        lines.append(f"{f'{key} = {_toml(key, value)}':<28} # {said}")
    return "\n".join(lines)


def _toml(key: str, value: str) -> str:
    if key in _TEXTS:
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{escaped}"'
    if _is_place(key):
        return "[" + ", ".join(repr(number) for number in _place(key, value)) + "]"
    return repr(_number(key, value))


def _is_place(key: str) -> bool:
    return key.startswith(("imu_", "vane_a", "vane_b", "pitot_", "gps_"))


def _number(key: str, value: str) -> float:
    try:
        return float(value)
    except ValueError:
        raise AircraftError(f"{key} is {value!r}, expected a number") from None


def _place(key: str, value: str) -> tuple[float, ...]:
    parts = [part for part in re.split(r"[,\s]+", value.strip(" []")) if part]
    if len(parts) != _NUMBERS:
        raise AircraftError(f"{key} has {len(parts)} numbers, expected 3: forward, right, down")
    return tuple(_number(key, part) for part in parts)


Ask = Callable[[str], str]


def ask_for(missing: Iterator[Question], given: dict[str, str], ask: Ask) -> None:
    """Ask what has no answer; an empty line takes what is computed, or leaves it out."""
    for question in missing:
        if question.key in given:
            continue
        proposed = computed(question.key, given)
        hint = f" [{proposed}]" if proposed else " [Enter: none]" if question.optional else ""
        said = _COMPUTED.sub("", question.text)
        answer = ask(f"{question.key}: {said}{hint}? ").strip() or (proposed or "")
        if answer:
            given[question.key] = answer
