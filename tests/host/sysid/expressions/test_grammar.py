"""Random expressions: their value against numpy, their slopes against complex steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from host.sysid.expressions import EquationNodes, evaluate, parse_expression
from host.sysid.expressions.expression_graph import ExpressionError, ExpressionGraph

NAMES = ("a", "b", "w")
X, Y = (-2.0, -0.5, 0.4, 1.5), (0.3, -1.0, 2.0, 0.0)
COMPLEX_STEP = 1e-30
Closure = Callable[[Any], Any]


def test_a_random_expression_has_the_value_of_numpy() -> None:
    rng = np.random.default_rng(5)
    compared = 0
    for _ in range(400):
        text, closure = random_expression(rng, 4, smooth=False)
        point = rng.uniform(-1.5, 1.5, len(NAMES))
        with np.errstate(all="ignore"):
            expected = closure(point)
        if not np.isfinite(expected) or abs(expected) > 1e6:
            continue
        found, _ = value_and_slopes(text, point)
        assert found == pytest.approx(float(expected), rel=1e-9, abs=1e-9), text
        compared += 1
    assert compared > 300


def test_slopes_are_those_of_complex_steps() -> None:
    rng = np.random.default_rng(6)
    compared = 0
    for _ in range(300):
        text, closure = random_expression(rng, 4, smooth=True)
        point = rng.uniform(-1.5, 1.5, len(NAMES))
        with np.errstate(all="ignore"):
            steps = [point + COMPLEX_STEP * 1j * unit for unit in np.eye(len(NAMES))]
            expected = np.array([np.imag(closure(z)) for z in steps]) / COMPLEX_STEP
        if not np.isfinite(expected).all() or np.max(np.abs(expected)) > 1e6:
            continue
        try:
            _, slopes = value_and_slopes(text, point)
        except ExpressionError:
            continue  # a constant of it overflows
        assert slopes == pytest.approx(expected, rel=1e-10, abs=1e-10), text
        compared += 1
    assert compared > 200


def test_slopes_with_kinks_are_those_of_differences_beside_them() -> None:
    rng = np.random.default_rng(7)
    compared = 0
    for _ in range(400):
        text, closure = random_expression(rng, 3, smooth=False)
        point = rng.uniform(-1.5, 1.5, len(NAMES))
        with np.errstate(all="ignore"):
            found = [differences(closure, point, width) for width in (1e-3, 5e-4)]
        coarse, fine = np.array(found)
        # Differences across a kink do not settle, and say nothing.
        if not np.isfinite(fine).all() or np.max(np.abs(fine - coarse)) > 1e-8:
            continue
        _, slopes = value_and_slopes(text, point)
        assert slopes == pytest.approx(fine, rel=1e-6, abs=1e-6), text
        compared += 1
    assert compared > 200


@pytest.mark.parametrize(
    ("text", "slope"),
    [("max(a, 0)", 1.0), ("min(a, 0)", 1.0), ("abs(a)", 1.0), ("step(a + 0.4)", -0.4 / 1.1 - 1.0)],
)
def test_a_kink_has_the_slope_of_one_side(text: str, slope: float) -> None:
    if "step" in text:
        slope = (Y[3] - Y[2]) / (X[3] - X[2])
    _, slopes = value_and_slopes(text, np.zeros(3))
    assert slopes[0] == pytest.approx(slope)


def test_precedence_is_that_of_algebra() -> None:
    for text, expected in (
        ("-2^2", -4.0), ("2^-1", 0.5), ("2^3^2", 512.0), ("1 - 2 - 3", -4.0), ("8/4/2", 1.0),
        ("2*-3", -6.0), ("-a^2", -9.0), ("1e-3*pi", np.pi * 1e-3), ("min(3, 1, 2)", 1.0),
    ):  # fmt: skip
        graph = ExpressionGraph()
        node = parse_expression(text, graph, {"a": graph.variable("a")})
        assert evaluate(graph, node, {"a": 3.0}) == pytest.approx(expected), text


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("__import__('os')", "column 1: '__import__' is no function or table"),
        ("a.b", "column 2: '.' is no part of an expression"),
        ("a if b else w", "column 3: found 'if', expected an operator"),
        ("(lambda: 1)()", "column 8: ':' is no part"),
        ("a[0]", "column 2: '[' is no part"),
        ("alhpa + 1", "column 1: 'alhpa' is no name of this model"),
        ("sin a", "column 1: 'sin' is no name of this model; it takes its argument in brackets"),
        ("atan2(a)", "column 1: atan2 takes 2 arguments, found 1"),
        ("a +", "column 4: found the end, expected a number, a name or ("),
        ("2^1e9", "column 2: exponent 1e+09, expected up to 100"),
        ("9^99^99", "exponent"),
        ("1e999", "column 1: a number of it is not finite"),
        ("1/0", "column 2: division by zero"),
        ("exp(1000)", "column 1: a number of it is not finite"),
        ("(" * 900 + "a" + ")" * 900, "column 42: nested deeper than 40"),
        ("-" * 1900 + "a", "nested deeper than 40"),
        ("2^" * 900 + "2", "nested deeper than 40"),
        ("+".join(["a"] * 3000), "5999 characters, expected up to 2000"),
        ("", "column 1: found the end"),
        ("a\x00", "is no part of an expression"),
    ],
)
def test_what_is_no_expression_is_refused_in_one_line(text: str, said: str) -> None:
    graph = ExpressionGraph()
    names = {name: graph.variable(name) for name in NAMES}
    with pytest.raises(ExpressionError) as error:
        parse_expression(text, graph, names, {"step"})
    assert said in str(error.value)
    assert "\n" not in str(error.value) and len(str(error.value)) < 160


def differences(closure: Closure, point: np.ndarray, width: float) -> np.ndarray:
    """Return central differences of sixth order."""
    weights = np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0
    slopes = []
    for unit in np.eye(len(NAMES)):
        values = [closure(point + k * width * unit) for k in (-3, -2, -1, 1, 2, 3)]
        slopes.append(weights @ np.array(values) / width)
    return np.array(slopes)


def value_and_slopes(text: str, point: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the value and slopes of an expression as its generated code has them."""
    graph = ExpressionGraph()
    names = {name: graph.variable(name) for name in NAMES}
    node = parse_expression(text, graph, names, {"step"})
    nodes = EquationNodes(graph, (node,), (), NAMES, (), (), (), {"step": (X, Y)})
    places: dict[str, Any] = {}
    exec(nodes.text(), places)
    f, fx, none = np.zeros(1), np.zeros((1, 3)), np.zeros((1, 0))
    places["rate_slopes"](point, none[0], none[0], none[0], nodes.table_values, f, fx, none, none)
    return float(f[0]), fx[0]


