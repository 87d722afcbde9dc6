"""The score is proper, shares are of everything, and the truth of the worn aircraft is its own."""

import csv
from pathlib import Path

import numpy as np
import pytest
from host.sysid.answer import CAREFUL, MARKS, TRUSTED
from studies.field_records.best_two_states import best_moments
from studies.field_records.ranges import draw
from studies.field_records.record_flight import drawn_aircraft
from studies.field_records.true_derivatives import short_period_radps, true_derivatives
from studies.field_records.worn_aeroplane import DENSITY_KGPM3, EPSILON, STATES, motion
from studies.judgement import __main__ as program
from studies.judgement.default_errors import with_default_errors
from studies.judgement.interval_score import Judged, interval_score, judged
from studies.judgement.judged_rows import COLUMNS, DERIVATIVES, MISSING, MODE, PRINCIPAL
from studies.judgement.scaled_figures import figures, rms_errors, shares
from studies.judgement.trainer_flights import truth_of
from studies.judgement.worlds import WORLDS

REFUSED, SMALL = MARKS[3], MARKS[2]
SPEED_MPS = 18.0


def rows(*told: tuple[str, float, float, float, str]) -> list[dict[str, str]]:
    """Return rows of name, truth, estimate, half-width, mark, one flight each."""
    found = []
    for seed, (name, true, estimate, half, mark) in enumerate(told):
        answered = mark != MISSING
        found.append({
            "seed": str(seed), "name": name, "true": str(true), "reference": str(abs(true)),
            "estimate": str(estimate) if answered else "",
            "half_width": str(half) if answered else "", "mark": mark,
        })  # fmt: skip
    return found


def test_the_score_is_least_for_the_interval_that_is_true() -> None:
    error = np.abs(np.random.default_rng(1).standard_normal(200_000))
    scores = {w: float(interval_score(error, np.full(len(error), w)).mean()) for w in (1, 1.96, 3)}
    assert scores[1.96] == pytest.approx(4.675, rel=0.01)  # 2 phi(1.96) / 0.025
    assert scores[1.96] < min(scores[1], scores[3])


def test_what_is_right_and_what_is_wrong_go_by_the_mark() -> None:
    own = judged(
        rows(
            ("M_q", -10.0, -10.9, 0.5, TRUSTED),
            ("M_q", -10.0, -11.5, 0.5, TRUSTED),
            ("M_q", -10.0, -11.5, 2.0, CAREFUL),
            ("M_q", -10.0, -13.5, 2.0, CAREFUL),
            ("M_q", -10.0, -10.1, 0.5, REFUSED),
            ("M_q", -10.0, -10.1, 0.5, SMALL),  # it is not: refused
            ("M_q", -10.0, 0.0, 0.0, MISSING),
            ("short period", 19.0, 30.0, 0.1, MODE),  # not judged
        )
    )
    part = {name: int(of.sum()) for name, of in shares(own).items()}
    assert part == {
        "right, trust": 1, "right, care": 0, "right, refused": 2, "wrong, trust": 1,
        "wrong, care": 1, "care, 10 to 30 % off": 1, "refused": 0, "missing": 1,
    }  # fmt: skip
    assert own.score().tolist()[4:] == [2.0, 2.0, 2.0]  # as +-100 %
    found = figures(own, {"M_q": 0.1})
    assert found["relied on of right"].value == pytest.approx(100.0 / 3.0)
    assert found["coverage"].value == pytest.approx(50.0)  # what is missing is not answered


def test_a_right_one_that_is_refused_costs_more_than_a_width() -> None:
    told, refused = (
        judged(rows(*[("M_q", -10.0, -10.3, 1.0, mark)] * 4)) for mark in (TRUSTED, REFUSED)
    )
    scale = {"M_q": 0.03}
    assert figures(told, scale)["score"].value == pytest.approx(0.2 / 0.03)
    assert figures(refused, scale)["score"].value == pytest.approx(2.0 / 0.03)
    assert rms_errors(refused)["M_q"] == pytest.approx(0.03)


def test_honest_widths_have_a_ratio_of_one() -> None:
    rng = np.random.default_rng(2)
    error = np.abs(0.05 * rng.standard_normal(4000))

    def of(width: float) -> float:
        flags = np.ones(len(error), dtype=bool)
        own = Judged(
            np.repeat(np.arange(1000), 4), np.full(len(error), "M_q"), flags, error,
            np.full(len(error), width), flags, ~flags, flags,
        )  # fmt: skip
        return figures(own, {"M_q": 0.05})["honesty"].value

    assert of(1.96 * 0.05) == pytest.approx(1.0, abs=0.01)
    assert of(0.3 * 1.96 * 0.05) > 2.0
    assert of(3.0 * 1.96 * 0.05) > 2.0


