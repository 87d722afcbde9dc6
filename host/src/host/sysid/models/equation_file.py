"""Read a model of the user's own equations from TOML.

```toml
kind = "equations"
name = "pitch with a drag polar"
inputs = ["elevator_rad"]              # their maneuvers are fitted
columns = ["thrust_n"]                 # measured too, drive the equations
[constants]
mass_kg = 1.9
[definitions]                          # parts of what follows, each of those before it
qbar = "0.5*1.225*airspeed_mps^2"
[rates]                                # dx/dt; the keys are the states
q_radps = "Mq*q_radps + Mde*elevator_rad + M0"
[outputs]                              # columns, and what they measure
q_radps = "q_radps"
[parameters]
Mq = { start = -5.0, upper = 0.0, prior_sd = 5.0, unit = "1/s" }
M0 = { each_record = true }            # of its own in each record
[tables.stall]                         # of one argument: stall(alpha_rad)
x = [0.0, 0.2, 0.3]
y = [0.0, 1.0, 0.8]
[starts]                               # first guess of an initial state, from the first sample
q_radps = "q_radps"
```

`initial_states`, `state_biases`, `output_biases`, `noise`, `delays` and `hold` as of linear models
(`model_file.py`); left out, all initial states are free, and no bias. A delay may be of inputs.
`hold = "smooth"`: between samples the inputs move as a servo does, not along lines.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from host.errors import IdentificationError
from host.files.quantities import Quantity
from host.files.user_text import shown
from host.sysid.expressions.equation_code import EquationNodes
from host.sysid.expressions.grammar import NAME, RESERVED
from host.sysid.models.file_parts import delays_from, names_from, parameter_from, table_from
from host.sysid.models.model_constants import ModelConstants, read_constants, read_noise
from host.sysid.models.nonlinear_model import Equations, NonlinearModel, no_tangent
from host.sysid.models.state_space_model import CONSTANT, DelayGroup, Parameter
from host.text import shown as in_a_line

KIND = "equations"
LINE, SMOOTH = "foh", "smooth"  # inputs between samples
HOLDS = ("zoh", LINE, SMOOTH)
KEYS = (
    "kind", "name", "about", "inputs", "columns", "hold", "constants", "definitions", "rates",
    "outputs", "parameters", "tables", "starts", "initial_states", "state_biases", "output_biases",
    "noise", "process_noise", "delays", "fit",
)  # fmt: skip
MOST = {"rates": 24, "outputs": 30, "definitions": 200, "parameters": 100, "constants": 200,
        "tables": 50, "starts": 24}  # fmt: skip
MOST_INPUTS = 30
OF_PARAMETER = ("start", "lower", "upper", "prior_sd", "each_record", "unit")
MOST_POINTS = 1000
LONGEST_NAME = 60
_PLACE = re.compile(r"\[?(\w+)\]?(?:\.(\w+))?")
_HEADING = re.compile(r"\s*\[+\s*(\w+(?:\.\w+)?)\s*\]")
_KEY = re.compile(r"\s*[\"']?(\w+)[\"']?\s*=")
_ANY = Quantity("", -1e12, 1e12, "a Young's modulus is smaller")


def equations_from(document: Mapping[str, object], name: str = "model") -> NonlinearModel:
    """Build a model from a parsed document; errors name the key.

    Raises
    ------
    IdentificationError
        If it is no model.
    """
    _refuse_unknown(document)
    inputs, columns = _inputs(document)
    texts = {key: _texts(document, key) for key in ("rates", "outputs", "definitions", "starts")}
    states, outputs, defined = (
        tuple(name for name, _ in texts[key]) for key in ("rates", "outputs", "definitions")
    )
    parameters, own = _parameters(document)
    constants, tables = _numbers(document), _tables(document)
    # An output may have the name of a state or of what it measures; nothing else twice.
    _refuse_twice(
        {
            "a state": states,
            "an input": inputs,
            "a measured column": columns,
            "a parameter": [p.name for p in (*parameters, *own)],
            "a definition": defined,
            "a constant": [name for name, _ in constants],
            "a table": [name for name, _, _ in tables],
        }
    )
    equations = Equations(
        definitions=texts["definitions"],
        rates=texts["rates"],
        outputs=texts["outputs"],
        constants=constants,
        tables=tables,
        starts=texts["starts"],
        parameters=tuple(p.name for p in (*parameters, *own)),
        inputs=(*inputs, *columns),
        controls=len(inputs),
    )
    initial = _constants(document, "initial_states", states, states)
    _check(equations, states, [name for _, name in initial.shared])
    zero = no_tangent(equations)
    hold = _hold(document)
    return NonlinearModel(
        equations=equations,
        own_parameters=own,
        states=states,
        inputs=equations.inputs,
        outputs=outputs,
        A=zero["A"],
        B=zero["B"],
        C=zero["C"],
        D=zero["D"],
        name=in_a_line(str(document.get("name", name))),
        parameters=parameters,
        state_biases=_only_own(document, "state_biases", states),
        output_biases=_only_own(document, "output_biases", outputs),
        initial_states=initial.own,
        known_starts=initial.known,
        shared_starts=initial.shared,
        known_noise=read_noise(document.get("noise", {}), outputs, "noise"),
        delays=_delays(document, [p.name for p in (*parameters, *own)]),
        hold=LINE if hold == SMOOTH else hold,
        smooth=hold == SMOOTH,
        process_noise=_process_noise(document, states, equations.nodes(), equations.parameters),
    )


def _refuse_unknown(document: Mapping[str, object]) -> None:
    unknown = sorted(set(document) - set(KEYS))
    if unknown:
        raise IdentificationError(
            f"unknown key {in_a_line(', '.join(unknown))}; known are {', '.join(KEYS)}"
        )


def _hold(document: Mapping[str, object]) -> str:
    hold = str(document.get("hold", LINE))
    if hold not in HOLDS:
        raise IdentificationError(f"hold: {shown(hold)}, use {', '.join(HOLDS)}")
    return hold


def _inputs(document: Mapping[str, object]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return what a pilot moves and what is measured; without either a motion is free."""
    inputs, columns = (
        names_from(document, key, "") if key in document else () for key in ("inputs", "columns")
    )
    if len(inputs) + len(columns) > MOST_INPUTS:
        raise IdentificationError(f"more than {MOST_INPUTS} inputs and columns")
    return inputs, columns or (() if inputs else (CONSTANT,))


