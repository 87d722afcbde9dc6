"""--maneuver, --from and --to: each sample is fitted once, and what cannot be is said why."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.errors import IdentificationError
from host.sysid.flight import read_columns
from host.sysid.maneuvers import AXES, detect_maneuvers, grade
from host.sysid.maneuvers.maneuver_selection import (
    excited_axes,
    merge_overlapping,
    overlap_notes,
    select_maneuvers,
)
from host.sysid.models import model_from

import host
from tests.host.sysid.at_hand import identify

Columns = dict[str, np.ndarray]
SHORT_PERIOD = model_from(
    {
        "states": ["alpha_rad", "q_radps"],
        "inputs": ["elevator_rad"],
        "outputs": ["alpha_rad", "q_radps"],
        "state_biases": ["alpha_rad", "q_radps"],
        "initial_states": ["alpha_rad", "q_radps"],
        "A": [["Z_alpha", 1.0], ["M_alpha", "M_q"]],
        "B": [["Z_de"], ["M_de"]],
    }
)


@pytest.fixture(scope="module")
def flight(simulated: Callable[[str, int], Path]) -> Columns:
    """Calm air: a 3-2-1-1 and a doublet of the elevator, doublets of aileron and rudder."""
    return read_columns(simulated("calm", 3) / "flight.csv")[0]


def fitted(columns: Columns, **options: Any) -> list[tuple[float, float]]:
    """Return the stretches that one model was fitted to."""
    [answer] = identify(columns, method="equation-error", **options)
    return [f.fit_window() for f in answer.used]


def test_a_stretch_of_two_surfaces_is_one_record(flight: Columns) -> None:
    found = detect_maneuvers(flight)
    windows = select_maneuvers(flight, stretches=[(found[2].start_s - 1.0, found[3].end_s)])
    assert {f.axis for f in windows} == {"aileron_rad", "rudder_rad"}
    assert len(fitted(flight, names=("lateral",), windows=windows)) == 1


def test_a_maneuver_named_twice_counts_once(flight: Columns) -> None:
    windows = select_maneuvers(flight, numbers=(2, 1, 2))
    assert windows == detect_maneuvers(flight)[:2]


def test_a_model_without_constants_is_simulated_as_it_is(flight: Columns) -> None:
    bare = replace(SHORT_PERIOD, state_biases=(), initial_states=())
    [answer] = identify(flight, names=("own",), user_model=bare, method="equation-error")
    assert all(np.isfinite(y).all() and np.ptp(y) > 0.0 for y in answer.simulated)
    assert [y.shape for y in answer.simulated] == [m.outputs.shape for m in answer.maneuvers]


def test_a_model_of_ones_own_is_fitted_where_its_input_moved(flight: Columns) -> None:
    expected = [f.fit_window() for f in detect_maneuvers(flight) if f.axis == "elevator_rad"]
    assert len(expected) == 2
    assert fitted(flight, names=("own",), user_model=SHORT_PERIOD) == expected
    with pytest.raises(IdentificationError, match="no maneuver of elevator_rad for model; found"):
        identify(
            flight, names=("own",), user_model=SHORT_PERIOD, windows=detect_maneuvers(flight)[2:]
        )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"stretches": [(100.0, 120.0)]}, "0 samples, at least 8 .* from 0.02 to 39"),
        ({"stretches": [(12.0, 14.0), (15.0, 15.01)]}, "samples, at least 8"),
        ({"stretches": [(12.0, 12.3)]}, r"0\.3\d* s of data, at least 0\.9 s"),
        ({"stretches": [(20.0, 10.0)]}, "start is not before the end"),
        ({"stretches": [(float("nan"), None)]}, "start is not before the end"),
        ({"stretches": [(12.0, None)], "numbers": [1]}, "excludes argument from_s"),
        ({"numbers": [5]}, "no maneuver 5: there are 4"),
        ({"numbers": [0]}, "no maneuver 0: there are 4"),
    ],
)
def test_what_cannot_be_chosen_says_why(
    options: dict[str, Any], words: str, flight: Columns
) -> None:
    with pytest.raises(IdentificationError, match=words):
        select_maneuvers(flight, **options)


def test_a_gap_divides_a_stretch(flight: Columns) -> None:
    t = flight["t_s"]
    gap = {**flight, "bridged": ((t > 14.0) & (t < 14.5)).astype(float)}
    before, after = merge_overlapping(select_maneuvers(gap, stretches=[(12.0, 16.0)]))
    assert before.fit_window() == pytest.approx((12.0, 14.0), abs=0.011)
    assert after.fit_window() == pytest.approx((14.5, 16.0), abs=0.011)
    with pytest.raises(IdentificationError, match="nothing but gaps"):
        select_maneuvers(gap, stretches=[(14.1, 14.4)])
    none = {**flight, **{f"{s}_rad": 0.0 * t for s in ("elevator", "aileron", "rudder")}}
    with pytest.raises(IdentificationError, match="none was found"):
        select_maneuvers(none, numbers=[1])


def test_a_part_of_a_stretch_at_rest_belongs_to_what_moved_in_it(flight: Columns) -> None:
    """Noise of the ailerons behind a gap made a lateral answer of an elevator maneuver."""
    t, rng = flight["t_s"], np.random.default_rng(1)
    last = max(f.input_end_s for f in detect_maneuvers(flight) if f.axis == "elevator_rad")
    gap = {**flight, "bridged": ((t > last + 0.5) & (t < last + 1.0)).astype(float)}
    for name in ("elevator_rad", "aileron_rad", "rudder_rad"):
        level = np.where(t > last + 0.5, flight[name][0], flight[name])
        gap[name] = level + 1e-4 * rng.standard_normal(len(t))
    found = select_maneuvers(gap, stretches=[(last - 2.0, last + 3.0)])
    assert [f.axis for f in found] == ["elevator_rad", "elevator_rad"]


def test_stretches_that_overlap_are_said(flight: Columns, tmp_path: Path) -> None:
    """They are one: no sample counts twice; those that only touch stay two."""
    assert overlap_notes([(12.0, 14.0), (14.0, 16.0)]) == []
    assert overlap_notes([(16.0, None), (12.0, 14.0)]) == []
    assert overlap_notes([(12.0, 16.0), (9.0, 13.0)]) == [
        "stretches overlap from 12 s on: fitted as one, no sample twice"
    ]
    assert "from 14 s on" in overlap_notes([(12.0, None), (14.0, None)])[0]
    path = tmp_path / "x.csv"
    pd.DataFrame(flight).to_csv(path, index=False)
    found = host.identify(
        path,
        models="short-period",
        methods="equation-error",
        stretches=[(12.0, 16.0), (15.0, 20.0)],
    )
    assert any("overlap from 15 s on" in line for line in found.verdict)


def test_a_stretch_is_a_maneuver_whatever_moved_in_it(flight: Columns) -> None:
    """A model asked for is fitted where another surface led; by default it is left out."""
    [aileron] = [f for f in detect_maneuvers(flight) if f.axis == "aileron_rad"]
    windows = select_maneuvers(flight, stretches=[aileron.fit_window()])
    assert {f.axis for f in windows} == {"aileron_rad"}
    elevator = flight["elevator_rad"] + 0.01 * np.sin(5.0 * flight["t_s"])
    columns = {**flight, "elevator_rad": elevator}
    options: dict[str, Any] = {"windows": windows, "method": "equation-error"}
    [answer] = identify(columns, names=("own",), user_model=SHORT_PERIOD, **options)
    assert [f.fit_window() for f in answer.used] == [pytest.approx(aileron.fit_window(), abs=0.02)]
    assert [one.template for one in identify(columns, **options)] == ["lateral"]


def test_stretches_are_neither_graded_nor_held_out(flight: Columns) -> None:
    t, elevator = flight["t_s"], np.zeros(len(flight["t_s"]))
    for first in (12.0, 16.0, 20.0):
        elevator[(t >= first) & (t < first + 0.3)] = 0.05
    columns = {**flight, "elevator_rad": elevator}
    stretches = [(12.0, 14.0), (16.0, 18.0), (20.0, 22.0)]  # each begins with its input
    windows = select_maneuvers(columns, stretches=stretches)
    used = fitted(columns, names=("own",), user_model=SHORT_PERIOD, windows=windows)
    assert used == [pytest.approx(span, abs=0.011) for span in stretches]


def test_missing_columns_are_named_not_stumbled_over(flight: Columns) -> None:
    few = {k: flight[k] for k in ("t_s", "elevator_rad", "alpha_rad")}
    mark = grade(few, detect_maneuvers(few)[0])
    assert mark.score == 0.0
    assert mark.remarks == ("no q_radps: cannot be graded",)
    with pytest.raises(IdentificationError, match="needs airspeed_mps"):
        identify(few, names=("longitudinal",))


def test_one_reason_for_two_models_is_said_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    t = np.arange(0.0, 5.0, 0.02)
    path = tmp_path / "still.csv"
    rows = [f"{x:.2f},17.0,0.01,0.0" for x in t]
    path.write_text("\n".join(["t_s,airspeed_mps,elevator_rad,q_radps", *rows]) + "\n")
    assert main(["identify", str(path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("host: short-period, lateral: no maneuver found")
    assert said.count("no maneuver found") == 1


@pytest.mark.parametrize(
    ("model", "words"),
    [
        ("longitudnal", r"no model 'longitudnal' \(did you mean longitudinal\?\); there are"),
        ("missing.TOML", "missing.TOML: no such file or folder"),
        (".", "a folder; name a file in it"),
    ],
)
def test_a_wrong_model_is_said_before_the_data_are_read(
    model: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "no.csv").write_text("no table")
    assert main(["identify", str(tmp_path / "no.csv"), "--model", model]) == 2
    assert re.search(words, capsys.readouterr().err)


def test_a_misspelt_signal_of_a_model_is_guessed(flight: Columns) -> None:
    model = replace(SHORT_PERIOD, outputs=("alpha_rad", "q_rad"), delays=())
    with pytest.raises(IdentificationError, match=r"needs q_rad \(did you mean q_radps\?\)"):
        identify(flight, names=("own",), user_model=model)


def test_a_model_may_name_columns_of_its_own(tmp_path: Path) -> None:
    t = np.arange(0.0, 10.0, 0.02)
    rows = [f"{x:.2f},17.0,{0.1 * np.sin(x):.6f},{np.cos(x):.6f}" for x in t]
    path, mapping = tmp_path / "own.csv", tmp_path / "map.toml"
    path.write_text("\n".join(["t_s,airspeed_mps,elevator_pot_rad,Flex 3", *rows]) + "\n")
    lines = '[columns]\nflex_3 = { from = "Flex 3", scale = 2.0 }\n'
    mapping.write_text(lines + 'elevator_pot_rad = "elevator_pot_rad"\n')
    assert "elevator_pot_rad" not in read_columns(path)[0]
    columns, _ = read_columns(path, mapping, also=("elevator_pot_rad", "flex_3"))
    t = columns["t_s"]
    np.testing.assert_allclose(columns["flex_3"], 2.0 * np.cos(t), atol=1e-5)
    np.testing.assert_allclose(columns["elevator_pot_rad"], 0.1 * np.sin(t), atol=1e-5)


def test_maneuvers_of_a_model_are_those_its_inputs_name() -> None:
    assert excited_axes(("elevator_pot_rad", "rudder_rad")) == ("elevator_rad", "rudder_rad")
    assert excited_axes(("gust_mps",)) == AXES
