"""ArduPilot's servo outputs as surfaces, by the log's own SERVOn_ parameters.

A function's demand is positive for roll right, nose up, nose right; its pulse is TRIM plus its
share of the way to MAX, or MIN, REVERSED turning it (libraries/SRV_Channel). Mixers, ArduPlane
servos.cpp: elevon left = elevator - aileron, right = elevator + aileron; V-tail left = elevator +
rudder, right = elevator - rudder; flaperon left = aileron + flap, right = aileron - flap.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from host.arrays import Array

AILERON, ELEVATOR, RUDDER, THROTTLE = 4, 19, 21, 70
FLAPERON_LEFT, FLAPERON_RIGHT = 24, 25
THROTTLE_LEFT, THROTTLE_RIGHT = 73, 74
ELEVON_LEFT, ELEVON_RIGHT, VTAIL_LEFT, VTAIL_RIGHT = 77, 78, 79, 80
SURFACES = {"elevator", "aileron", "rudder"}
PASSED = 1  # RCPassThru
RECEIVED = (*range(51, 67), *range(140, 156))  # RCIN1 to 16, and scaled
DEFAULTS = {"MIN": 1100.0, "MAX": 1900.0, "TRIM": 1500.0, "REVERSED": 0.0}
SURFACE_FUNCTIONS = {
    AILERON: "aileron", ELEVATOR: "elevator", RUDDER: "rudder", THROTTLE: "throttle",
    FLAPERON_LEFT: "flaperon left", FLAPERON_RIGHT: "flaperon right",
    THROTTLE_LEFT: "throttle left", THROTTLE_RIGHT: "throttle right",
    ELEVON_LEFT: "elevon left", ELEVON_RIGHT: "elevon right",
    VTAIL_LEFT: "V-tail left", VTAIL_RIGHT: "V-tail right",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Outputs:
    """Surfaces as shares of their full travel, in our signs, with the outputs behind each.

    `shares` has ``elevator``, ``aileron``, ``rudder`` (-1 to 1), ``throttle`` (0 to 1) and what
    else moves; `made_of` the outputs behind each; `clipped` at how many samples one stood at the
    end of its travel.
    """

    shares: dict[str, Array]
    made_of: dict[str, str]
    clipped: dict[str, int]


def moves_a_surface(number: int, parameters: Mapping[str, float]) -> bool:
    """Return whether an output, counted from 1, moves a surface or a motor."""
    return abs(_function(number, parameters)) in SURFACE_FUNCTIONS


def unknown_outputs(numbers: Iterable[int], parameters: Mapping[str, float]) -> str:
    """Return what the parameters say of outputs that move no surface, in words.

    Passed through from the receiver, or set up in the receiver's way, as before release 3.9.
    """
    if not any(re.fullmatch(r"(SERVO|RC)\d+_.*", name) for name in parameters):
        return "no SERVOn_FUNCTION in the log"
    said = []
    for number in sorted(numbers):
        function = _function(number, parameters)
        if function == PASSED:
            said.append(f"SERVO{number}_FUNCTION = {PASSED} (RCPassThru)")
        elif function in RECEIVED:
            said.append(
                f"SERVO{number}_FUNCTION = {function} (RCIN{RECEIVED.index(function) % 16 + 1})"
            )
        elif _own(number, "FUNCTION", parameters) is None and f"RC{number}_MIN" in parameters:
            said.append(f"no SERVO{number}_FUNCTION (an old release: RC{number}_)")
    return ", ".join(said) or "no SERVOn_FUNCTION names a surface"


def _own(number: int, key: str, parameters: Mapping[str, float]) -> float | None:
    """Return a parameter of an output: before release 3.9 it was that of the receiver's channel."""
    found = parameters.get(f"SERVO{number}_{key}")
    return parameters.get(f"RC{number}_{key}") if found is None else found


def _function(number: int, parameters: Mapping[str, float]) -> int:
    """Return what an output moves; negative where the user says that it is turned round."""
    return int(_own(number, "FUNCTION", parameters) or 0.0)


