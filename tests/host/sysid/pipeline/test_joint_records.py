"""Several records and stretches: one set of derivatives, constants of their own, any rates."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.errors import HostError
from host.sysid import Maneuver, fit
from host.sysid.estimators import methods
from host.sysid.models import LinearModel, model_from
from numpy.typing import NDArray
from scipy import linalg, optimize

import host

Vector = NDArray[np.float64]
TRUE = {"Z_alpha": -4.0, "M_alpha": -60.0, "M_q": -5.0, "Z_de": -0.4, "M_de": -50.0}
NOISE = np.array([2e-3, 1e-2])
MODEL = {
    "name": "own",
    "hold": "zoh",
    "states": ["alpha_rad", "q_radps"],
    "inputs": ["elevator_rad"],
    "outputs": ["alpha_rad", "q_radps"],
    "state_biases": ["alpha_rad", "q_radps"],
    "initial_states": ["alpha_rad", "q_radps"],
    "delays": [],
    "A": [["Z_alpha", 1.0], ["M_alpha", "M_q"]],
    "B": [["Z_de"], ["M_de"]],
    "parameters": {"Z_alpha": {"start": -3.0}, "M_alpha": {"start": -40.0}},
}
CRUDE = ("recursive-fourier", "hopfield-line-search")  # as far off with records of one rate
PARTS = ((3.0, 1.0), (2.0, -1.0), (1.0, 1.0), (1.0, -1.0))


@dataclass(frozen=True)
class Drawn:
    """A record that begins with its input: surface, and state with noise."""

    dt_s: float
    elevator: Vector
    outputs: Vector

    def table(self) -> pd.DataFrame:
        """Return it as a user has it."""
        t = self.dt_s * np.arange(len(self.elevator))
        return pd.DataFrame(
            {
                "t_s": t,
                "airspeed_mps": 17.0 + 0.0 * t,
                "elevator_rad": self.elevator,
                "alpha_rad": self.outputs[:, 0],
                "q_radps": self.outputs[:, 1],
            }
        )

    def maneuver(self) -> Maneuver:
        """Return it as an estimator has it."""
        return Maneuver(self.dt_s, self.elevator[:, None], self.outputs)


def states(values: Vector, constants: Vector, elevator: Vector, dt_s: float) -> Vector:
    """Return the motion under a held input by an exponential of one's own, (samples, 2)."""
    Z_alpha, M_alpha, M_q, Z_de, M_de = values
    block = np.zeros((4, 4))
    block[:2] = [[Z_alpha, 1.0, Z_de, constants[2]], [M_alpha, M_q, M_de, constants[3]]]
    step = linalg.expm(block * dt_s)[:2]
    x = np.zeros((len(elevator), 2))
    x[0] = constants[:2]
    for k in range(len(elevator) - 1):
        x[k + 1] = step @ [*x[k], elevator[k], 1.0]
    return x


def drawn(rate_hz: float, seed: int, *, duration_s: float = 4.0, unit_s: float = 0.25) -> Drawn:
    """Return a 3-2-1-1 in its own trim, first step in the first sample."""
    rng = np.random.default_rng(seed)
    elevator = np.zeros(round(duration_s * rate_hz))
    first = 0.0
    for length, sign in PARTS:
        span = slice(round(first * rate_hz), round((first + length * unit_s) * rate_hz))
        elevator[span] = 0.05 * sign
        first += length * unit_s
    constants = rng.normal(size=4) * [0.02, 0.1, 0.05, 0.5]
    x = states(np.array([*TRUE.values()]), constants, elevator, 1.0 / rate_hz)
    return Drawn(1.0 / rate_hz, elevator, x + NOISE * rng.standard_normal(x.shape))


@pytest.fixture(scope="module")
def two() -> tuple[Drawn, Drawn]:
    return drawn(50.0, 1), drawn(100.0, 2, duration_s=1.9)


@pytest.fixture(scope="module")
def model() -> LinearModel:
    return model_from(MODEL)


