"""Options of the network from outside: start, lambda, rho, iterations; and how methods settle."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.errors import IdentificationError
from host.sysid import fit
from host.sysid.estimators.hopfield import line_search, network
from host.sysid.estimators.method_options import check_options, options_of, read_options
from scipy.signal import lsim
from studies.aircraft import navion_free
from studies.data import with_rates


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


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short period with two elevator doublets as a CSV."""
    t = np.arange(0.0, 16.0, 0.02)
    de = sum(
        0.06 * (((t >= a) & (t < a + 0.3)).astype(float) - ((t >= a + 0.3) & (t < a + 0.6)))
        for a in (2.0, 9.0)
    )
    A, B = np.array([[-6.0, 1.0], [-80.0, -9.0]]), np.array([[-0.9], [-90.0]])
    _, _, x = lsim((A, B, np.eye(2), np.zeros((2, 1))), de, t)
    x += 3e-4 * np.random.default_rng(1).standard_normal(x.shape)
    path = tmp_path_factory.mktemp("settling") / "t.csv"
    columns = {"t_s": t, "airspeed_mps": 17.0 + 0.01 * np.sin(t), "elevator_rad": de}
    pd.DataFrame(columns | {"alpha_rad": x[:, 0], "q_radps": x[:, 1]}).to_csv(path, index=False)
    return path


def identified(table: Path, method: str, *more: str) -> int:
    words = ["identify", str(table), "--model", "short-period", "--method", method, "--full", *more]
    return main(words)


def test_the_history_of_the_line_search_is_written(table: Path, tmp_path: Path) -> None:
    path = tmp_path / "new" / "h.csv"
    options = ["--method-option", "iterations=3", "--method-option", "start=model"]
    assert identified(table, "hopfield-line-search", *options, "--history", str(path)) == 0
    history = pd.read_csv(path)
    assert list(history.columns[:4]) == ["iteration", "error_percent", "Z_alpha", "Z_de"]
    assert history["Z_alpha"][0] == -5.0
    assert history["error_percent"].is_monotonic_decreasing


@pytest.mark.parametrize("method", ["recursive", "recursive-fourier"])
def test_how_recursive_settles_is_written(table: Path, tmp_path: Path, method: str) -> None:
    path = tmp_path / "h.csv"
    assert identified(table, method, "--history", str(path)) == 0
    history = pd.read_csv(path)
    assert history["t_s"].is_monotonic_increasing
    assert history["M_alpha"].iloc[-1] == pytest.approx(-80.0, rel=0.1)
    error = (history["M_alpha"] + 80.0).abs()
    assert error.iloc[-1] < max(0.5 * error.max(), 0.5)  # of 80: the first may be right already


@pytest.mark.parametrize("forgetting", [0.99, 0.98])
def test_intervals_are_those_of_what_was_not_forgotten(forgetting: float) -> None:
    """Over sixty draws of noise the half-width is twice the scatter (a tenth of it before)."""
    model = navion_free()
    found = [
        fit("recursive", model, [with_rates(seed, snr=10.0)], forgetting=forgetting)
        for seed in range(60)
    ]
    scatter = np.std([r.estimate for r in found], axis=0, ddof=1)
    half = np.median([r.half_width() for r in found], axis=0)
    share = half / scatter
    assert 1.5 < np.median(share) < 3.0
    assert np.all(share > 0.8)


def test_nothing_forgotten_leaves_the_intervals_of_the_regression() -> None:
    model, data = navion_free(), [with_rates(1, snr=10.0)]
    batch, whole = fit("equation-error", model, data), fit("recursive", model, data)
    np.testing.assert_array_equal(whole.half_width(), batch.half_width())


def test_a_bias_of_a_maneuver_long_forgotten_has_an_interval() -> None:
    model = replace(navion_free(), state_biases=("q_radps",))
    found = fit("recursive", model, [with_rates(k, snr=10.0) for k in (1, 2)], forgetting=0.5)
    assert np.all(found.half_width() > 0.0)
    assert np.isfinite(found.half_width()).all()


def test_a_method_that_does_not_settle_has_no_history(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "h.csv"
    assert identified(table, "equation-error", "--history", str(path)) == 2
    assert "no method here notes how it settles" in capsys.readouterr().err
    assert not path.exists()
    # Said before the work: this table is not even there.
    gone, options = (
        str(tmp_path / "gone.csv"),
        ("--method", "equation-error", "--method", "genetic"),
    )
    assert main(["identify", gone, *options, "--history", str(path)]) == 2
    said = capsys.readouterr().err
    assert "--history" in said and "no method here notes how it settles" in said


def test_the_answer_says_since_when_it_settled(
    table: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert identified(table, "recursive") == 0
    [line] = [x for x in capsys.readouterr().out.splitlines() if "settled, within 10 %" in x]
    settled, *rest = line.split("): ")[1].split("; ")
    since = {x.split()[0]: float(x.split()[1]) for x in settled.split(", ")}
    assert 0.0 < since["M_alpha"] < 5.0
    assert identified(table, "recursive", "--json") == 0
    [answer] = json.loads(capsys.readouterr().out)["answers"]
    told = answer["settling"]
    assert told["step"] == "t_s"
    settled_since = {k: v for k, v in told["since"].items() if k not in told["not_settled"]}
    assert {k: round(v, 2) for k, v in settled_since.items()} == since
    assert [x.removeprefix("not settled: ") for x in rest] == (
        [", ".join(told["not_settled"])] if told["not_settled"] else []
    )
    options = ["--method-option", "iterations=2", "--method-option", "start=model"]
    assert identified(table, "hopfield-line-search", *options) == 0
    assert "error of the original program" in capsys.readouterr().out


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
