"""Tables 3.1 and 3.2 of the thesis re-run: what reproduces, what does not, and why.

The system of table 3.1 is a damaged NAVION whose state and input data are nearly singular; table
3.2 compares inputs and rates by a figure that divides a relative error once more by the number of
samples. Simulated data; input 0.1 rad, 20 s, from zero start, SNR 10 as ratio of variances.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import linalg, signal, special

from host.compiled import Array
from host.sysid.errors import IdentificationError
from host.sysid.estimators.fit import fit
from host.sysid.estimators.hopfield import (
    ITERATIONS,
    LAMBDA,
    RHO,
    STEP_S,
    iterate,
    largest_stable_gain,
    network,
)
from host.sysid.models.diagnostics import (
    exceedance,
    references,
    refusals,
    thesis_program_error_percent,
)
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.model import LinearModel, free_model
from host.sysid.numerics.output_error import covariance_of, minimise
from host.sysid.numerics.problem import OutputProblem
from host.sysid.study.aircraft import INPUTS, STATES, TABLE_31_A, TABLE_31_B
from host.sysid.study.inputs import SHAPES

AMPLITUDE_RAD = 0.1
DURATION_S = 20.0
SNR = 10.0
SURE = 0.95  # probability from which on the fit calls its own decision firm


def simulated(A: Array, B: Array, u: Array, dt_s: float) -> Array:
    """Return the states of a linear system from rest under a held input, (samples, n)."""
    n = len(A)
    discrete = signal.cont2discrete((A, B, np.eye(n), np.zeros((n, u.shape[1]))), dt_s)
    x = np.zeros((len(u), n))
    for k in range(len(u) - 1):
        x[k + 1] = discrete[0] @ x[k] + discrete[1] @ u[k]
    return x


def thesis_data(shape: str, rate_hz: float, *, snr: float = np.inf, seed: int = 1) -> Maneuver:
    """Return states and rates of the system of table 3.1, both with noise."""
    dt_s = 1.0 / rate_hz
    u = SHAPES[shape](AMPLITUDE_RAD, dt_s, DURATION_S)
    x = simulated(TABLE_31_A, TABLE_31_B, u, dt_s)
    rates = x @ TABLE_31_A.T + u @ TABLE_31_B.T
    rng = np.random.default_rng(seed)
    noisy = [
        s + np.sqrt(np.mean(s**2, axis=0) / snr) * rng.standard_normal(s.shape) for s in (x, rates)
    ]
    return Maneuver(dt_s, u, noisy[0], rates=noisy[1], name=f"{shape} {rate_hz:.0f} Hz")


def truth_31() -> Array:
    """Return the twenty parameters in the order of the table."""
    return np.concatenate([TABLE_31_A.ravel(), TABLE_31_B.ravel()])


@dataclass(frozen=True)
class HopfieldRun:
    """One Hopfield run judged by parameters and by the figure of the thesis."""

    what: str
    seconds: float
    iterations: int
    diverged: bool
    frobenius: float
    thesis_percent: float
    honest_percent: float


def run_hopfield(maneuver: Maneuver, gain: float, iterations: int, *, what: str) -> HopfieldRun:
    """Run the printed iteration from zero and judge its answer on the same input."""
    model = free_model("table 3.1", STATES, INPUTS)
    _, W, b = network(model, [maneuver])
    truth = truth_31()
    iterate(W, b, np.zeros(20), gain, RHO, 1, 1e6)
    begin = time.perf_counter()
    beta, done = iterate(W, b, np.zeros(20), gain, RHO, iterations, 1e6)
    seconds = time.perf_counter() - begin
    u = maneuver.inputs
    x = simulated(TABLE_31_A, TABLE_31_B, u, maneuver.dt_s)
    if done < iterations or not np.isfinite(beta).all():
        nan = float("nan")
        return HopfieldRun(what, seconds, done, True, nan, nan, nan)
    A, B, _, _ = model.matrices(beta)
    with np.errstate(over="ignore", invalid="ignore"):
        answer = simulated(A, B, u, maneuver.dt_s)
        thesis = thesis_program_error_percent(x, answer)
    return HopfieldRun(
        what=what,
        seconds=seconds,
        iterations=done,
        diverged=False,
        frobenius=float(np.linalg.norm(beta - truth) / np.linalg.norm(truth)),
        thesis_percent=thesis,
        honest_percent=thesis * len(x) / 4.0,
    )


def table_32(iterations: int = ITERATIONS) -> list[HopfieldRun]:
    """Run every input and rate of table 3.2 with the printed step and with the largest stable."""
    runs = []
    model = free_model("table 3.1", STATES, INPUTS)
    for shape in SHAPES:
        for rate_hz in (100.0, 20.0):
            maneuver = thesis_data(shape, rate_hz)
            _, W, _ = network(model, [maneuver])
            limit = largest_stable_gain(W)
            label = f"{shape} {rate_hz:.0f} Hz"
            printed = run_hopfield(
                maneuver,
                LAMBDA * STEP_S,
                iterations,
                what=f"{label}, printed step ({LAMBDA * STEP_S / limit:.2g} of the stable one)",
            )
            runs.append(printed)
            runs.append(
                run_hopfield(
                    maneuver, 0.95 * limit, iterations, what=f"{label}, largest stable step"
                )
            )
    return runs


@dataclass(frozen=True)
class RefusalCheck:
    """What was refused, and what the analytic bound at the truth says should be.

    Attributes
    ----------
    refused, expected : tuple of str
        Parameters named by the fit, and those whose bound at the truth exceeds their value.
    worst_share : float
        Largest analytic bound over its reference value.
    probability : float
        Of the fit, which knows neither truth nor noise, that some bound exceeds 100 %.
    shares : Array
        Analytic bounds over reference values, every parameter.
    """

    refused: tuple[str, ...]
    expected: tuple[str, ...]
    worst_share: float
    probability: float
    shares: Array

    @property
    def agree(self) -> bool:
        """Whether the fit is refused exactly when the bound at the truth says so."""
        return bool(self.refused) == bool(self.expected)

    @property
    def firm(self) -> bool:
        """Whether the fit itself is sure of its decision."""
        return not 1.0 - SURE < self.probability < SURE


def analytic_bounds(
    model: LinearModel, truth: Array, inputs: Array, dt_s: float, snr: float
) -> tuple[Array, Array]:
    """Return Cramer-Rao bounds at the truth over reference values, and the noise deviations."""
    n = len(model.states)
    blank = Maneuver(dt_s, inputs, np.zeros((len(inputs), n)))
    start = np.concatenate([truth, np.zeros(n)])
    response = OutputProblem(model, [blank]).respond(start)
    if response is None:
        raise IdentificationError("the truth model diverges over this maneuver")
    y = response[0].y.T
    deviation = np.sqrt(np.mean(y**2, axis=0) / snr)
    spotless = Maneuver(dt_s, inputs, y)
    at_truth = minimise(
        OutputProblem(model, [spotless]), start, variance=deviation**2, max_iterations=0
    )
    bound = np.sqrt(np.diag(covariance_of(at_truth.information, at_truth.free)))
    reference = references(model, [spotless], truth)
    return bound[: len(truth)] / reference, deviation


def check_refusal(
    A: Array,
    B: Array,
    inputs: Array,
    dt_s: float,
    *,
    snr: float = SNR,
    seed: int = 1,
    from_truth: bool = False,
) -> RefusalCheck:
    """Fit every entry of A and B by output error to noisy states; compare refusals with truth.

    With `from_truth` the search begins at the truth: what a perfect search could know.
    """
    n = len(A)
    names = tuple(f"x{k}" for k in range(n))
    truth = np.concatenate([A.ravel(), B.ravel()])
    model = free_model("random", names, tuple(f"u{k}" for k in range(B.shape[1])))
    share, deviation = analytic_bounds(model, truth, inputs, dt_s, snr)
    y = simulated(A, B, inputs, dt_s)
    rng = np.random.default_rng(seed)
    maneuver = Maneuver(dt_s, inputs, y + deviation * rng.standard_normal(y.shape))
    expected = tuple(name for name, s in zip(model.parameter_names, share, strict=True) if s > 1.0)
    start = np.concatenate([truth, np.zeros(n)]) if from_truth else None
    try:
        result = fit("output-error", model, [maneuver], start=start)
        refused = tuple(r.name for r in refusals(result, [maneuver]))
        probability = exceedance(result, [maneuver])[1]
    except IdentificationError:
        refused, probability = model.parameter_names, 1.0
    return RefusalCheck(refused, expected, float(share.max()), probability, share)


def random_system(rng: np.random.Generator, states: int = 4) -> tuple[Array, Array]:
    """Return a stable system of one input as `rss` of MATLAB and python-control draws it.

    Every pole repeats the one before it with probability 0.05, else it is real with probability
    0.6; real parts are minus log-normal, imaginary parts three times log-normal, both with unit
    deviation in the logarithm. States are mixed by a normal matrix; each entry of B is normal and
    kept with probability 0.8.
    """
    blocks: list[Array] = []
    left = states
    while left > 0:
        if blocks and left >= len(blocks[-1]) and left > 1 and rng.random() < 0.05:
            block = blocks[-1]
        elif left == 1 or rng.random() < 0.6:
            block = np.array([[-np.exp(rng.standard_normal())]])
        else:
            real, imaginary = -np.exp(rng.standard_normal()), 3.0 * np.exp(rng.standard_normal())
            block = np.array([[real, imaginary], [-imaginary, real]])
        blocks.append(block)
        left -= len(block)
    mix = rng.standard_normal((states, states))
    A = np.linalg.solve(mix, linalg.block_diag(*blocks) @ mix)
    B = rng.standard_normal((states, 1))
    while True:
        kept = rng.random((states, 1)) < 0.8
        if kept.any():
            return A, B * kept


def mixed_modes(rng: np.random.Generator) -> tuple[Array, Array]:
    """Return a stable system of two to four states and one input, harder to decide about.

    Poles are drawn between 0.3 and 6 rad/s with damping 0.1 to 1, then mixed by a random change of
    states near the identity: most entries count, and more bounds lie near 100 %.
    """
    n = int(rng.integers(2, 5))
    blocks: list[Array] = []
    for _ in range(n // 2):
        frequency = float(np.exp(rng.uniform(np.log(0.3), np.log(6.0))))
        damping = rng.uniform(0.1, 1.0)
        turn = frequency * np.sqrt(1.0 - damping**2)
        blocks.append(np.array([[-damping * frequency, turn], [-turn, -damping * frequency]]))
    if n % 2:
        blocks.append(np.array([[-np.exp(rng.uniform(np.log(0.3), np.log(6.0)))]]))
    mix = np.eye(n) + 0.5 * rng.standard_normal((n, n))
    while np.linalg.cond(mix) > 20.0:
        mix = np.eye(n) + 0.5 * rng.standard_normal((n, n))
    A = mix @ linalg.block_diag(*blocks) @ np.linalg.inv(mix)
    return A, mix @ rng.standard_normal((n, 1))


DRAWS: dict[str, Callable[[np.random.Generator], tuple[Array, Array]]] = {
    "rss, 4 states": random_system,
    "mixed modes, 2-4 states": mixed_modes,
}


@dataclass(frozen=True)
class Agreement:
    """How often a fit is refused exactly when the bound at the truth says so.

    A parameter whose bound is about its value is estimated as anything between zero and twice it,
    so no rule can be right near 100 %. `ideal` is the expected share of an observer who knows which
    parameter is worst, its bound and the best threshold, and has only its estimate. `clear` leaves
    out systems whose true worst bound lies within a factor of two of the limit; `firm` keeps those
    whose fit says by itself that it is sure. `from_truth` has the same systems where the search
    began at the truth.
    """

    draw: str
    checks: tuple[RefusalCheck, ...]
    from_truth: tuple[RefusalCheck, ...]

    @property
    def systems(self) -> int:
        """Number of systems."""
        return len(self.checks)

    @property
    def agree(self) -> int:
        """Systems refused exactly when they should be."""
        return sum(c.agree for c in self.checks)

    @property
    def clear(self) -> tuple[RefusalCheck, ...]:
        """Systems whose worst bound at the truth is not between 50 and 200 %."""
        return tuple(c for c in self.checks if not 0.5 <= c.worst_share <= 2.0)

    @property
    def firm(self) -> tuple[RefusalCheck, ...]:
        """Systems of which the fit says that its decision is clear."""
        return tuple(c for c in self.checks if c.firm)

    @property
    def clear_agree(self) -> int:
        """Agreement among the clear ones."""
        return sum(c.agree for c in self.clear)

    @property
    def firm_agree(self) -> int:
        """Agreement among the firm ones."""
        return sum(c.agree for c in self.firm)

    @property
    def expected(self) -> int:
        """Systems that the bound at the truth refuses."""
        return sum(bool(c.expected) for c in self.checks)

    @property
    def ideal(self) -> float:
        """Expected agreement of the ideal observer of the worst parameter."""
        distance = np.array([1.0 / c.worst_share for c in self.checks])
        shares = []
        for threshold in np.linspace(0.8, 2.0, 25):
            below = special.ndtr(threshold - distance) - special.ndtr(-threshold - distance)
            shares.append(float(np.mean(np.where(distance < 1.0, below, 1.0 - below))))
        return max(shares)


def refusal_agreement(
    systems: int, *, draw: str = "rss, 4 states", seed: int = 20260301, reference: bool = True
) -> Agreement:
    """Check refusal on random stable systems: every entry free, SNR 10, 3-2-1-1, 100 Hz, 20 s.

    Parameters
    ----------
    systems : int
    draw : str
        A key of `DRAWS`.
    seed : int
    reference : bool
        Fit each system from the truth too.
    """
    u = SHAPES["3-2-1-1"](AMPLITUDE_RAD, 0.01, DURATION_S)
    checks: tuple[list[RefusalCheck], list[RefusalCheck]] = ([], [])
    for k in range(systems):
        A, B = DRAWS[draw](np.random.default_rng([seed, k]))
        for from_truth in (False, True) if reference else (False,):
            checks[from_truth].append(check_refusal(A, B, u, 0.01, seed=k, from_truth=from_truth))
    return Agreement(draw, tuple(checks[0]), tuple(checks[1]))


def agreement_text(found: Agreement) -> str:
    """Return the figures of refusal in one sentence."""

    def share(part: int, whole: int) -> str:
        return f"{part} of {whole} ({100.0 * part / max(whole, 1):.1f} %)"

    truth = sum(c.agree for c in found.from_truth)
    return (
        f"refusal on random stable systems ({found.draw}) agrees with the analytic bound in"
        f" {share(found.agree, found.systems)}; the same decision after a search from the truth in"
        f" {share(truth, len(found.from_truth))}; an ideal observer of the worst parameter alone"
        f" {100.0 * found.ideal:.1f} %; in {share(found.clear_agree, len(found.clear))} whose worst"
        f" bound is not between 50 and 200 %, in {share(found.firm_agree, len(found.firm))} where"
        f" the fit is {100.0 * SURE:.0f} % sure; {found.expected} refused by the bound"
    )


def main(arguments: list[str] | None = None) -> int:
    """Print both tables and the refusals."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--iterations", type=int, default=ITERATIONS)
    parser.add_argument("--systems", type=int, default=200)
    options = parser.parse_args(arguments)
    write = sys.stdout.write
    write("table 3.2 re-run (noise-free): parameter error beside the thesis's own figure\n")
    for run in table_32(options.iterations):
        verdict = (
            "diverged"
            if run.diverged
            else (
                f"parameters {100.0 * run.frobenius:5.1f} %"
                f"  thesis figure {run.thesis_percent:8.4f} %"
                f"  honest per state {run.honest_percent:7.2f} %"
            )
        )
        write(f"  {run.what:60s} {verdict}  {run.iterations} iterations {run.seconds:.3f} s\n")
    write("table 3.1 at SNR 10, 3-2-1-1, 100 Hz: output error, 20 free entries\n")
    u = SHAPES["3-2-1-1"](AMPLITUDE_RAD, 0.01, DURATION_S)
    check = check_refusal(TABLE_31_A, TABLE_31_B, u, 0.01)
    write(f"  refused:  {' '.join(check.refused)}\n  analytic: {' '.join(check.expected)}\n")
    for draw in DRAWS:
        write(agreement_text(refusal_agreement(options.systems, draw=draw)) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