def random_expression(rng: np.random.Generator, depth: int, *, smooth: bool) -> tuple[str, Closure]:
    """Return the text of a random expression and the same as a function of numpy."""
    if depth == 0 or rng.random() < 0.15:
        if rng.random() < 0.3:
            number = round(float(rng.uniform(-3.0, 3.0)), 2)
            return f"({number})", lambda z: number
        k = int(rng.integers(len(NAMES)))
        return NAMES[k], lambda z: z[k]
    left, f = random_expression(rng, depth - 1, smooth=smooth)
    right, g = random_expression(rng, depth - 1, smooth=smooth)
    kinds: list[tuple[str, Closure]] = [
        (f"{left} + ({right})", lambda z: f(z) + g(z)),
        (f"{left} - ({right})", lambda z: f(z) - g(z)),
        (f"({left})*({right})", lambda z: f(z) * g(z)),
        (f"({left})/({right})", lambda z: f(z) / g(z)),
        (f"-({left})", lambda z: -f(z)),
        (f"({left})^3", lambda z: f(z) ** 3),
        (f"({left})**2 ", lambda z: f(z) ** 2),
        (f"sin({left})", lambda z: np.sin(f(z))),
        (f"cos({left})", lambda z: np.cos(f(z))),
        (f"tan({left})", lambda z: np.tan(f(z))),
        (f"exp({left})", lambda z: np.exp(f(z))),
        (f"sqrt(1.5 + ({left})^2)", lambda z: np.sqrt(1.5 + f(z) ** 2)),
        (f"log(1.5 + ({left})^2)", lambda z: np.log(1.5 + f(z) ** 2)),
        (f"atan({left})", lambda z: np.arctan(f(z))),
        (f"(2 + sin({left}))^({right})", lambda z: (2.0 + np.sin(f(z))) ** g(z)),
    ]
    if not smooth:
        kinds += [
            (f"atan2({left}, {right})", lambda z: np.arctan2(f(z), g(z))),
            (f"min({left}, {right})", lambda z: np.minimum(f(z), g(z))),
            (f"max({left}, {right})", lambda z: np.maximum(f(z), g(z))),
            (f"abs({left})", lambda z: np.abs(f(z))),
            (f"step({left})", lambda z: np.interp(f(z), X, Y)),
        ]
    text, closure = kinds[int(rng.integers(len(kinds)))]
    return f"({text})", closure
