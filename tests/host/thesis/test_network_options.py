"""Options of the network from outside: start, lambda, rho, iterations; and how it settles."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.errors import IdentificationError
from host.sysid import fit
from host.sysid.estimators import read_options
from host.sysid.estimators.method_options import check_options, options_of
from host.thesis.hopfield import network
from host.thesis.original_program import line_search
from studies.data import with_rates
from studies.navion import navion_free

from tests.host.short_period_table import identified, short_period_table


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return short_period_table(tmp_path_factory.mktemp("settling"))


def test_the_line_search_starts_where_the_study_of_the_flights_does() -> None:
    """From least squares (`studies/thesis_flights.py`), and goes the same way."""
    model, maneuver = navion_free(), with_rates(5, snr=10.0)
    found = fit("hopfield-line-search", model, [maneuver], iterations=2)
    start = fit("equation-error", model, [maneuver]).estimate
    history = np.asarray(found.details["history"])
    np.testing.assert_allclose(history[0], start)
    names, W, b = network(model, [maneuver])
    study = line_search(model, [maneuver], names, W, b, start, sweeps=2)
    np.testing.assert_array_equal(found.estimate, study.estimate)


def test_its_error_falls_in_its_history() -> None:
    found = fit("hopfield-line-search", navion_free(), [with_rates(5, snr=10.0)], iterations=3)
    errors = np.asarray(found.details["history_error_percent"])
    assert len(errors) == len(np.asarray(found.details["history"]))
    assert np.all(np.diff(errors) < 0.0)


def test_options_reach_the_search() -> None:
    """One rho, one sweep, from zero: the first coordinate by the formula of the program."""
    model, maneuver = navion_free(), with_rates(6)
    given = {"lambda": "1e-6", "rho": "-150", "iterations": "1", "start": "zero"}
    found = fit(
        "hopfield-line-search", model, [maneuver], **options_of("hopfield-line-search", given)
    )
    history = np.asarray(found.details["history"])
    assert not history[0].any()
    _, _, b = network(model, [maneuver])
    moved = np.flatnonzero(history[-1])
    assert len(moved) > 0
    first = moved[0]
    assert history[-1][first] == pytest.approx(1e-6 * 150.0**2 / -300.0 * b[first])


def test_the_printed_network_takes_lambda_with_the_step_of_the_thesis() -> None:
    model, maneuver = navion_free(), with_rates(2, snr=10.0)
    by_lambda = fit("hopfield", model, [maneuver], iterations=10, lambda_=1e-5)
    by_gain = fit("hopfield", model, [maneuver], iterations=10, gain=1e-5 * 0.00025)
    np.testing.assert_array_equal(by_lambda.estimate, by_gain.estimate)


def test_the_history_of_the_printed_network_ends_where_one_run_ends() -> None:
    model, maneuver = navion_free(), with_rates(2, snr=10.0)
    found = fit("hopfield", model, [maneuver], iterations=1000)
    steps = np.asarray(found.details["history_step"])
    assert steps[0] == 0
    assert steps[-1] == 1000
    assert found.iterations == 1000


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (["lambda"], "method option 'lambda', expected NAME=VALUE"),
        (["rho=1", "rho=2"], "rho is given twice"),
        (["gain=1"], "method option gain: hopfield has none of this name"),
        (["start=here"], "start: 'here', expected least-squares, model, zero"),
        (["rho=0"], "rho: zero"),
        (["rho=a,b"], "rho: 'a', expected a number"),
        (["iterations=2.5"], "iterations: 2.5, expected a whole number"),
        (["lambda=-1"], "lambda is -1"),
    ],
)
def test_wrong_options_are_one_line(texts: list[str], words: str) -> None:
    with pytest.raises(IdentificationError, match=words) as caught:
        given = read_options(texts)
        check_options(given, ["hopfield"])
        options_of("hopfield", given)
    assert "\n" not in str(caught.value)


def test_the_history_of_the_line_search_is_written(table: Path, tmp_path: Path) -> None:
    path = tmp_path / "new" / "h.csv"
    options = ["--method-option", "iterations=3", "--method-option", "start=model"]
    assert identified(table, "hopfield-line-search", *options, "--history", str(path)) == 0
    history = pd.read_csv(path)
    assert list(history.columns[:4]) == ["iteration", "error_percent", "Z_alpha", "Z_de"]
    assert history["Z_alpha"][0] == -5.0
    assert history["error_percent"].is_monotonic_decreasing


def test_a_search_says_what_it_lowered(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--method-option", "iterations=2", "--method-option", "start=model"]
    assert identified(table, "hopfield-line-search", *options) == 0
    out = capsys.readouterr().out
    assert "settled, within" in out
    assert "error of the original program" in out
    assert "% in 2 sweeps" in out


def test_a_search_that_stands_still_says_so(
    table: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Least squares is the fixed point of the network: no step of it is one."""
    assert identified(table, "hopfield-line-search", "--method-option", "iterations=2") == 0
    out = capsys.readouterr().out
    assert "no sweep lowered the error of the original program" in out
    assert "settled, within" not in out


def test_what_moves_until_the_end_has_not_settled(
    table: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    few = ["--method-option", "iterations=20", "--method-option", "start=zero"]
    assert identified(table, "hopfield", *few, "--json") == 0
    [answer] = json.loads(capsys.readouterr().out)["answers"]
    told = answer["settling"]
    assert (told["step"], told["end"]) == ("iteration", 20.0)
    assert "M_alpha" in told["not_settled"]
    assert all(told["since"][name] > 17.0 for name in told["not_settled"])
    assert identified(table, "equation-error", "--json") == 0
    [answer] = json.loads(capsys.readouterr().out)["answers"]
    assert answer["settling"] is None