def test_a_joint_estimate_is_that_of_one_least_squares(
    two: tuple[Drawn, Drawn], model: LinearModel
) -> None:
    """scipy, all unknowns of both records at once, each output over its own noise."""
    ours = fit("output-error-white", model, [one.maneuver() for one in two])
    noise = np.sqrt(ours.details["innovation_variance"])

    def residuals(unknown: Vector) -> Vector:
        parts = [
            (one.outputs - states(unknown[:5], constants, one.elevator, one.dt_s)) / noise
            for one, constants in zip(two, unknown[5:].reshape(2, 4), strict=True)
        ]
        return np.concatenate([part.ravel() for part in parts])

    start = np.concatenate([[*TRUE.values()], np.zeros(8)])
    best = optimize.least_squares(residuals, start, x_scale="jac", xtol=1e-12, ftol=1e-12)
    slopes = np.asarray(best.jac, dtype=np.float64)
    bound = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))[:5]
    order = [ours.index(name) for name in TRUE]
    assert np.max(np.abs(ours.estimate[order] - best.x[:5]) / bound) < 0.02
    white = np.sqrt(np.diag(ours.covariance_white))[order]
    np.testing.assert_allclose(white, bound, rtol=0.02)


@pytest.mark.parametrize("method", methods())
def test_records_of_two_rates_are_fitted_by_every_method_or_refused_in_a_line(
    method: str, two: tuple[Drawn, Drawn], model: LinearModel
) -> None:
    records = [one.maneuver() for one in two]
    if method == "output-error":
        with pytest.raises(HostError, match=r"noise .* 0\.01 and 0\.02 s .* output-error-white"):
            fit(method, model, records)
        return
    found = fit(method, model, records)
    near = 0.5 if method in CRUDE else 0.15
    assert found.value("M_alpha") == pytest.approx(TRUE["M_alpha"], rel=near)
    if method not in CRUDE:
        assert found.value("M_de") == pytest.approx(TRUE["M_de"], rel=near)


def test_records_in_one_file_are_parted_by_their_gap(two: tuple[Drawn, Drawn]) -> None:
    """Two cuts of a long flight, minutes of it left out: found, and as one stretch."""
    first, second = drawn(50.0, 1).table(), drawn(50.0, 2).table()
    table = pd.concat([first, second.assign(t_s=second["t_s"] + 300.0)])
    for stretches in (None, [(None, None)]):
        found = host.identify(table, models=model_from(MODEL), stretches=stretches)
        [answer] = found.linear
        assert [m.samples for m in answer.maneuvers] == pytest.approx([200, 200], abs=2)
        for name, value in TRUE.items():
            half = answer.result.half_width()[answer.result.index(name)]
            assert abs(answer.result.value(name) - value) < 2.0 * half, name


@pytest.mark.parametrize("rate_hz", [20.0, 100.0])
def test_a_record_of_a_second_and_a_half_is_fitted(rate_hz: float) -> None:
    tables = [drawn(rate_hz, seed, duration_s=1.55, unit_s=0.15).table() for seed in range(4)]
    found = host.identify(tables, models=model_from(MODEL), methods="output-error-white")
    [answer] = found.linear
    assert len(answer.maneuvers) + len(answer.held_out) == 4
    half = answer.result.half_width()[answer.result.index("M_alpha")]
    assert abs(answer.result.value("M_alpha") - TRUE["M_alpha"]) < 2.0 * half


@pytest.mark.parametrize(
    ("stretches", "words"),
    [
        ([[(0, 2)]], "1 for 2 flights; give a list for each flight"),
        ([(0, 2), "all"], "of flight 2 are no pairs of times"),
        (3.0, "0 for 2 flights"),
    ],
)
def test_stretches_that_are_none_say_so(
    stretches: Any, words: str, two: tuple[Drawn, Drawn]
) -> None:
    with pytest.raises(HostError, match=words):
        host.identify([one.table() for one in two], stretches=stretches)


def test_a_source_given_again_has_further_stretches(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was refused as the same samples twice."""
    first, second = (drawn(50.0, seed, duration_s=5.0) for seed in (1, 2))
    both = pd.concat([first.table(), second.table()], ignore_index=True)
    both["t_s"] = 0.02 * np.arange(len(both))
    path = tmp_path / "a.csv"
    both.to_csv(path, index=False)
    once = ["--from", "0", "--to", "4.9", "--from", "5.1", "--to", "9.9"]
    words = [
        [str(path), *once],
        [str(path), *once[:4], str(tmp_path / "." / "a.csv"), *once[4:]],
    ]
    texts = []
    for source in words:
        assert main(["identify", *source, "--model", "short-period"]) == 0
        texts.append(capsys.readouterr().out)
    assert texts[0] == texts[1]
    assert main(["identify", str(path), *once[:4], str(path)]) == 2
    assert "give each flight once, or with stretches each time" in capsys.readouterr().err
