"""Models where no vane measured an angle: it stays a state, and the accelerometer across tells it.

Where alpha_dot = q + a_z / V, rates and specific force hold the angle but for a constant, and with
it the derivatives (Klein & Morelli, Aircraft System Identification, ch. 10, on kinematics). The
accelerometer's bias is then no parameter of its own: only its sum with the angle's is seen. What
gusts do to the angle is not in it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from host.errors import IdentificationError
from host.sysid.aerodynamics.unmeasured_motion import ACCELEROMETER_OF
from host.sysid.checks.hidden_angles import WORDS
from host.sysid.models.reduced_model import without_outputs
from host.sysid.models.state_space_model import LinearModel


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
        why = f"{wanted} with the airspeed, or a vane, would determine it by this method"
        raise IdentificationError(f"{words} was not measured; {why}")
    across = {ACCELEROMETER_OF[y] for y in hidden}
    reduced = without_outputs(model, hidden)
    reduced = replace(
        reduced, output_biases=tuple(y for y in reduced.output_biases if y not in across)
    )
    return reduced, (
        f"no vane measured {words}: it comes from {', '.join(sorted(across))} and rates, gusts are"
        " in it",
    )