def surfaces(pulses_us: Mapping[int, Array], parameters: Mapping[str, float]) -> Outputs:
    """Return the surfaces behind the outputs.

    Parameters
    ----------
    pulses_us : mapping of int to (n,) array
        Pulse of each output, counted from 1; 0 is no pulse.
    parameters : mapping of str to float
        Parameters in the log.
    """
    demands: dict[int, list[Array]] = {}
    pins: dict[int, list[int]] = {}
    clipped: dict[int, int] = {}
    for number, pulse in sorted(pulses_us.items()):
        signed = _function(number, parameters)
        function = abs(signed)
        if function not in SURFACE_FUNCTIONS:
            continue
        ranged = function in (THROTTLE, THROTTLE_LEFT, THROTTLE_RIGHT)
        demand, ends = _demand(pulse, number, parameters, ranged=ranged)
        demands.setdefault(function, []).append(demand if signed > 0 else -demand)
        pins.setdefault(function, []).append(number)
        clipped[function] = clipped.get(function, 0) + ends
    return _combined(
        {f: np.mean(every, axis=0) for f, every in demands.items()},
        {f: ", ".join(f"SERVO{n} {SURFACE_FUNCTIONS[f]}" for n in ns) for f, ns in pins.items()},
        clipped,
    )


def _demand(
    pulse: Array, number: int, parameters: Mapping[str, float], *, ranged: bool
) -> tuple[Array, int]:
    """Return the demand of a servo function as a share, and how many samples stood at an end."""
    own = {key: _own(number, key, parameters) for key in DEFAULTS}
    low, high, trim, turned = (
        DEFAULTS[key] if value is None else value for key, value in own.items()
    )
    turned = turned or parameters.get(f"RC{number}_REV", 1.0) < 0.0  # before release 3.9
    width = np.where(pulse > 0.0, pulse, np.nan)
    ends = int(np.sum((width <= low) | (width >= high)))
    if high <= low:
        return np.full(len(width), np.nan), 0
    if ranged:
        share = (width - low) / (high - low)
        return (1.0 - share if turned else share), 0
    if not low < trim < high:  # as ArduPilot takes a trim outside its range
        trim = 0.5 * (low + high)
    share = np.where(width > trim, (width - trim) / (high - trim), (width - trim) / (trim - low))
    return (-share if turned else share), ends


def _combined(
    demand: Mapping[int, Array], made: Mapping[int, str], clipped: Mapping[int, int]
) -> Outputs:
    """Return surfaces, trailing edge down and left positive, from demands by function."""
    shares: dict[str, Array] = {}
    made_of: dict[str, str] = {}
    ends: dict[str, int] = {}

    def put(name: str, values: Array, *functions: int) -> None:
        if name not in shares:
            shares[name] = values
            made_of[name] = " and ".join(made[f] for f in functions)
            ends[name] = max(clipped.get(f, 0) for f in functions)

    if ELEVATOR in demand:
        put("elevator", -demand[ELEVATOR], ELEVATOR)
    if AILERON in demand:
        put("aileron", demand[AILERON], AILERON)
    if RUDDER in demand:
        put("rudder", -demand[RUDDER], RUDDER)
    if {ELEVON_LEFT, ELEVON_RIGHT} <= demand.keys():
        left, right = -demand[ELEVON_LEFT], -demand[ELEVON_RIGHT]  # trailing edge down
        put("elevator", 0.5 * (left + right), ELEVON_LEFT, ELEVON_RIGHT)
        put("aileron", 0.5 * (left - right), ELEVON_LEFT, ELEVON_RIGHT)
    if {VTAIL_LEFT, VTAIL_RIGHT} <= demand.keys():
        left, right = -demand[VTAIL_LEFT], -demand[VTAIL_RIGHT]
        put("elevator", 0.5 * (left + right), VTAIL_LEFT, VTAIL_RIGHT)
        # Nose right lifts the left one's edge: left minus right down is trailing edges left.
        put("rudder", 0.5 * (left - right), VTAIL_LEFT, VTAIL_RIGHT)
    if {FLAPERON_LEFT, FLAPERON_RIGHT} <= demand.keys():
        left, right = demand[FLAPERON_LEFT], -demand[FLAPERON_RIGHT]  # trailing edge down
        put("aileron", 0.5 * (left - right), FLAPERON_LEFT, FLAPERON_RIGHT)
        put("flap", 0.5 * (left + right), FLAPERON_LEFT, FLAPERON_RIGHT)
    if {THROTTLE_LEFT, THROTTLE_RIGHT} <= demand.keys():
        left, right = demand[THROTTLE_LEFT], demand[THROTTLE_RIGHT]
        put("throttle", 0.5 * (left + right), THROTTLE_LEFT, THROTTLE_RIGHT)
        put("throttle_difference", left - right, THROTTLE_LEFT, THROTTLE_RIGHT)
    if THROTTLE in demand:
        put("throttle", demand[THROTTLE], THROTTLE)
    return Outputs(shares, made_of, ends)
