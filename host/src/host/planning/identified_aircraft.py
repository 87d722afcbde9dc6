"""An aircraft to fly that has the entries of identified models."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from host.aircraft.file import Aircraft, AircraftError
from host.aircraft.linear_aircraft import load, with_linear_dynamics
from host.aircraft.linear_dynamics import LinearDynamics
from host.aircraft.linearisation import linearise
from host.aircraft.trim import solve
from host.arrays import Array
from host.constants import NORMAL_95
from host.errors import UsageError
from host.files.user_text import read_text
from host.planning.prior_range import LARGEST, random_aircraft
from host.sysid.conversion import saved_values
from host.sysid.models import LinearModel, read_model
from host.sysid.models.model_file import read_trim

FIRST_DRAW = 980_101

# States of identified models, and those of the equations of motion they stand for.
AXES = {
    "longitudinal": ("airspeed_mps", "alpha_rad", "q_radps", "theta_rad"),
    "lateral": ("beta_rad", "p_radps", "r_radps", "phi_rad"),
}
INPUTS = {
    "longitudinal": ("elevator_rad", "throttle"),
    "lateral": ("aileron_rad", "rudder_rad"),
}


def is_model(source: str | Path) -> bool:
    """Return whether a file is a model as `host identify --save-model` writes it.

    Parameters
    ----------
    source : str or Path
        Anything; a name of an aircraft is no file.

    Raises
    ------
    AircraftError
        If a TOML file cannot be read.
    """
    path = Path(source)
    if path.suffix != ".toml" or not path.is_file():
        return False
    text = read_text(path, AircraftError, "TOML", encoding_errors="replace")
    return any(line.startswith("states =") for line in text.splitlines())


def with_models(
    base: Aircraft, models: Sequence[Path], draw: np.random.Generator | None = None
) -> Aircraft:
    """Return a linear aircraft: `base` about its trim, with the entries of identified models.

    Parameters
    ----------
    base : Aircraft
        With coefficients; gives what no model has.
    models : sequence of Path
        Models as `host identify --save-model` writes them, of one airspeed.
    draw : Generator, optional
        Draws every parameter from the 95 % interval of it; none changes its sign.

    Returns
    -------
    Aircraft

    Raises
    ------
    AircraftError
        A model has other states than those of flight, no [trim], or another airspeed.
    """
    read = [(path, read_model(path), read_trim(path)) for path in models]
    speed, alpha = read[0][2].airspeed_mps, read[0][2].alpha_rad
    for path, _, trim in read:
        if abs(trim.airspeed_mps - speed) > 0.05 * speed:
            raise AircraftError(
                f"{path}: about {trim.airspeed_mps:.1f} m/s, expected {speed:.1f} as {models[0]}"
            )
    frame = base.airframe()
    trimmed = solve(frame, speed)
    linear = linearise(frame, trimmed)
    turn = np.eye(4)
    turn[:2, :2] = [
        [math.cos(alpha), -speed * math.sin(alpha)],
        [math.sin(alpha), speed * math.cos(alpha)],
    ]
    turns = {"longitudinal": turn, "lateral": np.diag([speed, 1.0, 1.0, 1.0])}
    a = {"longitudinal": linear.longitudinal_a, "lateral": linear.lateral_a}
    b = {
        "longitudinal": np.hstack([linear.longitudinal_b, np.zeros((4, 1))]),
        "lateral": linear.lateral_b,
    }
    for path, model, _ in read:
        axis = _axis(path, model.states, model.inputs)
        t = turns[axis]
        own_a, own_b = np.linalg.solve(t, a[axis] @ t), np.linalg.solve(t, b[axis])
        rows = [AXES[axis].index(name) for name in model.states]
        columns = [INPUTS[axis].index(name) for name in model.inputs]
        found_a, found_b, _, _ = model.matrices(_values(path, model, draw))
        own_a[np.ix_(rows, rows)] = found_a
        own_b[np.ix_(rows, columns)] = found_b
        a[axis], b[axis] = t @ own_a @ np.linalg.inv(t), t @ own_b
    straight = LinearDynamics(
        u_mps=speed * math.cos(alpha),
        w_mps=speed * math.sin(alpha),
        elevator_rad=float(trimmed.command[0]),
        throttle=float(trimmed.command[3]),
        longitudinal_a=a["longitudinal"],
        longitudinal_b=b["longitudinal"],
        lateral_a=a["lateral"],
        lateral_b=b["lateral"],
    )
    names = ", ".join(path.name for path in models)
    return with_linear_dynamics(
        base, straight, name=base.name, title=f"{base.title}, linear, with {names}"
    )


def identified_range(base: Aircraft, models: Sequence[Path], count: int) -> list[Aircraft]:
    """Return the aircraft of identified models, and others from their intervals.

    What no model says is drawn as of any aircraft before its first flight.

    Parameters
    ----------
    base : Aircraft
    models : sequence of Path
        As `with_models` takes them.
    count : int
        How many in all; the first is the estimate itself.
    """
    drawn = [
        with_models(random_aircraft(base, seed), models, np.random.default_rng([seed, 6]))
        for seed in range(FIRST_DRAW, FIRST_DRAW + count - 1)
    ]
    return [with_models(base, models), *drawn]


def _values(path: Path, model: LinearModel, draw: np.random.Generator | None) -> Array:
    """Return the parameters of a model, or a draw from their intervals."""
    if draw is None:
        return model.start
    half = {name: pair[1] for name, pair in saved_values(path).items()}
    sd = np.array([half.get(one.name, 0.0) for one in model.parameters]) / NORMAL_95
    most = LARGEST * np.abs(model.start)
    return model.start + np.clip(sd * draw.standard_normal(len(sd)), -most, most)


def _axis(path: Path, states: tuple[str, ...], inputs: tuple[str, ...]) -> str:
    for axis, known in AXES.items():
        if set(states) <= set(known) and set(inputs) <= set(INPUTS[axis]):
            # A phugoid leaves alpha out and hides it in its other rows.
            if axis == "longitudinal" and "alpha_rad" not in states:
                break
            return axis
    raise AircraftError(
        f"{path}: states {', '.join(states)} with inputs {', '.join(inputs)} cannot be flown,"
        f" expected of {', '.join(AXES['longitudinal'])} (alpha_rad among them) or"
        f" {', '.join(AXES['lateral'])}"
    )


def named_aircraft(given: Sequence[str], usual: str) -> Aircraft | None:
    """Return the aircraft that names and saved models stand for; None where nothing is given.

    Parameters
    ----------
    given : sequence of str
        At most one aircraft by name or file, and models of `host identify --save-model` that it
        becomes the aircraft of.
    usual : str
        The aircraft of the models where none is named.

    Raises
    ------
    host.errors.UsageError
        If two aircraft are named, or one cannot be read.
    """
    models = [Path(name) for name in given if is_model(name)]
    named = [name for name in given if not is_model(name)]
    if len(named) > 1:
        raise UsageError(f"{named[1]}: one aircraft flies, {named[0]} is given already")
    if not given:
        return None
    base = load(named[0] if named else usual)
    return with_models(base, models) if models else base
