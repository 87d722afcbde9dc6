"""Aircraft of either kind by name or file: coefficients, published matrices, identified models."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from host.twin.aircraft import file as aircraft
from host.twin.aircraft import tomlin
from host.twin.aircraft.airframe import GRAVITY_MPS2, Array
from host.twin.aircraft.file import Aircraft, AircraftError, read_document
from host.twin.aircraft.straight import Straight
from host.twin.motion.linear import linearise
from host.twin.motion.trim import solve
from host.twin.testcard.cards import Card

# Of the gravity terms of a file, against g and its own angle of attack.
GRAVITY_TOLERANCE = 0.01
# States of identified models, and those of the equations of motion they stand for.
AXES = {
    "longitudinal": ("airspeed_mps", "alpha_rad", "q_radps", "theta_rad"),
    "lateral": ("beta_rad", "p_radps", "r_radps", "phi_rad"),
}
INPUTS = {
    "longitudinal": ("elevator_rad", "throttle"),
    "lateral": ("aileron_rad", "rudder_rad"),
}


def load(source: str | Path) -> Aircraft:
    """Load an aircraft of any kind.

    A linear one names in `base` the aircraft that gives all that is not in its matrices: sensors
    and their places, servos, limits, geometry, mass.

    Parameters
    ----------
    source : str or Path
        Name of a packaged aircraft, or path of a file.

    Returns
    -------
    Aircraft

    Raises
    ------
    AircraftError
        A number is missing or wrong; matrices have the wrong size.
    """
    document = read_document(source)
    if document.get("kind") != "linear":
        return aircraft.load(source)
    if not isinstance(document.get("source"), str):
        raise AircraftError(f"{source}: the matrices have no source")
    base = aircraft.load(str(document.get("base", "")))
    numbers = {
        key: tomlin.number(f"{source}: {key}", document.get(key), AircraftError)
        for key in ("u_mps", "w_mps", "elevator_rad", "throttle")
    }
    shapes = {"longitudinal_a": (4, 4), "longitudinal_b": (4, 1), "lateral_a": (4, 4),
              "lateral_b": (4, 2)}  # fmt: skip
    matrices = {name: _matrix(source, document, name, shape) for name, shape in shapes.items()}
    alpha = math.atan2(numbers["w_mps"], numbers["u_mps"])
    pull = matrices["longitudinal_a"][0, 3], matrices["lateral_a"][0, 3]
    for found, sign in zip(pull, (-1.0, 1.0), strict=True):
        expected = sign * GRAVITY_MPS2 * math.cos(alpha)
        if abs(found - expected) > GRAVITY_TOLERANCE * GRAVITY_MPS2:
            raise AircraftError(
                f"{source}: gravity enters with {found:.4g} m/s2, expected {expected:.4g}"
            )
    # Of a motor it says nothing: the throttle moves, the aircraft does not feel it.
    wide = np.hstack([matrices["longitudinal_b"], np.zeros((4, 1))])
    straight = Straight(
        **numbers,
        longitudinal_a=matrices["longitudinal_a"],
        longitudinal_b=wide,
        lateral_a=matrices["lateral_a"],
        lateral_b=matrices["lateral_b"],
    )
    return _with(
        base,
        straight,
        name=str(document.get("name", Path(source).stem)),
        title=str(document.get("title", source)),
    )


def is_model(source: str | Path) -> bool:
    """Return whether a file is a model as `host identify --save-model` writes it."""
    path = Path(source)
    if path.suffix != ".toml" or not path.is_file():
        return False
    return any(line.startswith("states =") for line in path.read_text("utf-8").splitlines())


def with_models(base: Aircraft, models: Sequence[Path]) -> Aircraft:
    """Return a linear aircraft: `base` about its trim, with the entries of identified models.

    Parameters
    ----------
    base : Aircraft
        With coefficients; gives what no model has.
    models : sequence of Path
        Models as `host identify --save-model` writes them, of one airspeed.

    Returns
    -------
    Aircraft

    Raises
    ------
    AircraftError
        A model has other states than those of flight, no [trim], or another airspeed.
    """
    from host.sysid.models.model_file import read_model, read_trim

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
        found_a, found_b, _, _ = model.matrices(model.start)
        own_a[np.ix_(rows, rows)] = found_a
        own_b[np.ix_(rows, columns)] = found_b
        a[axis], b[axis] = t @ own_a @ np.linalg.inv(t), t @ own_b
    straight = Straight(
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
    return _with(base, straight, name=base.name, title=f"{base.title}, linear, with {names}")


def refuse_unfit(plane: Aircraft, card: Card) -> None:
    """Raise AircraftError where a card asks a linear aircraft for what it knows nothing of."""
    speed = plane.scalar("trim.airspeed_mps")
    if any(fault.kind == "motor_cut" for fault in card.faults):
        raise AircraftError(f"{plane.name}: linear, it has no motor to cut as {card.name} wants")
    if card.flight.airspeed_mps and abs(card.flight.airspeed_mps - speed) > 0.1:
        raise AircraftError(
            f"{plane.name}: linear about {speed:.1f} m/s, {card.name} wants"
            f" {card.flight.airspeed_mps:.1f} m/s"
        )


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


def _with(base: Aircraft, straight: Straight, *, name: str, title: str) -> Aircraft:
    speed = math.hypot(straight.u_mps, straight.w_mps)
    return replace(
        base,
        name=name,
        title=title,
        scalars={**base.scalars, "trim.airspeed_mps": speed},
        straight=straight,
    )


def _matrix(
    source: str | Path, document: dict[str, object], name: str, shape: tuple[int, int]
) -> Array:
    try:
        matrix = np.array(document.get(name), dtype=np.float64)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape != shape or not np.isfinite(matrix).all():
        raise AircraftError(f"{source}: {name} has shape {matrix.shape}, expected {shape}")
    return matrix
