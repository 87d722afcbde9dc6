"""Data without an aircraft in them: one clear line from every method, or finite numbers."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from host.errors import IdentificationError
from host.sysid import Maneuver, fit, methods
from studies.data import noisy
from studies.navion import navion_structured

OPTIONS: dict[str, dict[str, object]] = {
    "genetic": {"generations": 2},
    "hopfield": {"iterations": 500},
    "hopfield-line-search": {"iterations": 2},
    "neural-delta": {"repeats": 3},
}
GOOD = noisy(77, 0.05, duration_s=6.0)
U, Y = GOOD.inputs, GOOD.outputs
Arrays = tuple[float, np.ndarray, np.ndarray]


def column(values: float | np.ndarray, place: int = 2) -> np.ndarray:
    result = Y.copy()
    result[:, place] = values
    return result


def one(value: float) -> np.ndarray:
    result = Y.copy()
    result[37, 1] = value
    return result


def random(seed: int) -> Arrays:
    rng = np.random.default_rng(seed)
    return 0.02, rng.standard_normal((120, 1)), 1e3 * rng.standard_normal((120, 4))


# What a maneuver or the door must refuse, whatever the method.
REFUSED: dict[str, tuple[Callable[[], Arrays], str]] = {
    "not a number": (lambda: (0.05, U, one(np.nan)), "not a finite number at sample 37"),
    "infinite": (lambda: (0.05, U, one(np.inf)), "not a finite number at sample 37"),
    "spike": (lambda: (0.05, U, one(1e300)), "no quantity of flight"),
    "huge": (lambda: (0.05, U, 1e150 * Y), "no quantity of flight"),
    "tiny": (lambda: (0.05, U, 1e-200 * Y), "never moved"),
    "all zero": (lambda: (0.05, 0.0 * U, 0.0 * Y), "never moved"),
    "dead sensor": (lambda: (0.05, U, column(0.3)), "q_radps never moved"),
    "two samples": (lambda: (0.05, U[:2], Y[:2]), "2 samples, at least 8"),
    "no samples": (lambda: (0.05, U[:0], Y[:0]), "0 samples, at least 8"),
    "no columns": (lambda: (0.05, U[:, :0], Y[:, :0]), "0 inputs, model"),
    "two inputs": (lambda: (0.05, np.hstack([U, U]), Y), "2 inputs, model"),
    "three outputs": (lambda: (0.05, U, Y[:, :3]), "3 outputs, model"),
    "unlike lengths": (lambda: (0.05, U[:-3], Y), "samples of inputs"),
    "one dimension": (lambda: (0.05, U[:, 0], Y), "1 dimensions"),
    "no time": (lambda: (0.0, U, Y), "not positive"),
    "time backwards": (lambda: (-0.05, U, Y), "not positive"),
}
# What may come back with numbers, if they are finite.
ODD: dict[str, Callable[[], Arrays]] = {
    "noise": lambda: random(5),
    "constant input": lambda: (0.05, np.ones_like(U), Y),
    "dead input": lambda: (0.05, 0.0 * U, Y),
    "eight samples": lambda: (0.05, U[20:28], Y[20:28]),
    "twelve samples": lambda: (0.05, U[20:32], Y[20:32]),
    "one signal four times": lambda: (0.05, U, np.repeat(Y[:, :1], 4, axis=1)),
    "ramps": lambda: (0.05, U, np.outer(np.arange(len(Y)), np.ones(4))),
    "years between samples": lambda: (1e8, U, Y),
}


def attempt(method: str, data: Arrays) -> str:
    """Return the error's line, empty where numbers came back; other exceptions pass through."""
    try:
        result = fit(method, navion_structured(), [Maneuver(*data)], **OPTIONS.get(method, {}))
    except IdentificationError as error:
        return str(error)
    assert np.isfinite(result.estimate).all()
    assert np.isfinite(result.covariance).all()
    assert np.all(np.diag(result.covariance) >= 0.0)
    assert np.isfinite(result.half_width()).all()
    return ""


# Each method has every second of the odd data, each of these every second method.
PAIRS = [
    pytest.param(case, method, marks=[pytest.mark.campaign] if (row + column) % 2 else [])
    for row, case in enumerate(ODD)
    for column, method in enumerate(methods())
]


@pytest.mark.parametrize("method", methods())
@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_flight_is_refused_in_one_line(case: str, method: str) -> None:
    make, words = REFUSED[case]
    line = attempt(method, make())
    assert words in line
    assert "\n" not in line


@pytest.mark.parametrize(("case", "method"), PAIRS)
def test_odd_data_end_in_finite_numbers_or_one_line(case: str, method: str) -> None:
    line = attempt(method, ODD[case]())
    assert "\n" not in line
    assert not line or len(line) > 20


def test_a_model_with_nothing_free_is_refused() -> None:
    fixed = replace(navion_structured(), terms=(), parameters=())
    for method in methods():
        with pytest.raises(IdentificationError, match="no free parameter"):
            fit(method, fixed, [GOOD])


def test_a_second_maneuver_is_looked_at_too() -> None:
    narrow = Maneuver(0.05, U, Y[:, :3])
    for method in methods():
        with pytest.raises(IdentificationError, match="3 outputs, model"):
            fit(method, navion_structured(), [GOOD, narrow])
