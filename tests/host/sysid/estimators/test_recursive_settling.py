"""How recursive estimates settle, what they forget, and a method that notes nothing."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.sysid import fit
from studies.data import with_rates
from studies.navion import navion_free

from tests.campaign import every_nth
from tests.host.short_period_table import identified, short_period_table


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return short_period_table(tmp_path_factory.mktemp("settling"))


@pytest.mark.parametrize("method", ["recursive", "recursive-fourier"])
def test_how_recursive_settles_is_written(table: Path, tmp_path: Path, method: str) -> None:
    path = tmp_path / "h.csv"
    assert identified(table, method, "--history", str(path)) == 0
    history = pd.read_csv(path)
    assert history["t_s"].is_monotonic_increasing
    assert history["M_alpha"].iloc[-1] == pytest.approx(-80.0, rel=0.1)
    error = (history["M_alpha"] + 80.0).abs()
    assert error.iloc[-1] < max(0.5 * error.max(), 0.5)  # of 80: the first may be right already


@pytest.mark.parametrize("forgetting", every_nth([0.98, 0.99], 2))
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
    # Said before the work: this is not even a table.
    (tmp_path / "gone.csv").write_text("no table")
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
