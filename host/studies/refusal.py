"""Refusal against the analytic Cramer-Rao bound: of one system, and of many drawn at random.

A fit knows neither the truth nor the noise; it should be refused exactly when some bound at the
truth exceeds its value. Simulated data, every entry of A and B free, states with white noise.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators import fit
from host.sysid.models import LinearModel, Maneuver, free_model
from host.sysid.models.diagnostics import (
    EVEN_ODDS,
    NOT_IDENTIFIABLE,
    RELATIVE_BOUND_LIMIT,
    WEAKLY_IDENTIFIABLE,
    Identifiability,
    IdentifiabilityFlag,
    assess_identifiability,
    bound_exceedance_probability,
    reference_values,
)
from host.sysid.numerics import OutputProblem, covariance_of_free, minimise
from scipy import special

from studies.inputs import SHAPES
from studies.navion import TABLE_31_A, TABLE_31_B, navion, navion_structured
from studies.systems import DRAWS

AMPLITUDE_RAD = 0.1
DURATION_S = 20.0
DT_S = 0.01
SNR = 10.0
SURE = 0.95  # probability from which on the fit calls its own decision firm


def standard_input() -> Array:
    """Return the 3-2-1-1 of every check, (samples, 1), rad, one sample every `DT_S`."""
    return SHAPES["3-2-1-1"](AMPLITUDE_RAD, DT_S, DURATION_S)


@dataclass(frozen=True)
class RefusalCheck:
    """What a fit says of its parameters, and what the analytic bound at the truth says.

    Attributes
    ----------
    names : tuple of str
    judgement : Identifiability
        Judgement of the fit, which knows neither truth nor noise.
    shares : Array
        Analytic bounds over reference values: |parameter|, or what would contribute 5 % of its row.
    plain_shares : Array
        The same over |parameter| alone, infinite for a true zero.
    plain_probability : float
        Probability by the fit that some bound exceeds 100 % of |parameter|.
    """

    names: tuple[str, ...]
    judgement: Identifiability
    shares: Array
    plain_shares: Array
    plain_probability: float

    @property
    def expected(self) -> tuple[str, ...]:
        """Parameters whose bound at the truth exceeds their reference value."""
        return tuple(
            n for n, s in zip(self.names, self.shares, strict=True) if s > RELATIVE_BOUND_LIMIT
        )

    @property
    def worst_share(self) -> float:
        """Largest analytic bound over its reference value."""
        return float(self.shares.max())

    @property
    def agree(self) -> bool:
        """Whether the fit is refused exactly when the bound at the truth says so."""
        return self.judgement.not_identifiable == bool(self.expected)

    @property
    def plain_agree(self) -> bool:
        """The same where every bound is compared with |parameter| alone."""
        return (self.plain_probability > EVEN_ODDS) == bool(
            self.plain_shares.max() > RELATIVE_BOUND_LIMIT
        )

    @property
    def firm(self) -> bool:
        """Whether the fit itself is sure of its decision."""
        return not 1.0 - SURE < self.judgement.probability < SURE

    @property
    def missed(self) -> tuple[str, ...]:
        """Parameters of the analytic list that neither grade names."""
        return tuple(n for n in self.expected if n not in self.judgement.names())

    def false(self, grade: str) -> tuple[str, ...]:
        """Names of a grade that are not on the analytic list."""
        return tuple(n for n in self.judgement.names(grade) if n not in self.expected)


def analytic_bounds(
    model: LinearModel, truth: Array, inputs: Array, dt_s: float, snr: float
) -> tuple[Maneuver, Array, Array]:
    """Return the motion without noise, its Cramer-Rao bounds at the truth, and the noise.

    Returns
    -------
    spotless : Maneuver
    bound : Array, shape (parameters,)
        Standard deviations of an efficient estimator, initial states estimated too.
    deviation : Array, shape (states,)
        Deviation of the noise that gives `snr` as ratio of variances.

    Raises
    ------
    IdentificationError
        If the truth model diverges over this maneuver.
    """
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
    bound = np.sqrt(np.diag(covariance_of_free(at_truth.information, at_truth.free)))
    return spotless, bound[: len(truth)], deviation


def check_model(
    model: LinearModel,
    truth: Array,
    inputs: Array,
    dt_s: float,
    *,
    snr: float = SNR,
    seed: int = 1,
    from_truth: bool = False,
) -> RefusalCheck:
    """Fit a model by output error to noisy states; compare its judgement with the analytic bound.

    With `from_truth` the search begins at the truth: what a perfect search could know.
    """
    spotless, bound, deviation = analytic_bounds(model, truth, inputs, dt_s, snr)
    y = spotless.outputs
    rng = np.random.default_rng(seed)
    maneuver = Maneuver(dt_s, inputs, y + deviation * rng.standard_normal(y.shape))
    start = np.concatenate([truth, np.zeros(len(model.states))]) if from_truth else None
    try:
        result = fit("output-error", model, [maneuver], start=start)
        judgement = assess_identifiability(result, [maneuver])
        plain = bound_exceedance_probability(result, [maneuver], small_share=0.0)[1]
    except IdentificationError as error:
        every = (
            IdentifiabilityFlag(n, np.inf, 1.0, NOT_IDENTIFIABLE, str(error))
            for n in model.parameter_names
        )
        judgement, plain = Identifiability(1.0, tuple(every)), 1.0
    size = np.abs(truth)
    return RefusalCheck(
        names=model.parameter_names,
        judgement=judgement,
        shares=bound / reference_values(model, [spotless], truth),
        plain_shares=np.divide(bound, size, out=np.full(len(size), np.inf), where=size > 0.0),
        plain_probability=plain,
    )


def check_refusal(
    A: Array, B: Array, inputs: Array, dt_s: float, *, seed: int = 1, from_truth: bool = False
) -> RefusalCheck:
    """Check a system of which every entry of A and B is free."""
    names = tuple(f"x{k}" for k in range(len(A)))
    model = free_model("random", names, tuple(f"u{k}" for k in range(B.shape[1])))
    truth = np.concatenate([A.ravel(), B.ravel()])
    return check_model(model, truth, inputs, dt_s, seed=seed, from_truth=from_truth)


@dataclass(frozen=True)
class Repeated:
    """One system checked with many noise seeds."""

    what: str
    checks: tuple[RefusalCheck, ...]

    @property
    def text(self) -> str:
        """What is refused and named, and how often, in one line."""
        runs, first = len(self.checks), self.checks[0]
        listed = len(first.expected)
        lost = Counter(name for c in self.checks for name in c.missed)
        worst = ", ".join(f"{name} {count}" for name, count in lost.most_common(3)) or "none"
        identifiable = runs * (len(first.names) - listed)
        false = [
            sum(len(c.false(grade)) for c in self.checks)
            for grade in (NOT_IDENTIFIABLE, WEAKLY_IDENTIFIABLE)
        ]
        return (
            f"{self.what}: refused on {sum(c.judgement.not_identifiable for c in self.checks)}"
            f" of {runs} noise seeds; analytic list {' '.join(first.expected) or 'empty'}"
            " (compared with |parameter| alone:"
            f" {int(np.sum(first.plain_shares > RELATIVE_BOUND_LIMIT))} names);"
            f" whole list in one of the two grades on {sum(not c.missed for c in self.checks)},"
            f" names {runs * listed - lost.total()} of {runs * listed}, most often missed: {worst};"
            f" false names: {false[0]} '{NOT_IDENTIFIABLE}',"
            f" {false[1]} '{WEAKLY_IDENTIFIABLE}' of {identifiable}"
        )


def repeated(seeds: int) -> tuple[Repeated, ...]:
    """Check table 3.1, the NAVION with nine derivatives free and with all twenty, seed by seed."""
    u, noise = standard_input(), range(1, seeds + 1)
    navion_A, navion_B = navion()
    nine = navion_structured()
    return (
        Repeated(
            "table 3.1, 20 free",
            tuple(check_refusal(TABLE_31_A, TABLE_31_B, u, DT_S, seed=k) for k in noise),
        ),
        Repeated(
            "NAVION, 9 free",
            tuple(check_model(nine, nine.start, u, DT_S, seed=k) for k in noise),
        ),
        Repeated(
            "NAVION, 20 free",
            tuple(check_refusal(navion_A, navion_B, u, DT_S, seed=k) for k in noise),
        ),
    )


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
    def plain_agree(self) -> int:
        """The same where every bound is compared with |parameter| alone."""
        return sum(c.plain_agree for c in self.checks)

    @property
    def named(self) -> tuple[int, int]:
        """Parameters above their bound at the truth that a grade names, and all such."""
        listed = sum(len(c.expected) for c in self.checks)
        return listed - sum(len(c.missed) for c in self.checks), listed

    def false(self, grade: str) -> tuple[int, int]:
        """Names of a grade below their bound at the truth, and all such parameters."""
        identifiable = sum(len(c.names) - len(c.expected) for c in self.checks)
        return sum(len(c.false(grade)) for c in self.checks), identifiable

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
    u = standard_input()
    checks: tuple[list[RefusalCheck], list[RefusalCheck]] = ([], [])
    for k in range(systems):
        A, B = DRAWS[draw](np.random.default_rng([seed, k]))
        for from_truth in (False, True) if reference else (False,):
            checks[from_truth].append(check_refusal(A, B, u, DT_S, seed=k, from_truth=from_truth))
    return Agreement(draw, tuple(checks[0]), tuple(checks[1]))


def agreement_text(found: Agreement) -> str:
    """Return the figures of refusal in one sentence."""

    def share(part: int, whole: int) -> str:
        return f"{part} of {whole} ({100.0 * part / max(whole, 1):.1f} %)"

    truth = sum(c.agree for c in found.from_truth)
    return (
        f"refusal on random stable systems ({found.draw}) agrees with the analytic bound in"
        f" {share(found.agree, found.systems)}, where bounds are compared with |parameter| alone in"
        f" {share(found.plain_agree, found.systems)}; the same decision after a search from the"
        f" truth in {share(truth, len(found.from_truth))}; an ideal observer of the worst parameter"
        f" alone {100.0 * found.ideal:.1f} %; in {share(found.clear_agree, len(found.clear))} whose"
        f" worst bound is not between 50 and 200 %, in {share(found.firm_agree, len(found.firm))}"
        f" where the fit is {100.0 * SURE:.0f} % sure; {found.expected} refused by the bound; of"
        f" parameters above their bound {share(*found.named)} are in one of the two grades, of the"
        f" others {share(*found.false(NOT_IDENTIFIABLE))} '{NOT_IDENTIFIABLE}',"
        f" {share(*found.false(WEAKLY_IDENTIFIABLE))} '{WEAKLY_IDENTIFIABLE}'"
    )