def test_the_true_linear_model_answers_as_the_worn_aircraft_does() -> None:
    """With the air at the tail as a state of its own, and in derivatives without it."""
    rng = np.random.default_rng(3)
    plane = drawn_aircraft(rng, draw(rng))
    place = [0, 2, 4, EPSILON]

    def rates(change: np.ndarray, elevator: float = 0.0) -> np.ndarray:
        x, out = np.zeros(STATES), np.zeros(22)
        x[0], x[2] = SPEED_MPS * np.cos(plane.trim_alpha), SPEED_MPS * np.sin(plane.trim_alpha)
        x[7] = plane.trim_alpha
        x[place] += change
        motion(plane, x, np.array([plane.trim_de + elevator, 0.0, 0.0]), np.zeros(3), out)
        return out[place]

    assert rates(np.zeros(4)) == pytest.approx(np.zeros(4), abs=1e-6)  # in trim
    slopes = np.column_stack([rates(d) - rates(-d) for d in 1e-5 * np.eye(4)]) / 2e-5
    d = true_derivatives(plane, SPEED_MPS, plane.trim_alpha, plane.trim_de)
    least = true_derivatives(
        plane._replace(wash_lag=1e-9), SPEED_MPS, plane.trim_alpha, plane.trim_de
    )
    at = 1j * short_period_radps(least)

    def pitch_rate(a: np.ndarray, b: np.ndarray, at: complex = at) -> complex:
        return complex(np.linalg.solve(at * np.eye(len(a)) - a, b)[1])

    # w, q and the air at the tail; the airspeed is held.
    whole = slopes[1:, 1:]
    forced = (rates(np.zeros(4), 1e-5) - rates(np.zeros(4), -1e-5))[1:] / 2e-5
    two = np.array([[d["Z_alpha"], 1.0 + d["Z_q"]], [d["M_alpha"], d["M_q"]]])
    control = np.array([d["Z_de"], d["M_de"]])
    assert pitch_rate(two, control) == pytest.approx(pitch_rate(whole, forced), rel=0.03)
    # What answers the inputs best is another model, but where the air at the tail is in time.
    best, in_time = best_moments(plane), best_moments(plane._replace(wash_lag=1e-4))
    assert in_time["M_alpha"] == pytest.approx(least["M_alpha"], rel=0.01)
    better = np.array([two[0], [best["M_alpha"], best["M_q"]]])
    moved = np.array([d["Z_de"], best["M_de"]])

    def missed(a: np.ndarray, b: np.ndarray) -> float:
        """Over the frequencies of steps of 0.25 and 0.35 s."""
        every = 1j * np.arange(1.0, 25.0)
        return float(
            sum(abs(pitch_rate(a, b, s) - pitch_rate(whole, forced, s)) ** 2 for s in every)
        )

    assert missed(better, moved) < 0.5 * missed(two, control)
    assert d["M_q"] < 1.1 * least["M_q"]  # alpha' damps with q
    force = 0.5 * DENSITY_KGPM3 * SPEED_MPS**2 * plane.area
    stiff = force * plane.chord * plane.Cm_alpha / plane.iyy
    assert least["M_alpha"] == pytest.approx(stiff, rel=0.01)


def test_the_errors_of_unknown_sensors_are_another_draw_for_each_flight() -> None:
    t = np.arange(200) * 0.01
    true = {name: np.zeros(200) for name in (
        "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps", "phi_rad", "theta_rad",
        "ax_mps2", "ay_mps2", "az_mps2", "elevator_rad", "aileron_rad", "rudder_rad",
    )} | {"t_s": t, "airspeed_mps": np.full(200, 18.0)}  # fmt: skip
    one, other = (with_default_errors(true, np.random.default_rng(s)) for s in (1, 2))
    for name in ("alpha_rad", "q_radps", "ax_mps2", "airspeed_mps", "elevator_rad"):
        assert one[name][0] not in (true[name][0], other[name][0])
    assert np.array_equal(one["t_s"], t)


def test_every_world_has_the_nine_and_truth_for_all() -> None:
    for world in WORLDS.values():
        assert len(PRINCIPAL & set(world.names)) == 9
    true = {"t_s": np.arange(0.0, 100.0, 0.01)} | {
        name: np.full(10_000, value)
        for name, value in (("airspeed_mps", 18.0), ("alpha_rad", 0.05), ("elevator_rad", 0.0))
    }
    truth = truth_of(true)["maneuver"][0]["dimensional"]
    assert set(DERIVATIVES) <= set(truth)
    assert truth["M_alpha"] == pytest.approx(-88.8, rel=0.01)  # q S c Cm_alpha / Iyy


def test_the_table_is_printed_from_rows_that_are_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = tmp_path / "rows.csv"
    with kept.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        for seed in (1, 2):
            for name in DERIVATIVES:
                writer.writerow({
                    "world": "twin, no file", "seed": seed, "name": name, "true": 1.0,
                    "reference": 1.0, "estimate": 1.2, "half_width": 0.05, "mark": TRUSTED,
                    "cpu_s": 3.0,
                })  # fmt: skip
    asked = ["--flights", "2", "--only", "twin, no file", "--rows", str(kept)]
    assert program.main(asked) == 0
    lines = capsys.readouterr().out.splitlines()
    [first, *_] = [x for x in lines if "nine principal" in x]
    assert first.split("|")[7].strip() == "100 +- 39 !"  # wrong under trust, of two flights
