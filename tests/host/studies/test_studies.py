"""The studies in small: their limits hold, and the programs write their tables."""

import csv
from pathlib import Path

import numpy as np
import pytest
from host.sysid.estimators import methods
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.models import free_model
from host.sysid.models.diagnostics import GRADES, NOT_IDENTIFIABLE
from host.thesis.hopfield import LAMBDA, STEP_S, largest_stable_gain, network
from studies.__main__ import main
from studies.accuracy import run_case as accuracy
from studies.flights import overlap
from studies.methods import runs_of, score
from studies.navion import INPUTS, STATES, TABLE_31_A, TABLE_31_B
from studies.refusal import (
    DT_S,
    check_refusal,
    refusal_agreement,
    repeated,
    standard_input,
)
from studies.systems import random_system
from studies.thesis import run_hopfield, thesis_data, truth_31
from studies.thesis_tables import PRINTED, obtained


def test_output_error_is_an_order_closer_than_the_network() -> None:
    case = accuracy("3-2-1-1", 100.0, 30)
    assert case.failed == 0
    assert case.shared_ratio > 10.0
    assert case.smoothed_ratio > 1.5
    assert np.all(np.abs(case.rms_over_bound - 1.0) < 0.5)


def test_table_31_is_the_one_of_the_thesis() -> None:
    """The figures that its author printed beneath it come out of the twenty numbers."""
    truth = truth_31()
    signed = {name: float(np.sum(truth - np.array(own))) for name, own in PRINTED.items()}
    assert signed["noise-free"] == pytest.approx(-0.04314389, abs=1e-8)
    assert signed["SNR 10"] == pytest.approx(1.467580966, abs=1e-8)
    assert obtained(truth) == "both"
    assert obtained(np.array(PRINTED["noise-free"])) == "both"
    assert obtained(np.array(PRINTED["SNR 10"])) == "none"
    assert obtained(np.full(20, np.nan)) == "diverged"


def test_periods_are_told_apart() -> None:
    poles, vectors = np.linalg.eig(TABLE_31_A)
    fast = np.abs(poles) > 1.0
    for moved, left in ((fast, "long"), (~fast, "short"), (fast | ~fast, "none")):
        A = (vectors @ np.diag(np.where(moved, 1.3 * poles, poles)) @ np.linalg.inv(vectors)).real
        assert obtained(np.concatenate([A.ravel(), TABLE_31_B.ravel()])) == left


def test_printed_network_diverges_and_its_figure_hides_the_error() -> None:
    maneuver = thesis_data("3-2-1-1", 100.0)
    _, W, _ = network(free_model("t", STATES, INPUTS), [maneuver])
    assert 5.0 * largest_stable_gain(W) < LAMBDA * STEP_S
    assert run_hopfield(maneuver, LAMBDA * STEP_S, 1000, what="printed").diverged
    run = run_hopfield(maneuver, 0.95 * largest_stable_gain(W), 200_000, what="stable")
    # Measured once by an independent program: 81 %, 0.023 %, 11.5 %.
    assert run.frobenius == pytest.approx(0.81, abs=0.01)
    assert run.thesis_percent == pytest.approx(0.0230, abs=0.0005)
    assert run.honest_percent == pytest.approx(11.5, abs=0.1)


def test_table_31_at_snr_10_is_refused_with_names() -> None:
    check = check_refusal(TABLE_31_A, TABLE_31_B, standard_input(), DT_S)
    assert check.judgement.not_identifiable
    assert not check.missed
    assert len(check.expected) == 16
    assert not {"a33", "b31"} & set(check.judgement.names(NOT_IDENTIFIABLE))
    assert check.agree
    assert check.plain_agree


def test_navion_is_told_with_nine_free_and_refused_with_twenty() -> None:
    table, nine, twenty = (one.checks[0] for one in repeated(1))
    assert not nine.expected
    assert not nine.judgement.flags
    assert nine.agree
    # Not for its zeros alone: a12 has a bound of 146 % of 5 % of its row, 170 % of itself.
    assert set(twenty.expected) == {"a12", "a13", "b11", "b41"}
    assert twenty.shares[1] == pytest.approx(1.464, abs=0.002)
    assert twenty.plain_shares[1] == pytest.approx(1.705, abs=0.002)
    assert np.isinf(twenty.plain_shares[[2, 7, 11, 12, 13, 15, 16, 19]]).all()
    assert twenty.judgement.not_identifiable
    assert not twenty.missed
    assert np.sum(table.plain_shares > 1.0) == 16


def test_refusal_agrees_with_the_bound_at_the_truth() -> None:
    found = refusal_agreement(10, reference=False)
    assert found.agree >= 0.8 * found.systems
    assert found.clear_agree == len(found.clear)
    assert found.firm_agree == len(found.firm)
    named, listed = found.named
    assert named >= 0.9 * listed
    for grade in GRADES:
        false, told = found.false(grade)
        assert false <= 0.3 * told
    assert 0 < found.expected < found.systems


def test_every_method_is_in_the_table_and_the_line_search_shows_its_start() -> None:
    """Started 20 % off it stays there: its figure hardly knows the parameters."""
    assert {runs_of(method, 60) for method in methods()} == {60, 10, 5}
    assert runs_of("hopfield-line-search", 12) == 1
    assert runs_of("filter-error", 12) == 2
    found = score("hopfield-line-search", "3-2-1-1, 20 Hz", 1)
    assert found.failed == 0
    assert found.error == pytest.approx(0.20, abs=0.05)


def test_random_systems_are_stable_and_drawn_as_said() -> None:
    rng = np.random.default_rng(1)
    poles = np.concatenate([np.linalg.eigvals(random_system(rng)[0]) for _ in range(2000)])
    assert np.all(poles.real < 0.0)
    faster = np.log(-poles.real[np.abs(poles.imag) < 1e-9])
    assert np.mean(faster) == pytest.approx(0.0, abs=0.05)
    assert np.std(faster) == pytest.approx(1.0, abs=0.05)
    # The last of four poles is real whatever comes; 0.36 of all come in pairs.
    turning = poles.imag[poles.imag > 1e-9]
    assert np.exp(np.mean(np.log(turning))) == pytest.approx(3.0, rel=0.08)


def test_program_writes_a_table_twice_and_a_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(tmp_path), "--only", "b_accuracy"]) == 0
    assert "b_accuracy: md, csv, svg" in capsys.readouterr().out
    text = (tmp_path / "b_accuracy.md").read_text()
    assert "Simulated data throughout" in text
    with (tmp_path / "b_accuracy.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6
    assert text.count("\n| ") == len(rows) + 2
    for row in rows:
        assert float(row["ratio of 9"]) == pytest.approx(
            float(row["Hopfield, the 9 %"]) / float(row["output error %"])
        )
    picture = (tmp_path / "b_accuracy.svg").read_text()
    assert picture.count("<clipPath") == 2  # one of each axes; names are left out


def test_overlap_counts_axis_and_both_ends() -> None:
    found = DetectedManeuver("elevator_rad", "doublet", 10.0, 11.0, 14.0, 0.05, 3)
    truth = {"axes": ["elevator"], "start_s": 10.0, "end_s": 15.0}
    assert overlap(found, truth, 1.0) == pytest.approx(0.8)
    assert overlap(found, {**truth, "axes": ["rudder"]}, 1.0) == 0.0
    assert overlap(found, {**truth, "start_s": 20.0, "end_s": 25.0}, 1.0) == 0.0
