"""Models where no vane measured an angle: it stays a state, and the accelerometer across tells it.

Where alpha_dot = q + a_z / V, rates and specific force hold the angle but for a constant, and with
it the derivatives (Klein & Morelli, Aircraft System Identification, ch. 10, on kinematics). The
accelerometer's bias is then no parameter beside the angle's: only their sum is seen. What gusts do
to the angle is not in it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from host.errors import IdentificationError
from host.sysid.aerodynamics.unmeasured_motion import ACCELEROMETER_OF
from host.sysid.checks.data_finding import Finding
from host.sysid.models.state_space_model import LinearModel, without_outputs

WORDS = {"alpha_rad": "the angle of attack", "beta_rad": "the sideslip"}


def without_vanes(
    model: LinearModel, columns: Collection[str]
) -> tuple[LinearModel, tuple[str, ...]]:
    """Return a template without the angles that nobody measured, and a remark.

    Raises
    ------
    IdentificationError
        If it cannot do without.
    """
    hidden = [y for y in model.outputs if y in ACCELEROMETER_OF and y not in columns]
    if not hidden:
        return model, ()
    words = " and ".join(WORDS[y] for y in hidden)
    able = [y for y in hidden if ACCELEROMETER_OF[y] in model.outputs]
    if able != hidden:
        wanted = " and ".join(ACCELEROMETER_OF[y] for y in hidden)
        why = f"{wanted} beside the airspeed, or a vane, would tell it by this method"
        raise IdentificationError(f"{words} was not measured; {why}")
    across = {ACCELEROMETER_OF[y] for y in hidden}
    reduced = without_outputs(model, hidden)
    reduced = replace(
        reduced, output_biases=tuple(y for y in reduced.output_biases if y not in across)
    )
    return reduced, (
        f"no vane measured {words}: it is told by {', '.join(sorted(across))} and rates, gusts are"
        " in it",
    )


def no_instrument_errors_finding(columns: Collection[str]) -> Finding:
    """Return the finding that intervals of a flight count no error of the instrument: nothing of
    it comes under "trust"."""
    names = ("p_radps", "q_radps", "r_radps", "elevator_rad", "aileron_rad", "rudder_rad")
    return Finding(
        "instrument-errors",
        tuple(name for name in names if name in columns),
        "without vanes the flight path is not reconstructed, and what sensors and servos may be"
        " wrong by is in no interval",
        ("a log without GPS velocity or airspeed", "too short a flight"),
        done="intervals count noise, gusts and the model's lack only",
    )


def no_vanes_finding(columns: Collection[str], *, reconstructed: bool = False) -> list[Finding]:
    """Return a finding where no vane measured an angle that accelerometers observe: nothing of it
    comes under "trust", except where the path is reconstructed, its errors in every interval."""
    missing = tuple(y for y, by in ACCELEROMETER_OF.items() if y not in columns and by in columns)
    if not missing or "airspeed_mps" not in columns:
        return []
    return [
        Finding(
            "flow-angles",
            () if reconstructed else missing,
            f"no vane measured {' and '.join(WORDS[y] for y in missing)}",
            ("an aircraft without vanes", "a column under another name"),
            done="told by rates and accelerations where that can be, else refused"
            + ("; errors of IMU, places and servos are in the intervals" if reconstructed else ""),
        )
    ]