def _numbers(document: Mapping[str, object]) -> tuple[tuple[str, float], ...]:
    """Return the constants."""
    return tuple(
        (key, _ANY.check(f"constants.{key}", value, IdentificationError))
        for key, value in _section(document, "constants").items()
    )


def _check(equations: Equations, states: Sequence[str], starting: Collection[str]) -> None:
    """Refuse starts of no state, idle parameters, and equations too large with their slopes."""
    strangers = sorted({name for name, _ in equations.starts} - {*states})
    if strangers:
        raise IdentificationError(f"starts.{strangers[0]}: no state; there are {', '.join(states)}")
    nodes = equations.nodes()
    used = {
        nodes.graph.nodes[k].name for k in nodes.graph.reachable([*nodes.rates, *nodes.outputs])
    }
    idle = [name for name in equations.parameters if name not in {*used, *starting}]
    if idle:
        raise IdentificationError(f"parameters.{idle[0]}: enters no expression")
    equations.text()
    equations.check_starts()


def _texts(document: Mapping[str, object], key: str) -> tuple[tuple[str, str], ...]:
    found = []
    for name, value in _section(document, key).items():
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise IdentificationError(f"{key}.{name}: {shown(value)}, expected an expression")
        found.append((name, value if isinstance(value, str) else repr(value)))
    if key in ("rates", "outputs") and not found:
        raise IdentificationError(f"[{key}] is missing: a name = an expression, at least one")
    return tuple(found)


def _section(document: Mapping[str, object], key: str) -> dict[str, object]:
    value = document.get(key, {})
    if not isinstance(value, dict):
        raise IdentificationError(f"[{key}] must be a table, found {shown(value)}")
    if len(value) > MOST[key]:
        raise IdentificationError(f"[{key}] has {len(value)} entries, expected up to {MOST[key]}")
    for name in value:
        if not NAME.fullmatch(name) or len(name) > LONGEST_NAME:
            raise IdentificationError(
                f"[{key}] has {in_a_line(shown(name))}; a name is letters, digits and _"
            )
        if name in RESERVED and key != "outputs":
            raise IdentificationError(f"{key}.{name}: the name of a function or of pi")
    return value


