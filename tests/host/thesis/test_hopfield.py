"""The network reaches least squares, slowly; whitened, at once; and says when it has not."""

import numpy as np
import pytest
from host.errors import IdentificationError
from host.sysid import fit
from host.sysid.numerics import OutputProblem
from host.thesis.error_figures import thesis_program_error_percent
from host.thesis.hopfield import (
    LAMBDA,
    RHO,
    STEP_S,
    largest_stable_gain,
    network,
)
from host.thesis.original_program import line_search
from studies.data import with_rates
from studies.navion import navion_free


def test_whitened_network_is_least_squares() -> None:
    maneuver = with_rates(1, snr=10.0)
    network_result = fit("hopfield-whitened", navion_free(), [maneuver], iterations=60)
    least_squares = fit("equation-error", navion_free(), [maneuver])
    np.testing.assert_allclose(network_result.estimate, least_squares.estimate, rtol=1e-6)
    assert network_result.converged


def test_printed_iteration_moves_like_the_equation() -> None:
    """Three iterations against the printed formula written out in numpy."""
    maneuver = with_rates(2, snr=10.0)
    _, W, b = network(navion_free(), [maneuver])
    gain = 0.5 * largest_stable_gain(W)
    beta = np.zeros(20)
    for _ in range(3):
        beta = beta + gain * (RHO**2 - beta**2) / (2.0 * RHO) * (W @ beta + b)
    result = fit("hopfield", navion_free(), [maneuver], iterations=3, gain=gain)
    np.testing.assert_allclose(result.estimate, beta, rtol=1e-12)
    assert not result.converged
    assert "away from its own fixed point" in result.warnings[0]


def test_stability_limit_is_where_it_says() -> None:
    maneuver = with_rates(3, snr=10.0)
    _, W, b = network(navion_free(), [maneuver])
    limit = largest_stable_gain(W)
    stiffest = np.linalg.eigh(W)[1][:, 0]
    miss = []
    for factor in (0.95, 1.05):
        result = fit("hopfield", navion_free(), [maneuver], iterations=3000, gain=factor * limit)
        miss.append(abs(stiffest @ (W @ result.estimate + b)))
    assert miss[0] < 1e-6 * miss[1]
    with pytest.raises(IdentificationError, match="diverged"):
        fit("hopfield", navion_free(), [maneuver], iterations=20000, gain=8.0 * limit)


def test_network_signs_are_the_text_not_the_program() -> None:
    _, W, b = network(navion_free(), [with_rates(4)])
    assert np.all(np.diag(W) < 0.0)
    A, B, _, _ = fit("equation-error", navion_free(), [with_rates(4)]).matrices()
    truth = np.concatenate([A.ravel(), B.ravel()])
    assert np.linalg.norm(W @ truth + b) < 1e-6 * np.linalg.norm(b)
    assert pytest.approx(2.5e-7) == LAMBDA * STEP_S


def test_original_line_search_lowers_the_figure_it_prints() -> None:
    maneuver = with_rates(5, snr=1e4)
    model = navion_free()
    names, W, b = network(model, [maneuver])
    truth = fit("equation-error", model, [maneuver]).estimate
    start = 0.97 * truth
    end = line_search(model, [maneuver], names, W, b, start, sweeps=2).estimate

    def figure(beta: np.ndarray) -> float:
        problem = OutputProblem(model, [maneuver])
        response = problem.respond(np.concatenate([beta, maneuver.outputs[0]]))
        assert response is not None
        return thesis_program_error_percent(maneuver.outputs, response[0].y.T)

    assert figure(end) < 0.9 * figure(start)
