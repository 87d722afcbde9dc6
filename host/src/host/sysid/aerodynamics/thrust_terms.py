"""Thrust that was measured and changed: a force added to the linear model, caused by no state.

Without it a step of thrust passes for what airspeed and gusts do: M_alpha of an airliner in calm
air whose thrust steps by a quarter is -1.5 +- 7.5, truth -5.8. How much it pulls is known over the
mass of an aircraft file, and estimated without. By how much it lifts and pitches (its line of
action, the slipstream) nobody knows: that is estimated along. Where it turns with the aircraft its
mean counts, which is in Z_alpha.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from host.constants import GRAVITY_MPS2
from host.sysid.aerodynamics.left_out_terms import LeftOutTerm, acting_terms, expected_left_out
from host.sysid.aerodynamics.measured_thrust import EFFICIENCY_SHARE
from host.sysid.models.state_space_model import LinearModel, Parameter
from host.sysid.models.thrust_column import THRUST

if TYPE_CHECKING:
    from host.aircraft.mass_properties import AirframeData
    from host.arrays import Array
    from host.sysid.models.maneuver import Maneuver
    from host.sysid.models.templates import Trim

THRUST_ROWS = {"airspeed_mps": "D_thrust", "alpha_rad": "Z_thrust", "q_radps": "M_thrust"}
# Least change of thrust, as a share of it, rms: a smaller one moves a model by less than its noise
# does.
LEAST_SHARE = 0.03
THRUST_AS_INPUT = "measured thrust changed and is an input of its own: D_V is at constant thrust"
NORMAL_SHARE = 0.2  # of thrust that acts normal to the path, one deviation
TRIMMED_RAD = 0.2  # of elevator that holds the moment of thrust, one deviation


def thrust_terms(
    model: LinearModel,
    cuts: Sequence[Mapping[str, Array]],
    trim: Trim,
    airframe: AirframeData | None,
) -> tuple[LeftOutTerm, ...]:
    """Return the terms of thrust for a model; none where it is not known, or follows airspeed.

    Thrust of a propeller that is left alone falls with airspeed: that is in D_V as ever.

    Parameters
    ----------
    model : LinearModel
    cuts : sequence of mapping
        All columns of each maneuver.
    trim : Trim
    airframe : AirframeData or None
        Gives the mass.
    """
    rows = [s for s in model.states if s in THRUST_ROWS]
    if not rows or not all(THRUST in c and "airspeed_mps" in c for c in cuts) or not trim.known:
        return ()
    usual_n = float(np.sqrt(np.mean(np.concatenate([c[THRUST] for c in cuts]) ** 2)))
    if _without_airspeed_n(cuts) <= LEAST_SHARE * usual_n:
        return ()
    known = airframe is not None
    pull = usual_n / airframe.mass_kg if airframe is not None else GRAVITY_MPS2
    lift = pull / trim.airspeed_mps
    along, down = float(np.cos(trim.alpha_rad)), -float(np.sin(trim.alpha_rad))
    # What its size is compared with, one deviation, what is expected.
    sizes = {
        "airspeed_mps": ("", pull * (EFFICIENCY_SHARE if known else 1.0), known * pull * along),
        "alpha_rad": ("", lift * NORMAL_SHARE, known * lift * down),
        "q_radps": ("M_de", TRIMMED_RAD, 0.0),
    }
    return tuple(
        LeftOutTerm(THRUST_ROWS[row], row, THRUST, *sizes[row], gain=1.0 / usual_n) for row in rows
    )


def with_thrust_input(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    cuts: Sequence[Mapping[str, Array]],
    terms: Sequence[LeftOutTerm],
    trim: Trim,
) -> tuple[LinearModel, list[Maneuver]]:
    """Return a model and its maneuvers with thrust as an input, what it does as parameters."""
    sizes = expected_left_out(terms, {p.name: (p.start, 0.0) for p in model.parameters})
    place = len(model.inputs)
    acting = [
        entry for t in terms for entry in acting_terms(model, trim, t.name, t.row, place, t.gain)
    ]
    wide = replace(
        model,
        inputs=(*model.inputs, THRUST),
        B=np.pad(model.B, ((0, 0), (0, 1))),
        D=np.pad(model.D, ((0, 0), (0, 1))),
        terms=(*model.terms, *acting),
        parameters=(
            *model.parameters,
            *(Parameter(name, mean, prior_sd=sd) for name, (mean, sd) in sizes.items()),
        ),
    )
    driven = [
        replace(m, inputs=np.column_stack([m.inputs, c[THRUST] - np.mean(c[THRUST])]))
        for m, c in zip(maneuvers, cuts, strict=True)
    ]
    return wide, driven


def _without_airspeed_n(cuts: Sequence[Mapping[str, Array]]) -> float:
    """Return the rms of thrust about its mean in each maneuver that no airspeed explains."""
    thrust, speed = (
        np.concatenate([c[name] - np.mean(c[name]) for c in cuts])
        for name in (THRUST, "airspeed_mps")
    )
    slope = (thrust @ speed) / max(float(speed @ speed), 1e-300)
    return float(np.sqrt(np.mean((thrust - slope * speed) ** 2)))