def _parameters(
    document: Mapping[str, object],
) -> tuple[tuple[Parameter, ...], tuple[Parameter, ...]]:
    """Return the parameters that all records share, and those of each record."""
    common: list[Parameter] = []
    own: list[Parameter] = []
    for name, value in _section(document, "parameters").items():
        where = f"parameters.{name}"
        settings = dict(
            table_from(value if isinstance(value, dict) else {"start": value}, OF_PARAMETER, where)
        )
        each = settings.pop("each_record", False)
        unit = settings.pop("unit", "")
        if not isinstance(each, bool) or not isinstance(unit, str) or len(unit) > LONGEST_NAME:
            raise IdentificationError(f"{where}: each_record is true or false, unit a short text")
        found = parameter_from(name, settings, where)
        (own if each else common).append(replace(found, unit=in_a_line(unit)))
    return tuple(common), tuple(own)


def _tables(
    document: Mapping[str, object],
) -> tuple[tuple[str, tuple[float, ...], tuple[float, ...]], ...]:
    found = []
    for name, value in _section(document, "tables").items():
        where = f"tables.{name}"
        points = table_from(value, ("x", "y"), where)
        columns = []
        for key in ("x", "y"):
            numbers = points.get(key)
            if not isinstance(numbers, list) or not 2 <= len(numbers) <= MOST_POINTS:
                raise IdentificationError(f"{where}: {key} must be a list of 2 to {MOST_POINTS}")
            columns.append(
                tuple(_ANY.check(f"{where}: {key}", v, IdentificationError) for v in numbers)
            )
        x, y = columns
        if len(x) != len(y):
            raise IdentificationError(f"{where}: {len(x)} points of x, {len(y)} of y")
        if any(b <= a for a, b in pairwise(x)):
            raise IdentificationError(f"{where}: x must rise from point to point")
        found.append((name, x, y))
    return tuple(found)


def _constants(
    document: Mapping[str, object], key: str, signals: tuple[str, ...], usual: tuple[str, ...]
) -> ModelConstants:
    return read_constants(document[key], signals, key) if key in document else ModelConstants(usual)


def _only_own(
    document: Mapping[str, object], key: str, signals: tuple[str, ...]
) -> tuple[str, ...]:
    """Return biases of each record; a known or shared one belongs in the expression."""
    found = _constants(document, key, signals, ())
    if found.known or found.shared:
        raise IdentificationError(
            f'{key}: only "own" here; a known or shared bias is a constant or parameter of the'
            " expression"
        )
    return found.own


def _process_noise(
    document: Mapping[str, object],
    states: tuple[str, ...],
    nodes: EquationNodes,
    parameters: tuple[str, ...],
) -> tuple[str, ...]:
    """Return the states that process noise drives: those whose rate has a parameter."""
    if "process_noise" not in document:
        graph = nodes.graph
        return tuple(
            state
            for state, rate in zip(states, nodes.rates, strict=True)
            if {graph.nodes[k].name for k in graph.reachable([rate])} & set(parameters)
        )
    names = names_from(document, "process_noise", "")
    strangers = sorted(set(names) - set(states))
    if strangers:
        raise IdentificationError(
            f"process_noise: no state {', '.join(strangers)}; there are {', '.join(states)}"
        )
    return names


def _delays(document: Mapping[str, object], used: list[str]) -> tuple[DelayGroup, ...]:
    return delays_from(document["delays"], used, "") if "delays" in document else ()


def _refuse_twice(named: Mapping[str, Collection[str]]) -> None:
    seen: dict[str, str] = {}
    for kind, names in named.items():
        for name in names:
            if name in seen:
                raise IdentificationError(f"{name} is named twice: as {seen[name]} and as {kind}")
            seen[name] = kind


def line_of(message: str, text: str) -> str:
    """Return the line of the key that a message begins with, as `` line 12``; else nothing."""
    found = _PLACE.match(message)
    if found is None:
        return ""
    section, key = found.groups()
    inside = ""
    for number, line in enumerate(text.splitlines(), start=1):
        heading, name = _HEADING.match(line), _KEY.match(line)
        if heading:
            inside = heading.group(1)
            if inside == (f"{section}.{key}" if key else section):
                return f" line {number}"
        elif name and (inside, name.group(1)) == ((section, key) if key else ("", section)):
            return f" line {number}"
    return ""
