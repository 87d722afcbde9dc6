"""Outputs of which the user says what they move, as ``--output 2=elevator``.

A word becomes the parameter that the autopilot would have: the log is read as if it said so.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from host.near_names import like
from host.readers.ardupilot_outputs import SURFACE_FUNCTIONS
from host.readers.autopilot_log import AutopilotLog, OutputChoiceError
from host.readers.px4_outputs import TYPES
from host.readers.px4_pulses import FIRST_SERVO, GROUPS
from host.readers.written_parameters import Parameters

OUTPUT = "output "  # of a choice, with the number behind it, among the messages of sensors
OUTPUT_FIELDS = (
    *((name, 1, re.compile(r"C(\d+)")) for name in ("RCOU", "RCO2", "RCO3")),
    ("SERVO_OUTPUT_RAW", 1, re.compile(r"servo(\d+)_raw")),
    ("actuator_servos", 0, re.compile(r"control\[(\d+)\]")),
    ("actuator_outputs", 0, re.compile(r"output\[(\d+)\]")),
)
# Words of both autopilots, and PX4's names where they are others.
WORDS = {
    name.lower().replace("v-tail", "vtail").replace(" ", "-"): function
    for function, name in SURFACE_FUNCTIONS.items()
}
PX4_NAMES = {"aileron": "single-channel aileron", "flaperon": "aileron", "vtail": "V-tail"}


def with_outputs(log: AutopilotLog, given: Mapping[int, str]) -> AutopilotLog:
    """Return a log whose outputs move what the user says; a minus before the word turns it round.

    Parameters
    ----------
    log : AutopilotLog
    given : mapping of int to str
        Word of `WORDS` by number of the output, from 1: of PX4 that of the servo.

    Raises
    ------
    OutputChoiceError
        If there is no such output, or no such word.
    """
    values: dict[str, float] = {}
    there = _outputs(log) if given else set()
    for number, word in given.items():
        name = word.lower().removeprefix("-")
        sign = -1.0 if word.startswith("-") else 1.0
        if name not in WORDS:
            raise OutputChoiceError(
                f"--output {number}={word}: no surface {name!r}{like(name, WORDS)}; there are"
                f" {', '.join(WORDS)}"
            )
        if number not in there:
            every = ", ".join(map(str, sorted(there))) or "none"
            raise OutputChoiceError(
                f"--output {number}={word}: {log.path} has no pulses of it; it has {every}"
            )
        if log.autopilot == "px4":
            values |= _px4(log, number, name, sign)
        else:
            values[f"SERVO{number}_FUNCTION"] = sign * WORDS[name]
    if not values:
        return log
    known = log.parameters if isinstance(log.parameters, Parameters) else Parameters()
    return replace(log, parameters=known.replaced(values))


def _outputs(log: AutopilotLog) -> set[int]:
    """Return the numbers of the outputs in a log, from 1."""
    found = set()
    for name, counted_from, pattern in OUTPUT_FIELDS:
        for messages in log.messages.get(name, {}).values():
            numbers = [match[1] for field in messages.fields if (match := pattern.fullmatch(field))]
            found |= {int(number) + 1 - counted_from for number in numbers}
    return found


def _px4(log: AutopilotLog, number: int, name: str, sign: float) -> dict[str, float]:
    """Return the type of a servo of PX4's, which has a number from 1, and the pin it hangs on."""
    kind, dash, side = name.partition("-")
    theirs = PX4_NAMES.get(kind, kind)
    theirs = f"{side} {theirs}" if dash else theirs
    types = {own: number for number, own in TYPES.items()}
    if theirs not in types:
        raise OutputChoiceError(
            f"--output {number}={name}: PX4 has no such servo; its motors are read from"
            " actuator_motors"
        )
    found = {f"CA_SV_CS{number - 1}_TYPE": sign * types[theirs]}
    wanted = FIRST_SERVO + number - 1
    pins = [
        v for k, v in log.parameters.items() if k.startswith(tuple(f"{g}_FUNC" for g in GROUPS))
    ]
    if wanted not in pins:
        found[f"{GROUPS[0]}_FUNC{number}"] = float(wanted)
    if "CA_SV_CS_COUNT" in log.parameters:
        found["CA_SV_CS_COUNT"] = max(log.parameters["CA_SV_CS_COUNT"], number)
    return found
