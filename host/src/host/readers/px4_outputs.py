"""PX4's outputs as surfaces, by control allocation's own description of each.

Positive is trailing edge up, of a rudder right, of a V-tail's surface up (PX4 guide, "Control
Surface Deflection Convention"); flaps down. Before control allocation (v1.13) the mixer is not in
the log: there, and where servos are logged too slowly, the demand of the axes counts, positive
roll right, nose up, nose right.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from host.arrays import Array
from host.readers.ardupilot_outputs import Outputs
from host.readers.px4_pulses import GROUPS, controls_of_pulses

TYPES = {
    1: "left aileron", 2: "right aileron", 3: "elevator", 4: "rudder", 5: "left elevon",
    6: "right elevon", 7: "left V-tail", 8: "right V-tail", 9: "left flap", 10: "right flap",
    13: "left A-tail", 14: "right A-tail", 15: "single-channel aileron",
}  # fmt: skip
MOST_SURFACES = 8


def allocated_surfaces(controls: Mapping[int, Array], parameters: Mapping[str, float]) -> Outputs:
    """Return surfaces from `actuator_servos`, control k of which is surface k.

    Parameters
    ----------
    controls : mapping of int to (n,) array
        -1 to 1 by number of the surface, from 0.
    parameters : mapping of str to float
        CA_SV_CSn_TYPE among them.
    """
    by_type: dict[str, list[Array]] = {}
    count = int(parameters.get("CA_SV_CS_COUNT", MOST_SURFACES))
    for k in range(min(count, MOST_SURFACES)):
        signed = int(parameters.get(f"CA_SV_CS{k}_TYPE", 0))  # negative: the user turns it round
        kind = TYPES.get(abs(signed))
        if kind and k in controls:
            by_type.setdefault(kind, []).append(controls[k] if signed > 0 else -controls[k])
    value = {kind: np.mean(every, axis=0) for kind, every in by_type.items()}
    shares: dict[str, Array] = {}
    made_of: dict[str, str] = {}
    clipped: dict[str, int] = {}

    def put(name: str, values: Array, *kinds: str) -> None:
        if name not in shares:
            shares[name] = values
            made_of[name] = " and ".join(kinds)
            clipped[name] = max(int(np.sum(np.abs(value[k]) >= 1.0)) for k in kinds)

    def both(left: str, right: str) -> bool:
        return {left, right} <= value.keys()

    if "elevator" in value:
        put("elevator", -value["elevator"], "elevator")
    if "rudder" in value:
        put("rudder", -value["rudder"], "rudder")
    if both("left aileron", "right aileron"):
        down = -0.5 * (value["left aileron"] - value["right aileron"])
        put("aileron", down, "left aileron", "right aileron")
    if "single-channel aileron" in value:
        put("aileron", value["single-channel aileron"], "single-channel aileron")
    for single, sign in (("left aileron", -1.0), ("right aileron", 1.0)):
        if single in value:
            put("aileron", sign * value[single], single)
    for tail, sign in (("V-tail", 1.0), ("A-tail", -1.0)):
        left, right = f"left {tail}", f"right {tail}"
        if both(left, right):
            put("elevator", -0.5 * (value[left] + value[right]), left, right)
            put("rudder", -0.5 * sign * (value[left] - value[right]), left, right)
    if both("left elevon", "right elevon"):
        left, right = "left elevon", "right elevon"
        put("elevator", -0.5 * (value[left] + value[right]), left, right)
        put("aileron", -0.5 * (value[left] - value[right]), left, right)
    if both("left flap", "right flap"):
        put("flap", 0.5 * (value["left flap"] + value["right flap"]), "left flap", "right flap")
    return Outputs(shares, made_of, clipped)


def surfaces_of_pulses(pulses_us: Mapping[int, Array], parameters: Mapping[str, float]) -> Outputs:
    """Return surfaces from the pulses of the pins, by the first group of pins that explains them.

    Parameters
    ----------
    pulses_us : mapping of int to (n,) array
        By pin, from 1.
    parameters : mapping of str to float
        PWM_MAIN_ or PWM_AUX_, and CA_SV_CSn_TYPE, among them.
    """
    for group in GROUPS:
        controls = controls_of_pulses(pulses_us, parameters, group)
        out = allocated_surfaces(controls, parameters)
        if out.shares:
            made_of = {name: f"{how} by {group}" for name, how in out.made_of.items()}
            return Outputs(out.shares, made_of, out.clipped)
    return Outputs({}, {}, {})


def axis_demands(asked: Sequence[Array], of: str) -> Outputs:
    """Return surfaces as roll, pitch and yaw were asked for, before any mixer."""
    roll, pitch, yaw = asked
    shares = {"aileron": roll, "elevator": -pitch, "rudder": -yaw}
    moved = {name: v for name, v in shares.items() if np.any(v[np.isfinite(v)] != 0.0)}
    axis = {"aileron": "roll", "elevator": "pitch", "rudder": "yaw"}
    return Outputs(
        moved,
        {name: f"{of} {axis[name]} demand (its mixer is not in it)" for name in moved},
        {name: int(np.sum(np.abs(v) >= 1.0)) for name, v in moved.items()},
    )
